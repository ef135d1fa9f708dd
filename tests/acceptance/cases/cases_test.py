"""cases_test.py --programs FOLDER --shared FOLDER CASE: files in the shapes in
which people bring them, and what the programs should make of each: a row of
shared/cases/README.md a function. What is hidden in them stands there too.

Programs get some processor time, not a time by the clock: other work may run.
"""

import argparse
import json
import re
import resource
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

CPU_S = 120

ARM = {"shoulder.friction": 1.2, "elbow.friction": 0.5, "shoulder.damping": 0.8, "elbow.damping": 0.3,
       "shoulder.armature": 0.05, "elbow.armature": 0.02}
ROTOR = {"wrist.friction": 0.12, "wrist.damping": 0.05, "wrist.armature": 0.006}
EFFECTS = ("--add", "coulomb_friction@*,viscous_damping@*,armature@*")
SOLVERS = ("lm", "inverse_dynamics")


class Ran:
    def __init__(self, done, folder):
        self.code, self.text = done.returncode, done.stdout + done.stderr
        result = folder / "result.json"
        self.json = json.loads(result.read_text()) if result.exists() else None
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.cpu_s = usage.ru_utime + usage.ru_stime

    def expect(self, *texts, without=()):
        for text in texts:
            assert text in self.text, f"not said: {text}\n{self.text}"
        for text in without:
            assert text not in self.text, f"said: {text}\n{self.text}"
        return self

    def hint(self):
        """The --columns that it suggests, as the shell takes it."""
        flag = re.search(r"--columns (.*)", self.text)
        assert flag, self.text
        return shlex.split(flag[1].split(";")[0])[0]

    def findings(self):
        return {finding["fault"]: finding for finding in self.json["findings"]}


class Case:
    """A folder of files for one model."""

    def __init__(self, programs, shared, model):
        self.programs, self.shared, self.model = programs, shared, shared / model

    def run(self, program, files, *flags, columns=None):
        files = [files] if isinstance(files, str) else files
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            command = [self.programs / program, "--model", self.model, "--traj",
                       ",".join(str(self.shared / file) for file in files), "--json", folder / "result.json", *flags]
            if columns:
                command += ["--columns", columns]
            limit = lambda: resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            done = subprocess.run(command, text=True, capture_output=True, preexec_fn=limit)
            ran = Ran(done, folder)
            ran.cpu_s -= before
            print(" ".join(map(str, command)), f"\n{ran.text}", sep="")
            return ran

    def fit(self, files, *flags, columns=None, solver="lm"):
        return self.run("sysid_fit", files, "--solver", solver, *flags, columns=columns)

    def check(self, files, *flags, columns=None):
        return self.run("sysid_check", files, *flags, columns=columns)

    def finds(self, truth, files, columns=None, flags=EFFECTS, within=0.05, solvers=SOLVERS):
        """The parameters, by each solver: within a part of the truth, or four standard errors."""
        values = {}
        for solver in solvers:
            ran = self.fit(files, *flags, columns=columns, solver=solver)
            assert ran.code in (0, 1) and ran.json, ran.text
            found = {p["name"]: p for p in ran.json["parameters"]}
            for name, value in truth.items():
                allowed = max(within * abs(value), 4 * (found[name]["std_error"] or 0))
                assert abs(found[name]["value"] - value) < allowed, (files, solver, name, found[name])
            values[solver] = {name: found[name]["value"] for name in truth}
        return values

    def refused(self, files, columns=None):
        ran = self.fit(files, columns=columns)
        assert ran.code == 2, ran.text
        return ran


def alike(a, b, part=0.01):
    for solver, values in a.items():
        for name, value in values.items():
            assert abs(value - b[solver][name]) < part * abs(value), (solver, name, value, b[solver][name])


def names_differ(case):
    arm = case("cases/arm2.urdf")
    folder = "cases/names_differ/"
    prefix = arm.refused(folder + "prefix.csv").hint()
    for name in ("shoulder", "elbow"):
        assert f"{name}.q=left_{name}.q" in prefix and f"{name}.tau=left_{name}.tau" in prefix, prefix
    arm.finds(ARM, folder + "prefix.csv", prefix)

    index = arm.refused(folder + "index.csv").expect("by the order of the columns").hint()
    assert index == "t=time,shoulder.q=q0,elbow.q=q1,shoulder.qd=dq0,elbow.qd=dq1,shoulder.tau=tau0,elbow.tau=tau1"
    arm.finds(ARM, folder + "index.csv", index)

    alpha = arm.refused(folder + "index_alpha.csv").expect(without=["the order of"]).hint()
    assert alpha == "t=time,shoulder.q=shoulder_pos,elbow.q=elbow_pos,shoulder.tau=shoulder_eff,elbow.tau=elbow_eff"
    arm.finds(ARM, folder + "index_alpha.csv", alpha)

    swapped = arm.refused(folder + "swapped.csv").expect("by the order of the columns").hint()
    found = arm.check(folder + "swapped.csv", columns=swapped).findings()
    right = "t=time,shoulder.q=q2,elbow.q=q1,shoulder.tau=tau2,elbow.tau=tau1"
    assert found["joints_swapped"]["remedies"][0] == "--columns " + right, found
    arm.finds(ARM, folder + "swapped.csv", right)

    nohdr = arm.refused(folder + "nohdr.txt").expect("there is no header").text
    nohdr = re.search(r"--columns (\S+)", nohdr)[1]
    assert nohdr.startswith("t=#1,shoulder.q=#2,elbow.q=#3"), nohdr
    arm.finds(ARM, folder + "nohdr.txt", nohdr)


def ros2_topic_echo_csv(case):
    arm = case("cases/arm2.urdf")
    plain = arm.finds(ARM, "cases/tables/run.csv")
    alike(plain, arm.finds(ARM, "cases/ros2_topic_echo_csv/run.csv"))


def staggered_topics(case):
    arm = case("cases/arm2.urdf")
    file = "cases/staggered_topics/run.csv"
    columns = arm.refused(file).hint()
    for name in ("shoulder", "elbow"):
        for ours, topic in (("q", "position"), ("qd", "velocity")):
            assert f"{name}.{ours}=/joint_states/{name}/{topic}" in columns, columns
    assert "shoulder.tau=/torque_cmd/data[0],elbow.tau=/torque_cmd/data[1]" in columns, columns
    arm.finds(ARM, file, columns)
    said = arm.fit(file, *EFFECTS, columns=columns).expect("its times count from its first row").text
    assert "1746215066.098755" in said and "1.746" not in said, said


def tables(case):
    arm = case("cases/arm2.urdf")
    folder = "cases/tables/"
    plain = arm.finds(ARM, folder + "run.csv")
    iso = arm.refused(folder + "run_iso.csv").hint()
    assert iso == "t=timestamp"
    alike(plain, arm.finds(ARM, folder + "run_iso.csv", iso))
    excel = "t=Zeit,shoulder.q=Winkel Schulter,elbow.q=Winkel Ellbogen," \
            "shoulder.tau=Moment Schulter,elbow.tau=Moment Ellbogen"
    arm.finds(ARM, folder + "run_excel.csv", excel)
    arm.fit(folder + "run_excel.csv", columns=excel).expect("row of units", "shoulder.q in [°]")
    alike(plain, arm.finds(ARM, folder + "run_time2.csv"))
    arm.fit(folder + "run_time2.csv").expect("the rows are taken as even, 0.005 s apart (200 Hz)")
    alike(plain, arm.finds(ARM, folder + "run_dup.csv"), 1e-6)
    said = arm.fit(folder + "run_dup.csv").expect("48 rows of 2449 say the same as the row before").text
    assert said.count("say the same") == 1


def effort_not_measured(case):
    arm = case("cases/arm2.urdf")
    for name in ("zero", "denormal", "nan"):
        file = f"cases/effort_not_measured/{name}.csv"
        checked = arm.check(file)
        assert "effort_not_measured" in checked.findings() and checked.cpu_s < 10, checked.findings()
        for solver in SOLVERS:
            fitted = arm.fit(file, *EFFECTS, solver=solver).expect("efforts are not measured")
            assert fitted.cpu_s < 60 and fitted.json["iterations"] < 400
            assert all(abs(p["value"]) < 1e4 for p in fitted.json["parameters"]), fitted.json["parameters"]


def servo_units(case):
    arm = case("cases/arm2.urdf")
    columns = "t=timestamp,shoulder.q=shoulder.pos,elbow.q=elbow.pos"
    file = "cases/servo_units/run.csv"
    arm.refused(file, columns).expect(
        "no angle in radians", "beyond the limits -3 to 3 rad", "a unit that is not known here",
        "sensor_gain@shoulder,sensor_offset@shoulder")
    plain = "t=timestamp,shoulder.q=shoulder.pos*1,elbow.q=elbow.pos*1"
    assert "beyond_limits" in arm.check(file, columns=plain).findings()
    ticks = arm.check("cases/servo_units/run_ticks.csv", columns=columns).findings()["ticks"]
    assert "4096 a turn" in ticks["evidence"], ticks
    right = shlex.split(ticks["remedies"][0])[1]
    assert "shoulder.q=(shoulder.pos-2048)*2*pi/4096" in right, right
    mended = arm.run("sysid_fit", "cases/servo_units/run_ticks.csv", "--check", "numbers", columns=right)
    mended.expect(without=["ticks:", "beyond_limits"])


def wrap(case):
    rotor = case("cases/wrap/rotor.urdf")
    plain = rotor.finds(ROTOR, "cases/wrap/unwrapped.csv")
    for name, position in (("0_2pi", None), ("pm_pi", None), ("deg360", "wrist_deg*0.0174532925"),
                           ("turns", "wrist_rev*2*pi")):
        file, columns = f"cases/wrap/wrap_{name}.csv", None
        if position:
            columns = rotor.refused(file).hint()
            assert columns == f"wrist.q={position},wrist.tau=wrist_tau", columns
        alike(plain, rotor.finds(ROTOR, file, columns))


def hobby_servo(case):
    servo = case("cases/hobby_servo/servo.urdf")
    files = [f"cases/hobby_servo/log_{name}.csv" for name in "ab"]
    columns = servo.refused(files).hint()
    assert columns == "t=time_ms*0.001,servo.q=pos_deg*0.0174532925,servo.cmd=goal_deg*0.0174532925", columns
    truth = {"servo.kp": 9, "servo.kd": 0.22, "servo.drive_delay": 0.02, "servo.friction": 0.07,
             "servo.damping": 0.03, "servo.armature": 0.012}
    ran = servo.run("sysid_diagnose", files, "--auto", columns=columns)
    found = ran.json["final_fit"]["parameters"]
    for name, value in truth.items():
        assert abs(found[name] / value - 1) < 0.05, (name, found[name])


def mimic(case):
    gripper = case("cases/mimic/gripper.urdf")
    plain = gripper.finds({}, "cases/mimic/run.csv", flags=EFFECTS)
    assert plain is not None
    said = gripper.fit("cases/mimic/run.csv", *EFFECTS, solver="inverse_dynamics")
    said.expect("efforts of joints that follow others (<mimic>) are added: finger_right.tau to finger_left.tau")
    found = {p["name"]: p["value"] for p in said.json["parameters"]}
    # Both fingers' efforts: half of it without.
    assert abs(found["finger_left.friction"] - 3.0) < 0.05 and abs(found["finger_left.damping"] - 15.0) < 0.5, found
    file = "cases/mimic/run_width_mm.csv"
    asked = gripper.refused(file).expect("no joint's by name: width_mm")
    assert asked.hint() == "t=time,lift.q=lift_mm*0.001,lift.tau=lift_force", asked.hint()
    right = asked.hint() + ",finger_left.q=width_mm*0.0005,finger_left.tau=grip_force"
    found = {p["name"]: p["value"] for p in
             gripper.fit(file, *EFFECTS, columns=right, solver="inverse_dynamics").json["parameters"]}
    assert abs(found["finger_left.friction"] - 3.0) < 0.05, found
    metres = right.replace("lift_mm*0.001", "lift_mm")
    assert "millimetres" in gripper.check(file, columns=metres).findings()


def rest(case):
    pendulum = case("cases/rest/pend.urdf")
    files = ["cases/rest/a.csv", "cases/rest/b.csv"]
    ran = pendulum.run("sysid_diagnose", files, "--auto").expect("a.csv: at rest from 16", "b.csv: at rest from 13")
    final = ran.json["final"]
    # Beside both an armature of a thousandth of the inertia is added, which does no harm to them.
    assert {"coulomb_friction@hinge", "viscous_damping@hinge"} <= set(final["effects"]), final
    found = ran.json["final_fit"]["parameters"]
    assert abs(found["hinge.friction"] / 0.0035 - 1) < 0.05, found
    assert abs(found["hinge.damping"] / 0.0015 - 1) < 0.1, found


def tiago(case):
    """Position, velocity and effort in files of their own, of one arm of a whole robot."""
    robot = case("data/tiago/tiago.urdf")
    joints = ["torso_lift_joint"] + [f"arm_{i}_joint" for i in range(1, 8)]
    columns = ",".join(
        [f"{j}.q=- {j}_position" for j in joints] + [f"{j}.qd=velocity.csv/- {j}_velocity" for j in joints] +
        [f"{j}.tau=effort.csv/- {j}_effort" for j in joints])
    ran = robot.fit("data/tiago/position.csv", "--check", "none", *EFFECTS[:1], "coulomb_friction@*",
                    columns=columns, solver="inverse_dynamics")
    assert ran.code in (0, 1) and ran.json["samples"] == 8022, ran.json["samples"]
    assert ran.text.count("held still") == 1, ran.text
    ran.expect("no recording shows", "caster_back_left_2_joint", "head_1_joint", "gripper_finger_joint=0.002",
               without=["its motion is estimated", "their motions are estimated"])


CASES = (names_differ, ros2_topic_echo_csv, staggered_topics, tables, effort_not_measured, servo_units, wrap,
         hobby_servo, mimic, rest, tiago)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--shared", type=Path, required=True)
    parser.add_argument("case", choices=[case.__name__ for case in CASES])
    given = parser.parse_args()
    programs, shared = given.programs.resolve(), given.shared.resolve()
    if not (shared / "cases").is_dir():
        print("skipped: no", shared / "cases")
        sys.exit(77)
    case = next(c for c in CASES if c.__name__ == given.case)
    case(lambda model: Case(programs, shared, model))


main()
