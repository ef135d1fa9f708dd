"""Identification of an arm by its inverse dynamics with Pinocchio's regressor,
NumPy and SciPy, as people write it: a Butterworth filter, differences, three
weighted least squares.

    pinocchio_arm.py ARM.urdf RUN.csv STATES.txt CUT_OFF EVERY

as figaroh_arm.py, and prints the same JSON.
"""

import json
import sys

import numpy as np
import pinocchio
from scipy.signal import butter, filtfilt

STEP = 5e-3  # rad/s: a sign that is smooth at rest


def regressor(model, q, qd, qdd):
    """Samples x joints x (10 of each link, then viscous friction, Coulomb
    friction and rotor of each joint)."""
    data = model.createData()
    n, m = model.nv, 10 * (model.njoints - 1)
    rows = np.zeros((len(q), n, m + 3 * n))
    for k in range(len(q)):
        rows[k, :, :m] = pinocchio.computeJointTorqueRegressor(
            model, data, q[k], qd[k], qdd[k])
    for i in range(n):
        rows[:, i, m + i] = qd[:, i]
        rows[:, i, m + n + i] = qd[:, i] / np.sqrt(qd[:, i]**2 + STEP**2)
        rows[:, i, m + 2 * n + i] = qdd[:, i]
    return rows


def main():
    urdf, recording, states, cut_off, every = sys.argv[1:]
    model = pinocchio.buildModelFromUrdf(urdf)
    with open(recording, encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    names = lines[0].strip().split(",")
    table = np.loadtxt(lines[1:], delimiter=",")
    t = table[:, 0]
    h = (t[-1] - t[0]) / (len(t) - 1)
    b, a = butter(4, float(cut_off) * 2 * h)
    q, tau = (filtfilt(b, a, table[:, [names.index(f"{joint}.{column}")
                                       for joint in list(model.names)[1:]]],
                       axis=0) for column in ("q", "tau"))
    qd = np.gradient(q, h, axis=0)
    qdd = np.gradient(qd, h, axis=0)
    edge = int(0.05 / h)
    keep = slice(edge, len(q) - edge, int(every))
    q, qd, qdd, tau = q[keep], qd[keep], qdd[keep], tau[keep]
    n = model.nv
    rows = regressor(model, q, qd, qdd)
    weight = np.ones(n)
    for _ in range(3):
        A = (rows / weight[None, :, None]).reshape(-1, rows.shape[2])
        size = np.linalg.norm(A, axis=0)
        size[size == 0] = 1.0
        x, _, rank, _ = np.linalg.lstsq(A / size, (tau / weight).reshape(-1),
                                        rcond=1e-6)
        x /= size
        weight = (tau - np.einsum("nij,j->ni", rows, x)).std(0)
    at = np.loadtxt(states)
    other = regressor(model, at[:, :n], at[:, n:2 * n], at[:, 2 * n:])
    print(json.dumps({
        "base": int(rank),
        "efforts": np.einsum("nij,j->ni", other, x).tolist()}))


if __name__ == "__main__":
    main()
