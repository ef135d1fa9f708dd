"""machines_test.py --programs FOLDER CASE: machines with several effects that
their models do not have, simulated here by none of sysid's own physics.

furuta: a rotary pendulum, driven by a voltage, with two encoders of 2048 lines.
Without friction and back-EMF no rollout follows it, so that the free mass and
inertia end far off; all three effects are named all the same.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("skipped: no python3-numpy")
    sys.exit(77)

# kg, m, kg m^2 of the pendulum; of the arm with its rotor; N m/A, Ohm.
MASS, COM, ARM, INERTIA, SPIN = 0.024, 0.0645, 0.085, 3.3e-5, 1e-7
ROTOR, TORQUE_CONSTANT, RESISTANCE = 1.8e-4 + 0.095 * 0.075**2, 0.042, 8.4
COULOMB, VISCOUS, PIVOT = 2.5e-3, 2e-4, 5e-5  # N m, N m s/rad
COUNTS, RATE, PARTS, DURATION = 2048, 500, 10, 12.0

FURUTA = """<robot name="furuta"><link name="base"/>
<link name="arm"><inertial><origin xyz="0.075 0 0"/><mass value="0.095"/>
<inertia ixx="1e-6" ixy="0" ixz="0" iyy="1.8e-4" iyz="0" izz="1.8e-4"/></inertial></link>
<link name="pendulum"><inertial><origin xyz="0 0 -0.0645"/><mass value="0.024"/>
<inertia ixx="3.3e-5" ixy="0" ixz="0" iyy="3.3e-5" iyz="0" izz="1e-7"/></inertial></link>
<joint name="motor" type="continuous"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 0.2"/><axis xyz="0 0 1"/></joint>
<joint name="pivot" type="continuous"><parent link="arm"/><child link="pendulum"/>
<origin xyz="0.085 0 0"/><axis xyz="1 0 0"/></joint></robot>
"""


def rates(x, volt):
    """Of (arm, pendulum, and their velocities), by Lagrange's equations."""
    _, b, ad, bd = x
    s, c = np.sin(b), np.cos(b)
    m11 = ROTOR + MASS * (ARM**2 + (COM * s) ** 2) + INERTIA * s * s + SPIN * c * c
    m12 = MASS * ARM * COM * c
    m22 = MASS * COM**2 + INERTIA
    turn = 2 * s * c * (MASS * COM**2 + INERTIA - SPIN)
    current = (volt - TORQUE_CONSTANT * ad) / RESISTANCE
    torque = TORQUE_CONSTANT * current - COULOMB * np.tanh(ad / 0.01) - VISCOUS * ad
    b1 = torque - turn * ad * bd + MASS * ARM * COM * s * bd * bd
    b2 = -PIVOT * bd + 0.5 * turn * ad * ad - MASS * 9.81 * COM * s
    det = m11 * m22 - m12 * m12
    return np.array([ad, bd, (m22 * b1 - m12 * b2) / det, (m11 * b2 - m12 * b1) / det])


def record(path, seed):
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0, 2 * np.pi, 6)
    frequency = np.array([0.3, 0.7, 1.1, 1.7, 2.3, 3.1])
    line, h = 2 * np.pi / COUNTS, 1 / RATE / PARTS
    x = np.array([0.0, 0.3, 0.0, 0.0])
    rows = []
    for k in range(int(DURATION * RATE) + 1):
        volt = 0.8 * np.sin(2 * np.pi * frequency * k / RATE + phase).sum()
        rows.append([k / RATE, *(np.round(x[:2] / line) * line), volt])
        for _ in range(PARTS):
            k1 = rates(x, volt)
            k2 = rates(x + h / 2 * k1, volt)
            k3 = rates(x + h / 2 * k2, volt)
            k4 = rates(x + h * k3, volt)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    np.savetxt(path, rows, fmt="%.7g", delimiter=",", comments="", header="time,arm,pendulum,volt")


def furuta(programs, folder):
    (folder / "furuta.urdf").write_text(FURUTA)
    for seed in (1, 2, 3):
        record(folder / f"run{seed}.csv", seed)
    done = subprocess.run(
        [programs / "sysid_diagnose", "--model", "furuta.urdf", "--traj", "run1.csv,run2.csv", "--holdout", "run3.csv",
         "--columns", f"t=time,motor.q=arm,pivot.q=pendulum,motor.tau=volt*{TORQUE_CONSTANT / RESISTANCE}",
         "--free", "pendulum.mass,arm.inertia_scale", "--auto", "--json", "diagnosis.json"],
        cwd=folder, text=True, capture_output=True)
    print(done.stdout, done.stderr)
    diagnosis = json.loads((folder / "diagnosis.json").read_text())
    assert diagnosis["verdict"] == "missing_effect", diagnosis["verdict"]
    wanted = {"coulomb_friction@motor", "viscous_damping@motor", "viscous_damping@pivot"}
    assert set(diagnosis["final"]) == wanted, diagnosis["final"]
    found = diagnosis["final_fit"]["parameters"]
    truth = {"motor.friction": COULOMB, "motor.damping": VISCOUS + TORQUE_CONSTANT**2 / RESISTANCE,
             "pivot.damping": PIVOT, "pendulum.mass": MASS}
    for name, value in truth.items():
        # The friction simulated here is not quite dry, and encoders round.
        assert abs(found[name] / value - 1) < 0.05, (name, found[name])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("case", choices=["furuta"])
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        {"furuta": furuta}[given.case](given.programs.resolve(), Path(name))


main()
