"""formula_laws_test.py --programs FOLDER LAW: a formula is proposed for a law
that the catalogue lacks, and it predicts held-out runs within 1.2 of the noise.
With --suite instead: what is proposed for each law, and what a force table
leaves; and how often a formula is offered where there is none to find: on an arm
that its model describes, and on one that a random force drives.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
    import scipy  # noqa: F401
except ImportError:
    print("skipped: no python3-scipy")
    sys.exit(77)

from formula_laws import SHAPES
from lacking_laws import DAMPING, Law, plain, simulate, write_recording, write_recordings

ROBOTS = Path(__file__).resolve().parents[3] / "data" / "robots"
# What the arm has beside the law, and its model too.
SPEC = 'effects: ["viscous_damping@*", armature@joint2]\n'
CLOSE = 1.2  # times the noise


def run(programs, folder, program, *flags):
    done = subprocess.run(
        [programs / program, "--model", "arm.urdf", "--traj", "run_1.csv,run_2.csv", "--holdout", "run_3.csv",
         "--json", "result.json", *flags], cwd=folder, text=True, capture_output=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout, json.loads((folder / "result.json").read_text())


def set_up(folder):
    shutil.copy(ROBOTS / "pendulum2_planar.urdf", folder / "arm.urdf")
    (folder / "arm.sysid.yaml").write_text(SPEC)


def record(law, folder):
    set_up(folder)
    write_recordings(law, folder, SHAPES)


def diagnose(programs, folder):
    return run(programs, folder, "sysid_diagnose", "--auto")


def check(programs, law, folder):
    text, diagnosis = diagnose(programs, folder)
    print(text)
    proposals = diagnosis["proposals"]
    assert proposals, diagnosis["sentence"]
    best = proposals[0]
    assert best["custom"].startswith(f"custom@{SHAPES[law].joints[0]}: "), best
    assert best["holdout"] < CLOSE and best["cv_error"] < CLOSE, best
    assert best["custom"] in text and "--add" in text, text
    # What is offered is what --add takes, and fits as well from where that starts.
    _, fit = run(programs, folder, "sysid_fit", "--add", ",".join([best["custom"], *best["with"]]),
                 "--segment", str(best["segment_s"]))
    names = {parameter["name"] for parameter in fit["parameters"]}
    assert names >= set(best["parameters"]), names
    assert fit["error"]["holdout"]["normalized_rms"] < CLOSE, fit["error"]["holdout"]


def table(programs, law, folder):
    """Held-out errors, times the noise, as given and with a force table."""
    joint = SHAPES[law].joints[0]
    errors = []
    for flags in ([], ["--add", f"force_table@{joint}"]):
        _, fit = run(programs, folder, "sysid_fit", "--segment", "1", "--out", "out", *flags)
        errors.append(fit["error"]["holdout"]["normalized_rms"])
    assert (folder / "out" / f"{joint}.force_table.csv").exists()
    return errors


def random_force(seed):
    """A force of 0.15 N m on joint 2, correlated over 0.3 s."""
    rng = np.random.default_rng(1000 + seed)
    w = rng.uniform(0.1, 2.0, 40) * 2 * np.pi
    a = rng.normal(size=40) / np.sqrt(1.0 + (0.3 * w) ** 2)
    p = rng.uniform(0, 2 * np.pi, 40)
    size = 0.15 / np.sqrt(0.5 * (a**2).sum())

    def force(t, q, qd, u, x):
        return u - DAMPING * qd + np.array([0.0, size * (a * np.sin(w * t + p)).sum()]), []

    return Law(force, ("joint2",))


def suite(programs, only):
    formulas = halved = 0
    for law in only or SHAPES:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            record(law, folder)
            _, diagnosis = diagnose(programs, folder)
            before, after = table(programs, law, folder)
        best = (diagnosis["proposals"] or [None])[0]
        close = best is not None and best["holdout"] < CLOSE
        formulas += close
        halved += after < 0.5 * before
        said = "none" if best is None else f"{best['custom']} {best['with'] or ''} held out {best['holdout']:.3g}"
        print(f"{law:22} {diagnosis['verdict']:15} {said}; table {before:.3g} -> {after:.3g}", flush=True)
    print(f"formulas within {CLOSE}: {formulas}, errors halved by a table: {halved}, of {len(only or SHAPES)}")


def nulls(programs, count):
    offered = {"complete": 0, "random force": 0}
    for seed in range(1, count + 1):
        for kind in offered:
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                set_up(folder)
                for number in (1, 2, 3):
                    own = 10 * seed + number
                    law = Law(plain, ()) if kind == "complete" else random_force(own)
                    write_recording(simulate(kind, own, {kind: law}), folder / f"run_{number}.csv")
                _, diagnosis = diagnose(programs, folder)
            offered[kind] += bool(diagnosis["proposals"])
            print(seed, kind, diagnosis["verdict"], diagnosis["proposals"], flush=True)
    print(f"offered: {offered} of {count} each")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("--suite", action="store_true")
    parser.add_argument("--nulls", type=int, default=0)
    parser.add_argument("law", nargs="*", choices=[[], *sorted(SHAPES)])
    given = parser.parse_args()
    programs = given.programs.resolve()
    if given.nulls:
        nulls(programs, given.nulls)
    elif given.suite:
        suite(programs, given.law)
    else:
        with tempfile.TemporaryDirectory() as folder:
            record(given.law[0], Path(folder))
            check(programs, given.law[0], Path(folder))


main()
