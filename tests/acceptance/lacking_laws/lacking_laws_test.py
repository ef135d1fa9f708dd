"""lacking_laws_test.py --programs FOLDER LAW: what sysid_diagnose --auto says of
an arm with a law that the catalogue lacks. It must not name an effect that is
not there, and must show the missing force on the joint where it acts. Of a law
that the catalogue has it must name the effect, and no other.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy  # noqa: F401
    import scipy  # noqa: F401
except ImportError:
    print("skipped: no python3-scipy")
    sys.exit(77)

from lacking_laws import LAWS, write_recordings

ROBOTS = Path(__file__).resolve().parents[3] / "data" / "robots"
# What the arm has beside the law, and its model too.
SPEC = 'effects: ["viscous_damping@*", armature@joint2]\n'
GIVEN = {"viscous_damping@joint1", "viscous_damping@joint2", "armature@joint2"}


def diagnose(programs, law, folder):
    shutil.copy(ROBOTS / "pendulum2_planar.urdf", folder / "arm.urdf")
    (folder / "arm.sysid.yaml").write_text(SPEC)
    runs = write_recordings(law, folder)
    done = subprocess.run(
        [programs / "sysid_diagnose", "--model", "arm.urdf", "--traj", ",".join(runs[:2]), "--holdout", runs[2],
         "--auto", "--json", "diagnosis.json"],
        cwd=folder, text=True, capture_output=True)
    print(done.stdout, done.stderr)
    assert done.returncode == 0, done.returncode
    return json.loads((folder / "diagnosis.json").read_text())


def check(law, diagnosis):
    verdict = diagnosis["verdict"]
    named = set(LAWS[law].named)
    if named:
        assert verdict == "missing_effect", verdict
        final = set(diagnosis["final"]["effects"]) - GIVEN
        assert named <= final, f"{named} is not in {final}"
        joints = {name.split("@")[1] for name in named}
        assert all(name.split("@")[1] in joints for name in final - named), f"beside it: {final - named}"
        return
    if verdict != "unexplained":
        # What is recommended. At large, some laws are one of the catalogue.
        wrong = {f"{added['effect']}@{added['target']}" for added in diagnosis["added"]} - set(LAWS[law].at_large)
        assert not wrong, f"named: {wrong}"
        assert verdict in ("missing_effect", "undecided"), verdict
    if verdict == "unexplained":
        assert "--add" not in diagnosis["next_command"], diagnosis["next_command"]
        assert "no effect of the catalogue explains it" in diagnosis["sentence"], diagnosis["sentence"]
    shown = {joint["joint"] for joint in diagnosis["where"]["joints"] if joint["significant"]}
    assert shown & set(LAWS[law].joints), f"the force is shown on {shown}"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--programs", type=Path, required=True)
    parser.add_argument("law", choices=sorted(LAWS))
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        check(given.law, diagnose(given.programs.resolve(), given.law, Path(folder)))


main()
