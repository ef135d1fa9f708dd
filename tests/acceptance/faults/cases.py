"""Recordings without a planted fault: the clean cases.

Those of `set` are for setting the detector's constants, those of `judge` for
the published figures. No machine is in both.
"""

import dataclasses
import math
import os
import tempfile
from pathlib import Path

import urdf
from draw import Draw
from table import Table, read_table, write_table

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parents[2]
ROBOTS = SOURCE / "data" / "robots"
MODELS = HERE / "models"

_BALL = {"q": ("qw", "qx", "qy", "qz"), "qd": ("wx", "wy", "wz"),
         "tau": ("taux", "tauy", "tauz")}


@dataclasses.dataclass
class Case:
    name: str
    model: str  # URDF's file name
    urdf: str  # its text
    spec: str  # of NAME.sysid.yaml beside it; "" is none
    runs: dict  # file name -> Table
    columns: dict  # ours -> the file's, where they differ
    flags: dict  # of the command, --columns included
    recorded: bool = False
    mirror: bool = False  # all positions and efforts negated: also a motion
    truth: str = ""  # what the mechanism has that the model lacks

    def __post_init__(self):
        self.links, joints = urdf.parse(self.urdf)
        self.all_joints = joints
        self.joints = {j.name: j for j in urdf.moving(joints)}

    def file_columns(self, token):
        """The file's columns of "joint1.q"; [] where it is not measured."""
        joint, kind = token.rsplit(".", 1)
        names = [kind]
        if self.joints[joint].kind == "ball":
            names = _BALL[kind]
        columns = [self.columns.get(joint + "." + n, joint + "." + n)
                   for n in names]
        first = next(iter(self.runs.values()))
        return columns if all(c in first for c in columns) else []

    def first_name(self, token):
        """Our name of a token's first column: a quaternion's is joint1.qw."""
        joint, kind = token.rsplit(".", 1)
        ball = self.joints[joint].kind == "ball"
        return joint + "." + (_BALL[kind][0] if ball else kind)

    def measured(self, kind=None):
        """Tokens "joint.q", "joint.qd", "joint.tau" that the runs have."""
        return [joint + "." + k for joint in self.joints
                for k in ("q", "qd", "tau")
                if kind in (None, k) and self.file_columns(joint + "." + k)]

    def time(self):
        return self.columns.get("t", "t")

    def copy(self):
        return dataclasses.replace(
            self, runs={name: t.copy() for name, t in self.runs.items()},
            columns=dict(self.columns), flags=dict(self.flags))

    def write(self, folder):
        """Its files; the flags of a command that is run in the folder."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / self.model).write_text(self.urdf)
        if self.spec:
            name = self.model.removesuffix(".urdf") + ".sysid.yaml"
            (folder / name).write_text(self.spec)
        for name, table in self.runs.items():
            write_table(table, folder / name)
        return {"model": self.model, "traj": ",".join(self.runs),
                **self.flags}


def model_files(folder, name):
    return ((folder / (name + ".urdf")).read_text(),
            (folder / (name + ".sysid.yaml")).read_text())


# --- by sysid_simulate ------------------------------------------------------


def _simulated(programs, seed, name, sets, lacking, excite, duration, tilt,
               runs=2, mirror=True):
    """sets: parameter -> nominal value, drawn 10 % around; lacking: effects
    with their size, of which half of the seeds have one that the model has
    not."""
    draw = Draw("case", name, seed)
    flags = ["--model", name, "--excite", excite, "--duration", str(duration),
             "--tilt", str(tilt), "--noise", "0.001"]
    values = ["%s=%.6g" % (n, v * draw.uniform(0.9, 1.1))
              for n, v in sets.items()]
    flags += ["--set", ",".join(values)]
    truth = ""
    if lacking and draw.coin():
        effect, size = draw.one_of(lacking)
        truth = "%s=%.4g" % (effect, size * draw.log_uniform(0.5, 2.0))
        flags += ["--add", truth]
    tables = {}
    with tempfile.TemporaryDirectory() as folder:
        for i in range(runs):
            file = "ab"[i] + ".csv"
            programs.simulate(
                flags + ["--seed", str(1000 * seed + i + 1), "--out_csv",
                         file], folder)
            tables[file] = read_table(Path(folder) / file)
    text, spec = model_files(ROBOTS, name)
    return Case(name, name + ".urdf", text, spec, tables, {}, {},
                mirror=mirror, truth=truth)


def pendulum2_planar(programs, seed):
    return _simulated(
        programs, seed, "pendulum2_planar",
        {"link1.length": 0.5, "link2.length": 0.5},
        [("coulomb_friction@joint1", 0.03), ("viscous_damping@joint2", 0.02),
         ("spring@joint1", 0.3)], "multisine", 5, 0.6)


def pendulum3_planar(programs, seed):
    return _simulated(
        programs, seed, "pendulum3_planar",
        {"link1.length": 0.5, "link2.length": 0.5, "link3.length": 0.5},
        [("coulomb_friction@joint1", 0.03), ("viscous_damping@joint3", 0.02)],
        "multisine", 5, 0.4)


def pendulum3(programs, seed):
    return _simulated(
        programs, seed, "pendulum3",
        {"link1.length": 0.5, "link2.length": 0.5, "link3.length": 0.5},
        [("viscous_damping@joint1", 0.03)], "none", 5, 0.5, runs=1,
        mirror=False)


def pendulum2(programs, seed):
    return _simulated(
        programs, seed, "pendulum2",
        {"link1.length": 0.5, "link2.length": 0.5},
        [("viscous_damping@joint2", 0.02)], "none", 5, 0.6, mirror=False)


# --- by MuJoCo --------------------------------------------------------------


@dataclasses.dataclass
class Drive:
    """How one joint is moved: held at a reference, or by an effort."""
    start: float
    effort: float = 0.0  # amplitude of the sum of three sines, N m or N
    amplitude: float = 0.0  # of the reference
    # Gains of a computed torque; 0: not driven. Held for 10 ms, a kd beyond
    # 200/s is not stable.
    kp: float = 0.0  # 1/s^2
    kd: float = 0.0  # 1/s


def _sines(draw, amplitude):
    """A sum of three sines of 0.2 to 1.6 Hz that begins at zero."""
    terms = [(draw.log_uniform(0.2, 1.6), draw.uniform(0, 2 * math.pi))
             for _ in range(3)]

    def value(t):
        return amplitude / 3.0 * sum(
            math.sin(2 * math.pi * f * t + p) - math.sin(p) for f, p in terms)

    return value


def _recorded_by_mujoco(programs, seed, name, folder, drives, lacking,
                        loose, friction=None, duration=5.0, rate=100,
                        noise=5e-4, velocities=False, foreign=False, runs=2,
                        mirror=False):
    """lacking: {joint: {attribute: size}} of MuJoCo that half of the seeds
    have one of; loose: links whose mass is drawn 10 % around the model's;
    friction: what the specification fits."""
    if programs.mujoco is None:
        return None
    draw = Draw("case", name, seed)
    text, spec = model_files(folder, name)
    links, joints = urdf.parse(text)
    for link in loose:
        links[link].mass *= draw.uniform(0.9, 1.1)
    extra = {j: dict(a) for j, a in (friction or {}).items()}
    truth = ""
    if lacking and draw.coin():
        joint, attribute, size = draw.one_of(lacking)
        size *= draw.log_uniform(0.5, 2.0)
        extra.setdefault(joint, {})[attribute] = size
        truth = "%s@%s=%.4g" % (attribute, joint, size)
    model = urdf.to_mjcf(links, joints, extra)
    order = [j.name for j in urdf.moving(joints)]
    rows = int(duration * rate) + 1
    tables, columns = {}, {}
    for i in range(runs):
        one = Draw("run", name, seed, i)
        efforts = {j: _sines(one, drives[j].effort) for j in order}
        reference = {j: _sines(one, drives[j].amplitude) for j in order}
        start = {j: drives[j].start + (0.1 * one.uniform(-1, 1))
                 for j in order}
        # Steps of at most 0.5 ms.
        numbers = ["%d %d %r %d" % (len(order), rows, 1.0 / rate,
                                    math.ceil(2000 / rate))]
        for values in (start.values(), [0.0] * len(order),
                       [drives[j].kp for j in order],
                       [drives[j].kd for j in order]):
            numbers.append(" ".join(repr(float(v)) for v in values))
        for row in range(rows):
            t = row / rate
            numbers.append(" ".join(
                repr(efforts[j](t)) for j in order))
            numbers.append(" ".join(repr(start[j] + reference[j](t))
                                    for j in order))
        with tempfile.TemporaryDirectory() as scratch:
            states = programs.record(model, numbers, scratch)
        n = len(order)
        table = Table({"t": [row / rate for row in range(rows)]})
        for k, j in enumerate(order):
            table[j + ".q"] = [s[k] + noise * one.normal() for s in states]
            if velocities:
                table[j + ".qd"] = [s[n + k] + 10 * noise * one.normal()
                                    for s in states]
            drive = drives[j]
            if drive.effort or drive.kp:
                table[j + ".tau"] = [s[2 * n + k] for s in states]
        if foreign:
            names = {"t": "stamp"}
            for j in order:
                names.update({j + ".q": "enc_" + j, j + ".qd": "speed_" + j,
                              j + ".tau": "drive_" + j})
            table.rename(names)
            columns = {ours: theirs for ours, theirs in names.items()
                       if theirs in table}
        tables["ab"[i] + ".csv"] = table
    flags = {}
    if columns:
        flags["columns"] = ",".join("%s=%s" % c for c in columns.items())
    return Case(name, name + ".urdf", text, spec, tables, columns, flags,
                mirror=mirror, truth=truth)


def cartpole(programs, seed):
    return _recorded_by_mujoco(
        programs, seed, "cartpole", ROBOTS,
        {"slider": Drive(0.0, effort=4.0, kp=5.0, kd=0.8),
         "hinge": Drive(0.5)},
        [("slider", "damping", 0.3), ("hinge", "damping", 0.003),
         ("slider", "frictionloss", 0.2)], ["cart", "pole"], mirror=True)


def scara(programs, seed):
    return _recorded_by_mujoco(
        programs, seed, "scara", MODELS,
        {"shoulder": Drive(0.2, amplitude=1.2, kp=100.0, kd=15.0),
         "elbow": Drive(-0.4, amplitude=1.2, kp=100.0, kd=15.0)},
        [("shoulder", "armature", 0.01), ("elbow", "armature", 0.003)],
        ["lower"],
        {"shoulder": {"damping": 0.3, "frictionloss": 0.2},
         "elbow": {"damping": 0.1, "frictionloss": 0.1}}, velocities=True,
        mirror=True)


def lift(programs, seed):
    return _recorded_by_mujoco(
        programs, seed, "lift", MODELS,
        {"rail": Drive(0.3, amplitude=0.5, kp=100.0, kd=15.0),
         "pivot": Drive(0.4, amplitude=1.0, kp=100.0, kd=15.0)},
        [("rail", "frictionloss", 1.0), ("pivot", "armature", 0.005)],
        ["carriage", "arm"],
        {"rail": {"damping": 15.0}, "pivot": {"damping": 0.1}},
        velocities=True, foreign=True)


def rotary_pendulum(programs, seed):
    return _recorded_by_mujoco(
        programs, seed, "rotary_pendulum", MODELS,
        {"motor": Drive(0.0, effort=0.06, amplitude=0.5, kp=8.0, kd=0.5),
         "swing": Drive(0.5)},
        [("motor", "frictionloss", 0.004), ("motor", "armature", 3e-4)],
        ["pendulum"],
        {"motor": {"damping": 2e-3}, "swing": {"damping": 1e-4}},
        velocities=True)


def three_axes(programs, seed):
    return _recorded_by_mujoco(
        programs, seed, "three_axes", MODELS,
        {"column": Drive(0.0, amplitude=1.0, kp=100.0, kd=15.0),
         "shoulder": Drive(-0.4, amplitude=0.8, kp=100.0, kd=15.0),
         "elbow": Drive(0.6, amplitude=1.0, kp=100.0, kd=15.0)},
        [("shoulder", "armature", 0.04), ("elbow", "stiffness", 1.0)],
        ["upper", "lower"],
        {j: {"damping": 0.4, "frictionloss": 0.3}
         for j in ("column", "shoulder", "elbow")},
        velocities=True, foreign=True)


def arm7(programs, seed):
    start = (0.0, 0.3, 0.2, -1.2, 0.1, 0.6, 0.0)
    return _recorded_by_mujoco(
        programs, seed, "arm7", ROBOTS,
        {"joint%d" % (i + 1): Drive(start[i], amplitude=0.7, kp=144.0,
                                    kd=20.0) for i in range(7)},
        [("joint4", "damping", 0.3), ("joint2", "frictionloss", 0.5)],
        ["link%d" % i for i in range(2, 8)], duration=4.0, runs=1)


# --- recorded ---------------------------------------------------------------


def real_data():
    """The folder of the real recordings, or None."""
    folder = Path(os.environ.get("SYSID_REAL_DATA",
                                 SOURCE.parent / "shared" / "data"))
    return folder if folder.is_dir() else None


def _recorded(name, model_folder, files, columns, until=math.inf, every=1,
              change=None, mirror=False):
    """Cut at `until` s (of one, or of each file) and thinned: the suite asks
    hundreds of fits of it."""
    folder = real_data()
    if folder is None or not all((folder / f).exists() for f in files):
        return None
    text, spec = model_files(model_folder, name)
    runs = {}
    for i, file in enumerate(files):
        table = read_table(folder / file)
        t = table[columns.get("t", "t")]
        end = until[i] if isinstance(until, tuple) else until
        kept = [row for row in range(0, table.rows(), every)
                if t[row] - t[0] <= end]
        table.keep(kept)
        if change is not None:
            change(table)
        runs[Path(file).name] = table
    return Case(name, name + ".urdf", text, spec, runs, columns, {},
                recorded=True, mirror=mirror)


def double_pendulum_dfki(_programs, seed):
    """Each seed has another pair of its six runs, 5 s of each at 250 Hz."""
    names = ("143339", "143524", "143704", "143747", "144003", "144115")
    first = seed % 6
    files = ["double_pendulum_dfki/traj_%s.csv" % names[i % 6]
             for i in (first, first + 1 + (seed // 6) % 5)]
    return _recorded(
        "double_pendulum_dfki", ROBOTS, files,
        {"t": "time", "joint1.q": "pos_meas1", "joint2.q": "pos_meas2",
         "joint1.tau": "tau_meas1", "joint2.tau": "tau_meas2"}, until=5.0,
        every=2, mirror=True)


def emps(_programs, _seed, until=10.0):
    return _recorded("emps", ROBOTS, ["emps/emps.csv"],
                     {"joint1.q": "q", "joint1.tau": "force"}, until=until,
                     every=2, mirror=True)


def video_pendulum(_programs, _seed):
    return _recorded("video_pendulum", ROBOTS, ["video_pendulum/pendulum.csv"],
                     {"joint1.q": "theta"}, until=40.0, mirror=True)


def simple_pendulum_dfki(_programs, _seed):
    names = ("ddp", "direct_collocation", "energy_shaping")
    return _recorded(
        "simple_pendulum_dfki", ROBOTS,
        ["simple_pendulum_dfki/%s.csv" % name for name in names],
        {"t": "time", "joint1.q": "position", "joint1.tau": "torque"},
        until=(6.0, 3.5, 3.8), mirror=True)


def _hanging(table):
    table["joint1.q"] = [v - math.pi for v in table["theta1"]]
    if "theta2" in table:
        table["joint2.q"] = [b - a for a, b in zip(table["theta1"],
                                                   table["theta2"])]
    for name in ("theta1", "theta2"):
        table.columns.pop(name, None)


def multiarm_single(_programs, _seed):
    return _recorded("multiarm_single", MODELS,
                     ["multiarm_pendulum/single.csv"], {}, until=20.0,
                     change=_hanging, mirror=True)


def multiarm_double(_programs, _seed):
    return _recorded("multiarm_double", MODELS,
                     ["multiarm_pendulum/double.csv"], {}, until=10.0,
                     change=_hanging, mirror=True)


def falling_ball(_programs, _seed):
    return _recorded("falling_ball", MODELS,
                     ["falling_balls/bowling_1.csv",
                      "falling_balls/bowling_2.csv"],
                     {"height.q": "height"})


# No machine is in both halves, nor are seeds: odd ones set, even ones judge.
HALVES = {
    "set": [pendulum2_planar, cartpole, pendulum3, scara, lift,
            double_pendulum_dfki, emps, video_pendulum],
    "judge": [pendulum3_planar, pendulum2, rotary_pendulum, three_axes, arm7,
              simple_pendulum_dfki, multiarm_single, multiarm_double,
              falling_ball],
}
RECORDED = {f.__name__ for f in (
    double_pendulum_dfki, emps, video_pendulum, simple_pendulum_dfki,
    multiarm_single, multiarm_double, falling_ball)}
