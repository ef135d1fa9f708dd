"""arm_suite.py --programs FOLDER [--runs 50] [--null_runs 25] [--only SEED --keep FOLDER] [--out TABLE.csv]: two
seven-axis arms under feedback, with noise, friction on every axis that their
models do not have, and bodies that their URDFs give 10 to 30 % wrong. Two laws
of ten are hidden besides, or none. `sysid_diagnose --auto` must name them.

Not a test: it takes half an hour. arm_test.py runs some of its cases.
"""

import argparse
import csv
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("skipped: no python3-numpy")
    sys.exit(77)

RATE, DURATION, POSITION_NOISE, EFFORT_NOISE = 500, 20.0, 1e-4, 0.005

# Of each axis: origin of the joint in its parent, its axis, (from, to) of the
# motion, effort limit; of each link a box: its centre, its sides, its mass.
ARMS = {
    # Shoulder, elbow and wrist each with axes that meet; upright at zero.
    "upright": [
        ("0 0 0.15", "0 0 1", (-2.5, 2.5), 200, (0, -0.03, 0.12), (0.14, 0.18, 0.25), 5.8),
        ("0 0 0.19", "0 1 0", (-1.6, 1.6), 200, (0.0, 0.06, 0.04), (0.14, 0.18, 0.22), 6.4),
        ("0 0 0.21", "0 0 1", (-2.5, 2.5), 120, (0, 0.03, 0.13), (0.13, 0.16, 0.24), 4.1),
        ("0 0 0.19", "0 -1 0", (-1.7, 1.7), 120, (0, 0.06, 0.03), (0.13, 0.17, 0.2), 3.6),
        ("0 0 0.21", "0 0 1", (-2.5, 2.5), 60, (0, 0.02, 0.08), (0.1, 0.12, 0.22), 2.4),
        ("0 0 0.19", "0 1 0", (-1.7, 1.7), 40, (0, 0.01, 0.0), (0.1, 0.12, 0.12), 2.1),
        ("0 0 0.08", "0 0 1", (-2.5, 2.5), 40, (0.03, 0.01, 0.06), (0.12, 0.06, 0.1), 1.3),
    ],
    # Elbow and wrist beside the axes before; folded at zero.
    "folded": [
        ("0 0 0.33", "0 0 1", (-2.3, 2.3), 90, (0.02, -0.03, -0.08), (0.12, 0.13, 0.26), 4.2),
        ("0 0 0", "1 0 0", (-1.2, 1.4), 90, (0.0, 0.02, 0.12), (0.13, 0.12, 0.28), 3.9),
        ("0 0 0.32", "0 0 1", (-2.3, 2.3), 90, (0.03, 0.04, -0.05), (0.14, 0.14, 0.2), 3.1),
        ("0.08 0 0", "1 0 0", (-2.4, 0.3), 90, (-0.04, 0.02, 0.06), (0.14, 0.12, 0.2), 2.9),
        ("-0.08 0 0.38", "0 0 1", (-2.3, 2.3), 20, (0.01, 0.04, -0.1), (0.1, 0.12, 0.3), 2.7),
        ("0 0 0", "1 0 0", (-0.3, 2.6), 20, (0.05, 0.01, 0.01), (0.14, 0.09, 0.09), 1.5),
        ("0.09 0 0", "0 0 1", (-2.3, 2.3), 20, (0.03, 0.03, 0.08), (0.1, 0.09, 0.12), 0.9),
    ],
}
AXES = range(1, 8)

# Of a hidden law: its rms, as a share of that of its joint's effort.
SHARE = (0.12, 0.3)


def urdf(axes, scales=None):
    """The arm; with `scales`, of each link: of the mass, shifts of the centre
    as shares of the box, of the moments of inertia."""
    lines = ['<robot name="arm"><link name="base"/>']
    for k, (origin, axis, (lower, upper), effort, centre, sides, mass) in enumerate(axes, 1):
        c, m, factor = np.array(centre, float), mass, 1.0
        if scales is not None:
            m *= scales[k - 1][0]
            c = c + scales[k - 1][1] * np.array(sides)
            factor = scales[k - 1][0] * scales[k - 1][2]
        s2 = np.array(sides) ** 2
        inertia = factor * mass / 12 * np.array([s2[1] + s2[2], s2[0] + s2[2], s2[0] + s2[1]])
        parent = "base" if k == 1 else f"link{k - 1}"
        lines.append(
            f'<joint name="joint{k}" type="revolute"><origin xyz="{origin}"/><parent link="{parent}"/>'
            f'<child link="link{k}"/><axis xyz="{axis}"/>'
            f'<limit lower="{lower - 0.3}" upper="{upper + 0.3}" effort="{effort}" velocity="4"/></joint>'
            f'<link name="link{k}"><inertial><origin xyz="{c[0]:.9g} {c[1]:.9g} {c[2]:.9g}"/><mass value="{m:.9g}"/>'
            f'<inertia ixx="{inertia[0]:.9g}" iyy="{inertia[1]:.9g}" izz="{inertia[2]:.9g}" ixy="0" ixz="0" iyz="0"/>'
            "</inertial></link>"
        )
    return "\n".join(lines) + "</robot>\n"


def wrong_bodies(rng):
    """10 to 30 % off, either way."""
    def off():
        return 1 + rng.choice([-1, 1]) * rng.uniform(0.1, 0.3)
    return [(off(), rng.choice([-1, 1], 3) * rng.uniform(0.02, 0.08, 3), off()) for _ in AXES]


def reference(rng, axes):
    """A sum of five harmonics of 0.1 Hz for each axis, within its range."""
    t = np.arange(0, DURATION + 0.5 / RATE, 1 / RATE)
    k = np.arange(1, 6)
    q = []
    for _, _, (lower, upper), *_ in axes:
        a = rng.standard_normal(5) / np.sqrt(k)
        p = rng.uniform(0, 2 * np.pi, 5)
        x = (a[:, None] * np.sin(2 * np.pi * 0.1 * k[:, None] * t + p[:, None])).sum(axis=0)
        x -= x.mean()
        q.append((lower + upper) / 2 + 0.45 * (upper - lower) * x / np.abs(x).max())
    return t, np.array(q).T


def write(path, names, columns):
    np.savetxt(path, np.column_stack(columns), fmt="%.9g", delimiter=",", comments="", header=",".join(names))


def read(path):
    with open(path) as file:
        names = next(line for line in file if not line.startswith("#")).strip().split(",")
        table = np.loadtxt(file, delimiter=",")
    return names, table


def friction(axes):
    """What every axis has: dry friction of 2 % of the effort limit, viscous
    friction of as much at 1 rad/s, and a rotor. Effects, each with its
    parameters."""
    effects = {}
    for j, (_, _, _, effort, *_) in zip(AXES, axes):
        effects[f"viscous_damping@joint{j}"] = {f"joint{j}.damping": 0.02 * effort}
        effects[f"coulomb_friction@joint{j}"] = {f"joint{j}.friction": 0.02 * effort}
        effects[f"armature@joint{j}"] = {f"joint{j}.armature": 0.002 * effort}
    return effects


LAWS = ["quadratic_drag", "effort_bias", "spring", "gear_coupling", "stribeck_friction", "asymmetric_friction",
        "cubic_damping", "load_friction", "cogging", "effort_gain"]


def hidden(rng, law, j, effects, motion):
    """Plants a law on joint j, among `effects`; its name."""
    q, qd, qdd, tau = (x[:, j - 1] for x in motion)

    def rms(x):
        return float(np.sqrt(np.mean(np.square(x))))

    size, sign = rng.uniform(*SHARE) * rms(tau), rng.choice([-1.0, 1.0])
    name, joint = f"{law}@joint{j}", f"joint{j}."
    dry, viscous = f"coulomb_friction@joint{j}", f"viscous_damping@joint{j}"
    if law == "quadratic_drag":
        values = {"quadratic_drag": size / rms(qd**2)}
    elif law == "effort_bias":
        values = {"effort_bias": sign * size}
    elif law == "spring":
        rest = rng.uniform(-0.5, 0.5)
        values = {"stiffness": size / rms(q - rest), "spring_reference": rest}
    elif law == "gear_coupling":
        name = f"gear_coupling@joint{j - 1},joint{j}"
        qd_1, qdd_1 = motion[1][:, j - 2], motion[2][:, j - 2]
        values = {"coupling_armature": 0.5 * size / rms(qdd + sign * qdd_1),
                  "coupling_damping": 0.5 * size / rms(qd + sign * qd_1),
                  "coupling_friction": 0.5 * size, "coupling_sign": sign}
    elif law == "stribeck_friction":
        # Static friction of three times and more would stick and leap.
        effects.pop(dry)
        values = {"friction": size, "static_friction": size * rng.uniform(1.5, 2.5),
                  "stribeck_velocity": rng.uniform(0.2, 0.5)}
    elif law == "asymmetric_friction":
        c, d = effects.pop(dry)[joint + "friction"], effects.pop(viscous)[joint + "damping"]
        # Of dry friction alone, while the joint moves, the difference is a bias.
        more = size / rms(qd)
        values = {"friction": c, "damping": d + more, "friction_asymmetry": sign * 0.3 * c,
                  "damping_asymmetry": sign * more}
    elif law == "cubic_damping":
        values = {"cubic_damping": size / rms(qd**3)}
    elif law == "load_friction":
        values = {"load_friction": rng.uniform(*SHARE)}
    elif law == "cogging":
        phase = rng.uniform(0, 2 * np.pi)
        values = {"cogging_sin": size * np.sqrt(2) * np.sin(phase), "cogging_cos": size * np.sqrt(2) * np.cos(phase),
                  "cogging_order": float(rng.integers(3, 13))}
    else:
        values = {"effort_gain": sign * rng.uniform(0.15, 0.35)}
    effects[name] = {joint + key: value for key, value in values.items()}
    return name


def call(programs, folder, *command):
    done = subprocess.run([programs / command[0], *command[1:]], cwd=folder, text=True, capture_output=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}")


def simulate(programs, folder, axes, effects, out):
    gains = ",".join(f"joint{j}={4 * axis[3]}:{0.15 * axis[3]}" for j, axis in zip(AXES, axes))
    values = ",".join(f"{name}={value:.9g}" for one in effects.values() for name, value in one.items())
    call(programs, folder, "sysid_simulate", "--model", "true.urdf", "--track", "reference.csv", "--gains", gains,
         "--rate", str(RATE), "--duration", str(DURATION), "--noise", "0", "--add", ",".join(effects), "--set", values,
         "--out_csv", out)
    return read(folder / out)


def make_case(programs, folder, arm, laws, seed):
    """Writes arm.urdf and run.csv; the names of what was hidden beside
    friction."""
    rng = np.random.default_rng(seed)
    axes = ARMS[arm]
    (folder / "true.urdf").write_text(urdf(axes))
    (folder / "arm.urdf").write_text(urdf(axes, wrong_bodies(rng)))
    t, q = reference(rng, axes)
    write(folder / "reference.csv", ["t"] + [f"joint{j}.q" for j in AXES], [t, q])
    effects = friction(axes)
    names, table = simulate(programs, folder, axes, effects, "plain.csv")
    tau = table[:, [names.index(f"joint{j}.tau") for j in AXES]][: len(t)]
    qd = np.gradient(q, t, axis=0)
    motion = (q, qd, np.gradient(qd, t, axis=0), tau)
    planted = []
    joints = list(rng.permutation(np.arange(1, 8)))
    for law in laws:
        if law == "load_friction":
            # Of an axis that carries loads: where they do not change it is
            # Coulomb friction.
            joints.sort(key=lambda j: j in (2, 4, 6))
        # The coupled pair has no other law; its joints stand side by side.
        j = int(joints.pop())
        if law == "gear_coupling":
            while j == 1 or j - 1 not in joints:
                joints.insert(0, j)
                j = int(joints.pop())
            joints.remove(j - 1)
        planted.append(hidden(rng, law, j, effects, motion))
    names, table = simulate(programs, folder, axes, effects, "clean.csv")
    for k, name in enumerate(names):
        if name.endswith((".q", ".qd")):
            # Velocities are differences of noisy positions.
            if name.endswith(".q"):
                table[:, k] += POSITION_NOISE * rng.standard_normal(len(table))
        elif name.endswith(".tau"):
            table[:, k] += EFFORT_NOISE * table[:, k].std() * rng.standard_normal(len(table))
    keep = [k for k, name in enumerate(names) if not name.endswith(".qd")]
    write(folder / "run.csv", [names[k] for k in keep], [table[:, keep]])
    return planted


def diagnose(programs, folder):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    call(programs, folder, "sysid_diagnose", "--model", "arm.urdf", "--traj", "run.csv", "--free", "none", "--auto",
         "--json", "diagnosis.json")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (json.loads((folder / "diagnosis.json").read_text()),
            after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def is_plain(effect):
    return effect.split("@")[0] in ("viscous_damping", "coulomb_friction", "armature")


def run_case(programs, arm, laws, seed, keep=None):
    """A line of the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) if keep is None else keep
        folder.mkdir(exist_ok=True, parents=True)
        planted = make_case(programs, folder, arm, laws, seed)
        found, seconds = diagnose(programs, folder)
    effects = found["final"]["effects"]
    rest = [effect for effect in effects if effect not in planted and not is_plain(effect)]
    return {"arm": arm, "seed": seed, "planted": " ".join(planted),
            "named": sum(effect in effects for effect in planted), "superfluous": " ".join(rest),
            "missed": " ".join(effect for effect in planted if effect not in effects),
            "plain": sum(map(is_plain, effects)), "verdict": found["verdict"], "cpu_s": round(seconds, 1)}


def cases(runs, null_runs):
    """Arm, laws and seed of each: every pair of laws about equally often."""
    pairs = [[a, b] for i, a in enumerate(LAWS) for b in LAWS[i + 1:]]
    np.random.default_rng(7).shuffle(pairs)
    for number, arm in enumerate(ARMS):
        for k in range(runs):
            yield arm, pairs[(k + number * runs) % len(pairs)], 1000 * number + k
        for k in range(null_runs):
            yield arm, [], 1000 * number + 500 + k


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--runs", type=int, default=50, help="of each arm, with two hidden laws")
    parser.add_argument("--null_runs", type=int, default=25, help="of each arm, with friction alone")
    parser.add_argument("--only", type=int, help="the case with this seed")
    parser.add_argument("--keep", type=Path, help="folder of its files")
    parser.add_argument("--out", type=Path, default=Path("arms.csv"))
    given = parser.parse_args()
    lines = []
    for arm, laws, seed in cases(given.runs, given.null_runs):
        if given.only is not None and seed != given.only:
            continue
        lines.append(run_case(given.programs.resolve(), arm, laws, seed, given.keep))
        print(lines[-1], flush=True)
    with open(given.out, "w", newline="") as file:
        table = csv.DictWriter(file, lines[0].keys())
        table.writeheader()
        table.writerows(lines)
    pairs = [line for line in lines if line["planted"]]
    null = [line for line in lines if not line["planted"]]
    seconds = sorted(line["cpu_s"] for line in lines)
    print(f"both named in {sum(line['named'] == 2 for line in pairs)} of {len(pairs)}, "
          f"superfluous in {sum(line['superfluous'] != '' for line in pairs)}; "
          f"nothing but friction in {sum(line['superfluous'] == '' for line in null)} of {len(null)}; "
          f"median {seconds[len(seconds) // 2]} CPU s, longest {seconds[-1]}")


if __name__ == "__main__":
    main()
