"""Bags that rosbags and mcap wrote: the numbers of the same run as CSV."""

import numpy as np
import pytest

import sysid
from test_results import columns_of

rosbag2 = pytest.importorskip("rosbags.rosbag2")
typesys = pytest.importorskip("rosbags.typesys")

STORE = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
START_NS = 1_700_000_000_123_456_789
SQLITE, MCAP = (rosbag2.StoragePlugin.SQLITE3, rosbag2.StoragePlugin.MCAP)
MODES = rosbag2.CompressionMode


def message(kind, **fields):
    return STORE.types[kind](**fields)


def header(stamp_ns):
    return message("std_msgs/msg/Header", frame_id="", stamp=message(
        "builtin_interfaces/msg/Time", sec=stamp_ns // 10**9,
        nanosec=stamp_ns % 10**9))


def joint_state(stamp_ns, names, q, qd=(), tau=()):
    return message("sensor_msgs/msg/JointState", header=header(stamp_ns),
                   name=list(names), position=np.array(q, float),
                   velocity=np.array(qd, float), effort=np.array(tau, float))


def imu(stamp_ns, ax):
    vector, covariance = "geometry_msgs/msg/Vector3", np.zeros(9)
    return message(
        "sensor_msgs/msg/Imu", header=header(stamp_ns),
        orientation=message("geometry_msgs/msg/Quaternion", x=0, y=0, z=0,
                            w=1),
        orientation_covariance=covariance,
        angular_velocity=message(vector, x=0, y=0, z=0),
        angular_velocity_covariance=covariance,
        linear_acceleration=message(vector, x=ax, y=0, z=0),
        linear_acceleration_covariance=covariance)


def write(path, messages, storage=SQLITE, mode=None):
    """Messages as (topic, time of recording, message)."""
    writer = rosbag2.Writer(path, version=9, storage_plugin=storage)
    if mode is not None:
        writer.set_compression(mode, rosbag2.CompressionFormat.ZSTD)
    connections = {}
    with writer:
        for topic, received_ns, of in messages:
            kind = of.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, kind, typestore=STORE)
            writer.write(connections[topic], received_ns,
                         STORE.serialize_cdr(of, kind))
    return path


@pytest.fixture(scope="module")
def model():
    return sysid.load("pendulum2_planar")


@pytest.fixture(scope="module")
def columns():
    return columns_of("data/runs/hidden_1.csv")


def stamps(columns):
    return START_NS + np.round(columns["t"] * 1e9).astype(np.int64)


def swing(columns):
    """The states, with chatter between."""
    for i, stamp in enumerate(stamps(columns)):
        stamp = int(stamp)
        yield "/joint_states", stamp + 321, joint_state(
            stamp, ["joint2", "joint1"],
            [columns["joint2.q"][i], columns["joint1.q"][i]])
        if i % 7 == 0:
            yield "/chatter", stamp + 400, message("std_msgs/msg/String",
                                                   data="hello")


def assert_same_run(run, columns, rows=None):
    for name in ("joint1.q", "joint2.q"):
        np.testing.assert_array_equal(run[name], columns[name][:rows])
    np.testing.assert_array_equal(
        run.t, (stamps(columns) - START_NS)[:rows] / 1e9)


@pytest.mark.parametrize("storage, mode", [
    (SQLITE, None), (SQLITE, MODES.FILE), (SQLITE, MODES.MESSAGE),
    (MCAP, None), (MCAP, MODES.FILE), (MCAP, MODES.MESSAGE),
    (MCAP, MODES.STORAGE)])
def test_each_storage_and_compression(columns, model, tmp_path, storage,
                                      mode):
    bag = write(tmp_path / "bag", swing(columns), storage, mode)
    assert_same_run(sysid.read(bag, model), columns)


def test_one_file_of_a_bag_and_a_topic(columns, model, tmp_path):
    bag = write(tmp_path / "bag", swing(columns), MCAP)
    file = next(bag.glob("*.mcap"))
    assert_same_run(sysid.read(file, model), columns)
    assert_same_run(sysid.read(f"{file}:/joint_states", model), columns)
    with pytest.raises(sysid.InputError, match="did you mean '/joint_states'"):
        sysid.read(f"{file}:/joint_state", model)


def write_mcap(path, columns, chunk_size):
    """By the package mcap, in chunks."""
    writers = pytest.importorskip("mcap.writer")
    kind = "sensor_msgs/msg/JointState"
    text, _ = STORE.generate_msgdef(kind, ros_version=2)
    with open(path, "wb") as file:
        writer = writers.Writer(file, chunk_size=chunk_size)
        writer.start(profile="ros2")
        schema = writer.register_schema(kind, "ros2msg", text.encode())
        channel = writer.register_channel("/joint_states", "cdr", schema)
        for topic, received_ns, of in swing(columns):
            if topic == "/joint_states":
                writer.add_message(channel, received_ns, bytes(
                    STORE.serialize_cdr(of, kind)), received_ns)
        writer.finish()


def test_a_cut_file_as_far_as_it_goes(columns, model, tmp_path):
    path = tmp_path / "run.mcap"
    write_mcap(path, columns, chunk_size=4096)
    assert_same_run(sysid.read(path, model), columns)
    whole = path.read_bytes()
    path.write_bytes(whole[:len(whole) // 2])
    run = sysid.read(path, model)
    assert 0.3 * len(columns["t"]) < len(run) < len(columns["t"])
    assert_same_run(run, columns, len(run))
    assert "ends early" in run.notices[0]
    path.write_bytes(whole[:100])
    with pytest.raises(sysid.InputError, match="run.mcap"):
        sysid.read(path, model)


def test_joints_of_one_stamp_in_two_messages_are_one_row(model, tmp_path):
    bag = write(tmp_path / "bag", (
        ("/joint_states", stamp, joint_state(stamp, [joint], [i * 0.1], [],
                                             [1.0 + i]))
        for i in range(5) for stamp in [START_NS + i * 10**7]
        for joint in ("joint1", "joint2")))
    run = sysid.read(bag, model)
    assert len(run) == 5
    np.testing.assert_array_equal(run["joint2.q"], np.arange(5) * 0.1)
    np.testing.assert_array_equal(run["joint1.tau"], np.arange(5) + 1.0)


def test_without_stamps_the_times_of_recording_count(model, tmp_path):
    bag = write(tmp_path / "bag", (
        ("/joint_states", START_NS + i * 10**7,
         joint_state(0, ["joint1", "joint2"], [0.1 * i, 0.2 * i]))
        for i in range(5)))
    np.testing.assert_array_equal(sysid.read(bag, model).t,
                                  np.arange(5) * 10**7 / 1e9)


def test_numbers_of_another_topic_where_they_are_mapped(model, tmp_path):
    def messages():
        for i in range(20):
            stamp = START_NS + i * 10**7
            yield "/joint_states", stamp, joint_state(
                stamp, ["joint1", "joint2"], [0.01 * i, 0.02 * i])
            yield "/imu", stamp, imu(stamp, 0.5 * i)

    bag = write(tmp_path / "bag", messages())
    assert "base.ax" not in sysid.read(bag, model).columns
    run = sysid.read(bag, model, columns={
        "base.ax": "/imu.linear_acceleration.x"})
    assert len(run) == 20
    np.testing.assert_array_equal(run["base.ax"], np.arange(20) * 0.5)


def test_names_the_topics_where_there_are_no_joints(model, tmp_path):
    bag = write(tmp_path / "bag", [("/imu", START_NS, imu(START_NS, 1.0))])
    with pytest.raises(sysid.InputError, match="/imu .sensor_msgs/msg/Imu"):
        sysid.read(bag, model)
