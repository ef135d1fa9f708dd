"""Whole processes that identify an arm by its inverse dynamics: sysid_fit, FIGAROH
(figaroh_arm.py) and Pinocchio with NumPy (pinocchio_arm.py).

    whole_arm.py BUILD OUT.json

arm7 follows five sines a joint for 20 s at 500 Hz, with friction and rotors; all
inertial parameters, two frictions and the rotor of each axis are free. That the
URDF which all three read has the truth is of no use to them: they solve linear
least squares.

What each has found predicts the efforts of another motion, at states that are
known exactly: the error is that of the prediction, % of the rms of the efforts.
"""

import json
import math
import os
import sys
import tempfile

import numpy as np
import pinocchio
from whole_programs import HERE, measured, program_path, say, spent

TRUTH = {"damping": 0.4, "friction": 0.4, "armature": 0.05}
EFFECTS = {"damping": "viscous_damping", "friction": "coulomb_friction",
           "armature": "armature"}
CUT_OFF, EVERY = "40", "4"  # Hz; 8 ms: as people choose them
URDF = "data/robots/arm7.urdf"


def simulation(name, seed, noise):
    added = ",".join(f"{EFFECTS[k]}@*={v}" for k, v in TRUTH.items())
    return ["sysid_simulate", "--model", "arm7", "--excite", "multisine",
            "--duration", "20", "--rate", "500", "--noise", noise, "--seed",
            seed, "--add", added, "--out_csv", name]


def states(path, joints):
    """Of a motion without noise: positions, velocities, accelerations, twice a
    second and more."""
    with open(path, encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    names = lines[0].strip().split(",")
    table = np.loadtxt(lines[1:], delimiter=",")
    q = table[:, [names.index(f"{joint}.q") for joint in joints]]
    h = table[1, 0] - table[0, 0]
    qd = np.gradient(q, h, axis=0)
    qdd = np.gradient(qd, h, axis=0)
    keep = slice(100, -100, 47)
    return np.hstack([q[keep], qd[keep], qdd[keep]])


def efforts(model, at, values):
    """Of a model and {damping, friction, armature} of each joint."""
    data = model.createData()
    n = model.nv
    rows = []
    for row in at:
        q, qd, qdd = row[:n], row[n:2 * n], row[2 * n:]
        rows.append(pinocchio.rnea(model, data, q, qd, qdd) +
                    values["damping"] * qd + values["armature"] * qdd +
                    values["friction"] * np.sign(qd))
    return np.array(rows)


def ours(text, urdf, at):
    """Of what sysid_fit --json says: every number of the moving links is free."""
    fit = json.loads(text)
    value = {p["name"]: p["value"] for p in fit["parameters"]}
    model = pinocchio.buildModelFromUrdf(urdf)
    joints = list(model.names)[1:]
    for i in range(1, model.njoints):
        mass, x, y, z, xx, yy, zz, xy, xz, yz = (
            value[f"link{i}.{name}"] for name in
            ["mass", "com_x", "com_y", "com_z", "ixx", "iyy", "izz", "ixy",
             "ixz", "iyz"])
        model.inertias[i] = pinocchio.Inertia(
            mass, np.array([x, y, z]),
            np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    return {"base": len(fit["base_parameters"]),
            "efforts": efforts(model, at, {
                kind: np.array([value[f"{joint}.{kind}"] for joint in joints])
                for kind in TRUTH})}


def main():
    build, out = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    urdf = os.path.join(os.path.dirname(os.path.dirname(HERE)), URDF)
    model = pinocchio.buildModelFromUrdf(urdf)
    joints = list(model.names)[1:]
    table = []
    with tempfile.TemporaryDirectory() as folder:
        for name, seed, noise in [("arm.csv", "1", "1e-4"),
                                  ("other.csv", "2", "0")]:
            spent(program_path(build, simulation(name, seed, noise)), folder)
        at = states(os.path.join(folder, "other.csv"), joints)
        np.savetxt(os.path.join(folder, "states.txt"), at)
        truth = efforts(model, at,
                        {k: np.full(len(joints), v) for k, v in TRUTH.items()})
        fit = ["sysid_fit", "--model", "arm7", "--traj", "arm.csv", "--solver",
               "inverse_dynamics", "--free", "inertial", "--add",
               ",".join(f"{effect}@*" for effect in EFFECTS.values()),
               "--json", "-"]
        scripts = [(by, [sys.executable, os.path.join(HERE, script), urdf,
                         "arm.csv", "states.txt", CUT_OFF, EVERY])
                   for by, script in [("FIGAROH", "figaroh_arm.py"),
                                      ("Pinocchio and NumPy",
                                       "pinocchio_arm.py")]]
        for by, command in [("sysid_fit", fit), *scripts]:
            it = measured(program_path(build, command), folder)
            found = (ours(it["output"], urdf, at) if by == "sysid_fit"
                     else json.loads(it["output"]))
            apart = np.asarray(found["efforts"]) - truth
            error = 100.0 * math.sqrt((apart**2).mean() / (truth**2).mean())
            table.append({"by": by, "wall": it["wall"], "cpu": it["cpu"],
                          "base": found["base"], "error": error})
            say(f"arm7 by {by}", it, f", error {error:.2g} %")
    with open(out, "w", encoding="utf-8") as file:
        json.dump(table, file, indent=1)


if __name__ == "__main__":
    main()
