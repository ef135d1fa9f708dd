"""What inverse_dynamics_benchmark compares with: least squares on the inverse
dynamics, as people write it with NumPy and SciPy (python3-numpy, python3-scipy).

    inverse_dynamics_reference.py FOLDER

reads FOLDER/arm.json

    joints      [{"R": 3 x 3 from joint to parent, "p": origin in the parent, m,
                  "axis": unit vector}], a chain from the base
    gravity     m/s^2, along -z of the base
    cut_off     of a zero-phase Butterworth filter of fourth order, Hz
    every       keeps one sample of so many

and FOLDER/run.txt (a line a sample: t, q, tau), and prints JSON: `seconds` that
passed and `cpu`, those of the processor, without imports, but with reading;
`rank` of the columns; `left`, % of the rms of the filtered efforts; `x`, ten
inertial parameters of each link about its origin, then viscous and Coulomb
friction, rotor inertia and offset of each joint.
"""

import json
import os
import sys
import time

import numpy as np
from scipy.signal import butter, filtfilt

STEP = 5e-3  # rad/s: a sign that is smooth at rest


def skew(w):
    z = np.zeros(w.shape[:-1] + (3, 3))
    z[..., 0, 1], z[..., 0, 2], z[..., 1, 2] = -w[..., 2], w[..., 1], -w[..., 0]
    return z - np.swapaxes(z, -1, -2)


def moments(w):
    """I w as a matrix times (xx, yy, zz, xy, xz, yz)."""
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    out = np.zeros(w.shape[:-1] + (3, 6))
    out[..., 0, 0], out[..., 0, 3], out[..., 0, 4] = x, y, z
    out[..., 1, 1], out[..., 1, 3], out[..., 1, 5] = y, x, z
    out[..., 2, 2], out[..., 2, 4], out[..., 2, 5] = z, x, y
    return out


def regressor(joints, gravity, q, qd, qdd):
    """Newton and Euler, all samples at once: times x joints x 10 joints."""
    n, times = len(joints), len(q)
    rows = np.zeros((times, n, 10 * n))
    w, wd = np.zeros((times, 3)), np.zeros((times, 3))
    a = np.tile([0.0, 0.0, gravity], (times, 1))
    turned, links = [], []
    for i, (R, p, axis) in enumerate(joints):
        K = skew(axis)
        c, s = np.cos(q[:, i]), np.sin(q[:, i])
        E = R @ (np.eye(3) + s[:, None, None] * K +
                 (1 - c)[:, None, None] * (K @ K))
        a = a + np.cross(wd, p) + np.cross(w, np.cross(w, p))
        down = np.swapaxes(E, 1, 2)
        a, w, wd = (np.einsum("nij,nj->ni", down, v) for v in (a, w, wd))
        wd = wd + axis * qdd[:, i:i + 1] + np.cross(w, axis * qd[:, i:i + 1])
        w = w + axis * qd[:, i:i + 1]
        force, moment = np.zeros((times, 3, 10)), np.zeros((times, 3, 10))
        force[:, :, 0] = a
        force[:, :, 1:4] = skew(wd) + skew(w) @ skew(w)
        moment[:, :, 1:4] = -skew(a)
        moment[:, :, 4:] = moments(wd) + skew(w) @ moments(w)
        turned.append(E)
        links.append((force, moment))
    for k in range(n):
        force, moment = links[k]
        for i in range(k, -1, -1):
            rows[:, i, 10 * k:10 * k + 10] = np.einsum(
                "j,njk->nk", joints[i][2], moment)
            force = turned[i] @ force
            moment = turned[i] @ moment + skew(joints[i][1]) @ force
    return rows


def columns(joints, gravity, q, qd, qdd):
    n = len(joints)
    drives = np.zeros((len(q), n, 4 * n))
    for i in range(n):
        drives[:, i, 4 * i] = qd[:, i]
        drives[:, i, 4 * i + 1] = qd[:, i] / np.sqrt(qd[:, i]**2 + STEP**2)
        drives[:, i, 4 * i + 2] = qdd[:, i]
        drives[:, i, 4 * i + 3] = 1.0
    return np.concatenate([regressor(joints, gravity, q, qd, qdd), drives], 2)


def main():
    folder = sys.argv[1]
    start, start_cpu = time.perf_counter(), time.process_time()
    with open(os.path.join(folder, "arm.json"), encoding="utf-8") as file:
        arm = json.load(file)
    joints = [(np.array(j["R"]), np.array(j["p"]), np.array(j["axis"]))
              for j in arm["joints"]]
    n = len(joints)
    data = np.loadtxt(os.path.join(folder, "run.txt"))
    h = (data[-1, 0] - data[0, 0]) / (len(data) - 1)
    b, a = butter(4, arm["cut_off"] * 2 * h)
    q, tau = (filtfilt(b, a, part, axis=0)
              for part in (data[:, 1:n + 1], data[:, n + 1:]))
    qd = np.gradient(q, h, axis=0)
    qdd = np.gradient(qd, h, axis=0)
    edge = int(0.05 / h)
    keep = slice(edge, len(q) - edge, arm["every"])
    q, qd, qdd, tau = q[keep], qd[keep], qdd[keep], tau[keep]
    rows = columns(joints, arm["gravity"], q, qd, qdd)
    weight = np.ones(n)
    for _ in range(3):
        A = (rows / weight[None, :, None]).reshape(-1, rows.shape[2])
        y = (tau / weight).reshape(-1)
        size = np.linalg.norm(A, axis=0)
        size[size == 0] = 1.0
        x, _, rank, _ = np.linalg.lstsq(A / size, y, rcond=1e-6)
        x = x / size
        left = tau - np.einsum("nij,j->ni", rows, x)
        weight = left.std(0)
    percent = 100 * np.sqrt((left**2).mean(0) / (tau**2).mean(0))
    print(json.dumps({"seconds": time.perf_counter() - start,
                      "cpu": time.process_time() - start_cpu,
                      "rank": int(rank), "left": percent.tolist(),
                      "x": x.tolist()}))


if __name__ == "__main__":
    main()
