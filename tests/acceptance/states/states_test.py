"""states_test.py --programs FOLDER CASE: effects that remember, planted by a small
program of its own (Runge and Kutta's steps of 0.1 ms, in numpy) and found by
sysid as users run it.

presliding: a pendulum whose friction bends before it slips, with and without
Coulomb friction beside it.
elasticity: an arm whose drive is behind a spring; measured is the arm.
backlash: the same with a gap.
"""

import argparse
import json
import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

MASS, COM, INERTIA, GRAVITY = 1.2, 0.3, 0.02, 9.81
DAMPING = 0.05
RATE, DURATION, NOISE, PARTS = 200, 10.0, 1e-4, 50

URDF = f"""<robot name="arm1"><link name="stand"/>
<joint name="joint1" type="continuous"><parent link="stand"/><child link="link1"/><axis xyz="0 -1 0"/>
<dynamics damping="{DAMPING}"/></joint>
<link name="link1"><inertial><origin xyz="0 0 -{COM}"/><mass value="{MASS}"/>
<inertia ixx="{INERTIA}" iyy="{INERTIA}" izz="{INERTIA}" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>
"""


def presliding(friction, length, coulomb=0.0):
    """y = (q, qd, z)."""

    def rates(y, effort):
        q, qd, z = y
        total = effort - DAMPING * qd - friction * z - coulomb * math.tanh(qd / 1e-4)
        qdd = (total - MASS * COM * GRAVITY * math.sin(q)) / (INERTIA + MASS * COM**2)
        return (qd, qdd, (qd - abs(qd) * z) / length)

    return rates, (0.0, 0.0, 0.0)


def elastic(stiffness, damping, motor, gap=0.0, coulomb=0.0):
    """y = (q, qd, theta, theta'); the teeth's corners are rounded as sysid rounds
    them, which is part of the law. Friction is of the joint, behind the spring."""
    b = gap / 2
    s2 = (0.1 * b) ** 2

    def rates(y, effort):
        q, qd, theta, speed = y
        x = theta - q
        before, beyond = math.sqrt((x - b) ** 2 + s2), math.sqrt((x + b) ** 2 + s2)
        spring = x + (before - beyond) / 2
        slope = 1.0 if gap == 0 else 1 + ((x - b) / before - (x + b) / beyond) / 2
        force = stiffness * spring + damping * slope * (speed - qd)
        total = force - DAMPING * qd - coulomb * math.tanh(qd / 1e-4)
        qdd = (total - MASS * COM * GRAVITY * math.sin(q)) / (INERTIA + MASS * COM**2)
        return (qd, qdd, speed, (effort - force) / motor)

    return rates, (0.0, 0.0, 0.0, 0.0)


def record(path, law, amplitude, fastest, seed, parts=PARTS):
    rng = random.Random(seed)
    waves = [(rng.uniform(0.05 * fastest, fastest), rng.uniform(0, 2 * math.pi)) for _ in range(6)]
    rates, y = law
    h = 1 / RATE / parts
    with path.open("w") as file:
        file.write("t,joint1.q,joint1.tau\n")
        for k in range(round(DURATION * RATE) + 1):
            t = k / RATE
            effort = amplitude * sum(math.sin(2 * math.pi * f * t + p) for f, p in waves)
            file.write(f"{t:.6f},{y[0] + rng.gauss(0, NOISE):.9g},{effort:.9g}\n")
            for _ in range(parts):
                k1 = rates(y, effort)
                k2 = rates([a + h / 2 * b for a, b in zip(y, k1)], effort)
                k3 = rates([a + h / 2 * b for a, b in zip(y, k2)], effort)
                k4 = rates([a + h * b for a, b in zip(y, k3)], effort)
                y = [a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(y, k1, k2, k3, k4)]


def run(programs, folder, program, *flags):
    free = [] if "--spec" in flags else ["--free", "none"]
    done = subprocess.run([programs / program, "--model", "arm.urdf", "--traj", "run.csv", *free, *flags],
                          cwd=folder, text=True, capture_output=True)
    print(done.stdout, done.stderr)
    return done


def check_fit(programs, folder, planted, *flags):
    done = run(programs, folder, "sysid_fit", *flags, "--out", "fit")
    assert done.returncode == 0, done.returncode
    fit = json.loads((folder / "fit" / "fit.json").read_text())
    found = {p["name"]: p for p in fit["parameters"]}
    for name, value in planted.items():
        one = found["joint1." + name]
        off = abs(one["value"] - value) / one["std_error"]
        print(f"{name}: {one['value']:.6g} +- {one['std_error']:.2g}, planted {value}")
        # Four standard errors: several numbers, and one recording.
        assert off < 4.0, f"{name}: {one['value']}, {off:.1f} standard errors off"
    assert fit["linearization"] == "structured", fit["linearization"]
    assert fit["error"]["train"]["normalized_rms"] < 1.1, fit["error"]["train"]
    return fit


def check_diagnosis(programs, folder, *candidates):
    """Named, a diagnosis tries what is planted (the first), and tells it from what looks alike."""
    done = run(programs, folder, "sysid_diagnose", "--candidates", ",".join([*candidates, "viscous_damping@joint1"]),
               "--auto", "--json", "diagnosis.json")
    assert done.returncode == 0, done.returncode
    diagnosis = json.loads((folder / "diagnosis.json").read_text())
    assert candidates[0] in diagnosis["final"]["effects"], diagnosis["final"]


def test_presliding(programs, folder):
    record(folder / "run.csv", presliding(0.3, 0.02), 0.25, 2.0, 1)
    planted = {"presliding_friction": 0.3, "presliding_length": 0.02}
    check_fit(programs, folder, planted, "--add", "presliding_friction@joint1")
    # A pair with friction: as much of each.
    record(folder / "run.csv", presliding(0.15, 0.02, 0.1), 0.25, 2.0, 2, 4 * PARTS)
    check_fit(programs, folder, planted | {"presliding_friction": 0.15, "friction": 0.1},
              "--add", "presliding_friction@joint1,coulomb_friction@joint1")
    # The equations of motion of an instant do not know how it came there.
    done = run(programs, folder, "sysid_fit", "--add", "presliding_friction@joint1", "--solver", "inverse_dynamics",
               "--out", "refused")
    assert done.returncode == 2, done.returncode
    assert "presliding_friction@joint1" in done.stderr and "--solver lm" in done.stderr, done.stderr
    check_diagnosis(programs, folder, "presliding_friction@joint1", "coulomb_friction@joint1", "spring@joint1")
    # What is found can be read again.
    done = subprocess.run([programs / "sysid_simulate", "--model", "arm.urdf", "--add",
                           "presliding_friction@joint1=0.3", "--set", "joint1.presliding_length=0.02",
                           "--duration", "2", "--out_csv", "again.csv"],
                          cwd=folder, text=True, capture_output=True)
    assert done.returncode == 0, done.stderr


def test_elasticity(programs, folder):
    planted = {"drive_stiffness": 400.0, "drive_damping": 0.4, "motor_inertia": 0.05}
    record(folder / "run.csv", elastic(400.0, 0.4, 0.05), 2.0, 25.0, 3)
    check_fit(programs, folder, planted, "--add", "joint_elasticity@joint1")
    check_diagnosis(programs, folder, "joint_elasticity@joint1", "coulomb_friction@joint1", "spring@joint1",
                    "armature@joint1")
    record(folder / "run.csv", elastic(400.0, 0.4, 0.05, coulomb=0.1), 2.0, 25.0, 5, 4 * PARTS)
    check_fit(programs, folder, planted | {"friction": 0.1},
              "--add", "joint_elasticity@joint1,coulomb_friction@joint1")


def test_backlash(programs, folder):
    planted = {"drive_stiffness": 400.0, "drive_damping": 1.0, "motor_inertia": 0.05, "backlash": 0.04}
    record(folder / "run.csv", elastic(400.0, 1.0, 0.05, 0.04), 2.0, 8.0, 4)
    check_fit(programs, folder, planted, "--add", "backlash@joint1")
    check_diagnosis(programs, folder, "backlash@joint1", "coulomb_friction@joint1", "spring@joint1", "armature@joint1")
    record(folder / "run.csv", elastic(400.0, 1.0, 0.05, 0.04, 0.1), 2.0, 8.0, 6, 4 * PARTS)
    # From where the effect starts: a look at all samples first, by --add, ends in another minimum here.
    (folder / "spec.yaml").write_text("effects: [backlash@joint1, coulomb_friction@joint1]\nfree:\n" + "".join(
        f"  - joint1.{name}\n" for name in [*planted, "friction"]))
    check_fit(programs, folder, planted | {"friction": 0.1}, "--spec", "spec.yaml")


def main():
    cases = {"presliding": test_presliding, "elasticity": test_elasticity, "backlash": test_backlash}
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("case", choices=list(cases))
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "arm.urdf").write_text(URDF)
        cases[given.case](given.programs.resolve(), folder)


sys.exit(main())
