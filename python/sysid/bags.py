"""ROS 1 and 2 bags (sqlite3, MCAP) as named columns, by the package rosbags.

The joints of a bag are columns ``joint1.q``, ``joint1.qd``, ``joint1.tau`` and
``joint1.cmd``, as the library names those of ROS 1 bags. The numbers of another
topic are columns ``/imu.linear_acceleration.x``, where a mapping names it.
"""

import array
import pathlib
import struct
import types
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

import numpy as np

from . import formats, options
from ._errors import InputError

Values = List[Tuple[str, float]]


class _Rows:
    """Rows by stamp, s from the first; messages of one stamp and different
    columns are one row. A number takes eight bytes."""

    def __init__(self) -> None:
        self._stamps: "array.array[int]" = array.array("q")
        self._columns: Dict[str, "array.array[float]"] = {}
        self._set: set = set()

    def add(self, stamp_ns: int, values: Values) -> None:
        if (not self._stamps or self._stamps[-1] != stamp_ns
                or any(name in self._set for name, _ in values)):
            self._stamps.append(stamp_ns)
            self._set.clear()
        row = len(self._stamps) - 1
        for name, value in values:
            column = self._columns.setdefault(name, array.array("d"))
            missing = row - len(column)
            if missing > 0:
                column.extend([np.nan] * missing)
            if len(column) == row:
                column.append(value)
            else:
                column[row] = value
            self._set.add(name)

    def table(self, start_ns: int) -> formats.Table:
        stamps = np.frombuffer(self._stamps, dtype=np.int64)
        table = {"t": (stamps - start_ns) / 1e9}
        for name, column in self._columns.items():
            column.extend([np.nan] * (len(stamps) - len(column)))
            table[name] = np.frombuffer(column, dtype=np.float64)
        return table

    @property
    def first_ns(self) -> int:
        return self._stamps[0]

    def __len__(self) -> int:
        return len(self._stamps)


def _by_joint(names: Any, parts: Dict[str, Any]) -> Values:
    values: Values = []
    for suffix, numbers in parts.items():
        if len(numbers) == 0:
            continue
        if len(numbers) != len(names):
            raise ValueError(f"has {len(numbers)} values for {len(names)} "
                             "joints")
        values += [(f"{name}.{suffix}", float(number))
                   for name, number in zip(names, numbers)]
    return values


def _joint_state(message: Any) -> Values:
    return _by_joint(message.name, {"q": message.position,
                                    "qd": message.velocity,
                                    "tau": message.effort})


_INTERFACES = {"position": "q", "velocity": "qd", "effort": "tau"}


def _dynamic_joint_state(message: Any) -> Values:
    return [(f"{joint}.{_INTERFACES.get(name, name)}", float(value))
            for joint, of in zip(message.joint_names, message.interface_values)
            for name, value in zip(of.interface_names, of.values)]


def _trajectory_state(message: Any) -> Values:
    # Their names changed with ROS 2 Humble.
    is_at = getattr(message, "feedback", None) or message.actual
    wanted = getattr(message, "reference", None) or message.desired
    return _by_joint(message.joint_names, {
        "q": is_at.positions, "qd": is_at.velocities,
        "tau": is_at.effort, "cmd": wanted.positions})


# Types of messages whose numbers are those of joints, the likeliest first.
_OF_JOINTS: Dict[str, Callable[[Any], Values]] = {
    "sensor_msgs/msg/JointState": _joint_state,
    "control_msgs/msg/DynamicJointState": _dynamic_joint_state,
    "control_msgs/msg/JointTrajectoryControllerState": _trajectory_state,
}


def _numbers(name: str, value: Any, values: Values) -> None:
    """All numbers of a message, by the names of its fields, but the stamp."""
    if isinstance(value, (bool, int, float, np.number)):
        values.append((name, float(value)))
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        values += [(f"{name}[{i}]", float(number))
                   for i, number in enumerate(value.flat)]
    elif isinstance(value, (list, tuple)):
        for i, each in enumerate(value):
            _numbers(f"{name}[{i}]", each, values)
    elif hasattr(value, "__dataclass_fields__"):
        for field in value.__dataclass_fields__:
            if field not in ("header", "layout", "__msgtype__"):
                _numbers(f"{name}.{field}", getattr(value, field), values)


def _stamp_ns(message: Any) -> int:
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return 0 if stamp is None else stamp.sec * 1_000_000_000 + stamp.nanosec


def _messages(reader: Any, connections: List[Any]
              ) -> Iterator[Tuple[Any, int, Any]]:
    for connection, received_ns, data in reader.messages(connections):
        yield connection, received_ns, reader.deserialize(
            data, connection.msgtype)


def _choose(path: str, topics: Dict[str, str], topic: str) -> Optional[str]:
    """The topic of the joints; None where there is none."""
    if topic:
        if topic not in topics:
            raise InputError(f"{path}:{topic}", f"has no topic '{topic}'",
                             options.near(topic, list(topics)))
        return topic
    for kind in _OF_JOINTS:
        fit = [name for name, of in topics.items() if of == kind]
        if len(fit) == 1:
            return fit[0]
        if fit:
            raise InputError(
                path, f"several topics of the type {kind}: {', '.join(fit)}",
                f"choose one: {path}:{fit[0]}")
    return None


def _joined(tables: List[formats.Table]) -> formats.Table:
    """A row for each time of any of them."""
    if len(tables) == 1:
        return tables[0]
    t = np.unique(np.concatenate([table["t"] for table in tables]))
    joined: formats.Table = {"t": t}
    for table in tables:
        at = np.searchsorted(t, table["t"])
        for name, values in table.items():
            if name == "t":
                continue
            column = np.full(len(t), np.nan)
            column[at] = values
            joined[name] = column
    return joined


def _read_topics(path: str, reader: Any, topic: str, wanted: str
                 ) -> formats.Table:
    topics = {c.topic: c.msgtype for c in reader.connections}
    joints = _choose(path, topics, topic)
    others = [name for name in topics
              if name != joints and f"{name}." in wanted]
    if joints is None and not others:
        listed = ", ".join(f"{name} ({of})" for name, of in topics.items())
        raise InputError(
            path, "no topic of joints' states",
            "name one behind the path (run.mcap:/topic), or map its numbers: "
            "columns={'base.ax': '/imu.linear_acceleration.x'}; its topics "
            f"are {listed}" if listed else "it holds no message that is whole")
    rows: Dict[str, List[_Rows]] = {
        name: [_Rows(), _Rows()]  # by stamps, by when they were recorded
        for name in ([] if joints is None else [joints]) + others}
    unstamped = set()
    connections = [c for c in reader.connections if c.topic in rows]
    numbers: Dict[str, int] = {}
    for connection, received_ns, message in _messages(reader, connections):
        name = connection.topic
        numbers[name] = numbers.get(name, 0) + 1
        of_joints = (_OF_JOINTS.get(connection.msgtype)
                     if name == joints else None)
        values: Values = []
        try:
            if of_joints is not None:
                values = of_joints(message)
            else:
                _numbers(name, message, values)
        except ValueError as error:
            raise InputError(path, f"message {numbers[name]} of {name} {error}"
                             ) from None
        stamp_ns = _stamp_ns(message)
        if stamp_ns == 0:
            unstamped.add(name)
        if name not in unstamped:
            rows[name][0].add(stamp_ns, values)
        rows[name][1].add(received_ns, values)
    by_stamp = not unstamped  # one clock for all
    chosen = [of[0] if by_stamp else of[1] for of in rows.values()]
    chosen = [of for of in chosen if len(of) > 0]
    if not chosen:
        raise InputError(path, "holds no messages of " + ", ".join(rows))
    start_ns = chosen[0].first_ns
    return _joined([of.table(start_ns) for of in chosen])


class _CutMcap:
    """The messages of an MCAP file that ends early (its recorder was killed),
    by the package mcap, which needs no index; as AnyReader gives them."""

    def __init__(self, path: str) -> None:
        self._path = path
        stores = formats.need("rosbags.typesys")
        self._store = stores.get_typestore(stores.Stores.EMPTY)
        self._types_of = stores.get_types_from_msg
        self.connections: List[Any] = []
        known = set()
        for schema, channel, _ in self._read():
            if (channel.id in known or schema is None
                    or schema.encoding != "ros2msg"):
                continue
            known.add(channel.id)
            new = self._types_of(schema.data.decode(), schema.name)
            self._store.register({name: of for name, of in new.items()
                                  if name not in self._store.fielddefs})
            self.connections.append(types.SimpleNamespace(
                id=channel.id, topic=channel.topic, msgtype=schema.name))

    def _read(self) -> Iterator[Tuple[Any, Any, Any]]:
        reader = formats.need("mcap.reader")
        errors = formats.need("mcap.exceptions")
        with open(self._path, "rb") as file:
            messages = reader.NonSeekingReader(file).iter_messages(
                log_time_order=False)
            while True:
                try:
                    message = next(messages, None)
                except (errors.McapError, EOFError, struct.error):
                    return  # here it was cut
                if message is None:
                    return
                yield message

    def messages(self, connections: List[Any]
                 ) -> Iterator[Tuple[Any, int, bytes]]:
        by_id = {connection.id: connection for connection in connections}
        for _, channel, message in self._read():
            if channel.id in by_id:
                yield by_id[channel.id], message.log_time, message.data

    def deserialize(self, data: bytes, kind: str) -> Any:
        return self._store.deserialize_cdr(data, kind)


def read(path: str, topic: str, wanted: str, notices: List[str]
         ) -> formats.Table:
    highlevel = formats.need("rosbags.highlevel")
    stores = formats.need("rosbags.typesys")
    try:
        reader = highlevel.AnyReader(
            [pathlib.Path(path)],
            default_typestore=stores.get_typestore(stores.Stores.LATEST))
        try:
            reader.open()
        except Exception:
            if not path.endswith(".mcap"):
                raise
            table = _read_topics(path, _CutMcap(path), topic, wanted)
            notices.append(f"{path}: ends early, as when its recorder was "
                           "killed: read as far as it goes")
            return table
        try:
            return _read_topics(path, reader, topic, wanted)
        finally:
            reader.close()
    except InputError:
        raise
    except Exception as error:  # of many kinds, by storage
        raise InputError(
            path, f"cannot be read: {error}",
            "give the bag's folder, whose metadata.yaml says how it is "
            "compressed; ros2 bag reindex repairs one whose recorder was killed"
        ) from error
