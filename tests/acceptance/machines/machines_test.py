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

# kg, m, kg m^2; N/V, N s/m with the back-EMF, N; N m s/rad of the pivot.
CART, POLE, LENGTH, POLE_INERTIA = 0.8, 0.14, 0.25, 2.9e-3
FORCE, DRAG, DRY, HINGE = 2.1, 9.0, 0.5, 1.2e-3
TRACK = 2.275e-5  # m, a line of the cart's encoder

CART_URDF = """<robot name="cart"><link name="rail"/>
<link name="cart"><inertial><mass value="0.8"/>
<inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial></link>
<link name="pole"><inertial><origin xyz="0 0 -0.2"/><mass value="0.1"/>
<inertia ixx="2e-3" ixy="0" ixz="0" iyy="2e-3" iyz="0" izz="1e-5"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="20" velocity="2"/></joint>
<joint name="hinge" type="continuous"><parent link="cart"/><child link="pole"/><axis xyz="0 -1 0"/></joint></robot>
"""


def cart_rates(x, volt):
    """Of (cart, pendulum, and their velocities)."""
    _, b, v, bd = x
    s, c = np.sin(b), np.cos(b)
    m11, m12, m22 = CART + POLE, POLE * LENGTH * c, POLE * LENGTH**2 + POLE_INERTIA
    b1 = FORCE * volt - DRAG * v - DRY * np.tanh(v / 0.002) + POLE * LENGTH * s * bd * bd
    b2 = -HINGE * bd - POLE * 9.81 * LENGTH * s
    det = m11 * m22 - m12 * m12
    return np.array([v, bd, (m22 * b1 - m12 * b2) / det, (m11 * b2 - m12 * b1) / det])


def step(rates, x, volt, h):
    """By fourth-order Runge-Kutta."""
    k1 = rates(x, volt)
    k2 = rates(x + h / 2 * k1, volt)
    k3 = rates(x + h / 2 * k2, volt)
    k4 = rates(x + h * k3, volt)
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def furuta_rates(x, volt):
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
            x = step(furuta_rates, x, volt, h)
    np.savetxt(path, rows, fmt="%.7g", delimiter=",", comments="", header="time,arm,pendulum,volt")


def record_cart(path, seed):
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0, 2 * np.pi, 5)
    frequency = np.array([0.25, 0.55, 0.9, 1.3, 1.9])
    rate, parts = 200, 25
    x = np.array([0.0, 0.2, 0.0, 0.0])
    rows = []
    for k in range(20 * rate + 1):
        volt = 2.0 * np.sin(2 * np.pi * frequency * k / rate + phase).sum() - 4 * x[0]
        turned = 2 * np.pi / 4096
        rows.append([k / rate, 1e3 * np.round(x[0] / TRACK) * TRACK,
                     np.degrees(np.round(x[1] / turned) * turned), volt])
        for _ in range(parts):
            x = step(cart_rates, x, volt, 1 / rate / parts)
    np.savetxt(path, rows, fmt="%.7g", delimiter=",", comments="", header="t,mm,deg,volt")


def diagnose(programs, folder, *flags):
    done = subprocess.run([programs / "sysid_diagnose", *flags, "--auto", "--time", "1000",
                           "--json", "diagnosis.json"],
                          cwd=folder, text=True, capture_output=True)
    print(done.stdout, done.stderr)
    diagnosis = json.loads((folder / "diagnosis.json").read_text())
    assert diagnosis["verdict"] == "missing_effect", diagnosis["verdict"]
    return diagnosis


def check(found, truth):
    for name, value in truth.items():
        # The friction simulated here is not quite dry, and encoders round.
        assert abs(found[name] / value - 1) < 0.05, (name, found[name])


def furuta(programs, folder):
    (folder / "furuta.urdf").write_text(FURUTA)
    for seed in (1, 2, 3):
        record(folder / f"run{seed}.csv", seed)
    diagnosis = diagnose(
        programs, folder, "--model", "furuta.urdf", "--traj", "run1.csv,run2.csv", "--holdout", "run3.csv",
        "--columns", f"t=time,motor.q=arm,pivot.q=pendulum,motor.tau=volt*{TORQUE_CONSTANT / RESISTANCE}",
        "--free", "pendulum.mass,arm.inertia_scale")
    wanted = {"coulomb_friction@motor", "viscous_damping@motor", "viscous_damping@pivot"}
    assert set(diagnosis["final"]["effects"]) == wanted, diagnosis["final"]
    check(diagnosis["final_fit"]["parameters"],
          {"motor.friction": COULOMB, "motor.damping": VISCOUS + TORQUE_CONSTANT**2 / RESISTANCE,
           "pivot.damping": PIVOT, "pendulum.mass": MASS})


def cart(programs, folder):
    (folder / "cart.urdf").write_text(CART_URDF)
    for seed in (1, 2):
        record_cart(folder / f"run{seed}.csv", seed)
    diagnosis = diagnose(
        programs, folder, "--model", "cart.urdf", "--traj", "run1.csv,run2.csv",
        "--columns", "t=t,slide.q=mm*1e-3,hinge.q=deg*pi/180,slide.tau=volt",
        "--free", "pole.mass,pole.com_z,pole.inertia_scale")
    wanted = {"effort_gain@slide", "viscous_damping@slide", "coulomb_friction@slide", "viscous_damping@hinge"}
    assert set(diagnosis["final"]["effects"]) == wanted, diagnosis["final"]
    found = diagnosis["final_fit"]["parameters"]
    gain, centre = 1 + found["slide.effort_gain"], -found["pole.com_z"]
    # What shows, whatever the scale: of the efforts in volts, and of the swing.
    check({"damping": found["slide.damping"] / gain, "friction": found["slide.friction"] / gain,
           "length": centre + found["pole.inertia_scale"] * 2e-3 / (found["pole.mass"] * centre)},
          {"damping": DRAG / FORCE, "friction": DRY / FORCE, "length": LENGTH + POLE_INERTIA / (POLE * LENGTH)})


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("case", choices=["furuta", "cart"])
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        {"furuta": furuta, "cart": cart}[given.case](given.programs.resolve(), Path(name))


main()
