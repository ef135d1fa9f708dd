#!/usr/bin/env python3
"""Which MJCF models of published wheels load, and why others do not.

  pip download --no-deps dm-control gymnasium gymnasium-robotics robosuite
  pip install mujoco pin
  tests/acceptance/mjcf/mjcf_table.py *.whl

Each file that MuJoCo compiles by itself is translated (python/sysid/mjcf.py).
What translates is compared at three random states: accelerations by MuJoCo,
without contacts, limits and constraints, and by Pinocchio's articulated-body
algorithm on the URDF, with armatures and passive laws of the translation. With
balls and joints that follow others, which Pinocchio's URDF does not know, it is
translated, not compared.
"""

import collections
import contextlib
import os
import pathlib
import re
import sys
import tempfile
import types
import zipfile

import mujoco
import numpy as np
import pinocchio

PYTHON = pathlib.Path(__file__).resolve().parents[3] / "python"
package = types.ModuleType("sysid")  # the library need not be built
package.__path__ = [str(PYTHON / "sysid")]
sys.modules.setdefault("sysid", package)

from sysid import mjcf  # noqa: E402
from sysid._errors import InputError  # noqa: E402

FREE = (mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        | mujoco.mjtDisableBit.mjDSBL_ACTUATION)


def values_of(specification):
    """The numbers of its fix:, by name."""
    return {name: float(value) for name, value in
            re.findall(r"^  '(.*)': (\S+)$", specification, re.MULTILINE)}


def difference(model, translation):
    """The largest difference of accelerations, in units of 1 + the largest
    acceleration; None where Pinocchio cannot say."""
    if "spherical" in translation.urdf or "<mimic" in translation.urdf:
        return None
    # urdfdom alone wants all four numbers of a limit, and limits of slides.
    text = translation.urdf.replace("<limit ",
                                    '<limit effort="0" velocity="0" ')
    text = re.sub(r'type="prismatic">((?:(?!<limit|</joint>).)*)</joint>',
                  r'type="prismatic">\1<limit lower="-1" upper="1" effort="0" '
                  r'velocity="0"/></joint>', text, flags=re.DOTALL)
    own = pinocchio.buildModelFromXML(text)
    data = own.createData()
    fixed = values_of(translation.specification)
    gravity = np.array(model.opt.gravity)
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        gravity[:] = 0
    own.gravity.linear = gravity
    model.opt.disableflags |= FREE
    theirs = mujoco.MjData(model)
    random = np.random.default_rng(1)
    worst = 0.0
    places = []
    for name in translation.joints:
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        if joint < 0:  # has no name
            joint = translation.joints[name]
        at = own.joints[own.getJointId(name)]
        places.append((name, joint, at))
        own.armature[at.idx_v] = fixed.get(f"{name}.armature", 0.0)
    for _ in range(3):
        mujoco.mj_resetData(model, theirs)
        q, v = pinocchio.neutral(own), np.zeros(own.nv)
        force = np.zeros(own.nv)
        for name, joint, at in places:
            turn, speed = random.uniform(-1, 1, 2)
            theirs.qpos[model.jnt_qposadr[joint]] = turn
            theirs.qvel[model.jnt_dofadr[joint]] = speed
            v[at.idx_v] = speed
            if at.nq == 2:
                q[at.idx_q:at.idx_q + 2] = np.cos(turn), np.sin(turn)
            else:
                q[at.idx_q] = turn
            force[at.idx_v] = (
                -model.dof_damping[model.jnt_dofadr[joint]] * speed
                - fixed.get(f"{name}.quadratic_drag", 0) * speed * abs(speed)
                - fixed.get(f"{name}.cubic_damping", 0) * speed**3
                - fixed.get(f"{name}.stiffness", 0)
                * (turn - fixed.get(f"{name}.spring_reference", 0)))
        mujoco.mj_forward(model, theirs)
        a = pinocchio.aba(own, data, q, v, force)
        there = np.array([theirs.qacc[model.jnt_dofadr[joint]]
                          for _, joint, _ in places])
        here = np.array([a[at.idx_v] for _, _, at in places])
        worst = max(worst, float(np.max(np.abs(there - here))
                                 / (1 + np.max(np.abs(there)))))
    return worst


def without_free_joints(path):
    spec = mujoco.MjSpec.from_file(path)
    for joint in list(spec.joints):
        if joint.type == mujoco.mjtJoint.mjJNT_FREE:
            spec.delete(joint)
    for key in list(spec.keys):
        spec.delete(key)
    return spec.compile()


def judge(path, hold):
    """(what became of it, detail)."""
    try:
        model = mjcf.compile_model(path)
    except InputError as error:
        return None if hold else "not a model by itself", error.what
    free = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, i)
            or f"joint{i}" for i in range(model.njnt)
            if model.jnt_type[i] == mujoco.mjtJoint.mjJNT_FREE]
    if hold and not free:
        return None, ""
    translation = mjcf.translate(model, free if hold else ())
    if translation.blocks:
        element, why, _ = translation.blocks[0]
        kind = element.split()[0]
        return f"{kind}: {why}", element
    if free:
        # MuJoCo's springdamper makes other springs of it than with the free
        # joints: what is compared is one model.
        model = without_free_joints(path)
        translation = mjcf.translate(model)
    worst = difference(model, translation)
    if worst is None:
        return "loads (not compared: balls, followers)", ""
    return ("loads, accelerations to 1e-9" if worst < 1e-9
            else "loads, accelerations differ"), f"{worst:.2g}"


def main():
    details = "--details" in sys.argv
    tables = {}
    for wheel in [of for of in sys.argv[1:] if of.endswith(".whl")]:
        name = os.path.basename(wheel).split("-")[0]
        counts = collections.Counter(), collections.Counter()
        with tempfile.TemporaryDirectory() as folder:
            with zipfile.ZipFile(wheel) as archive:
                archive.extractall(folder)
            for path in sorted(pathlib.Path(folder).rglob("*.xml")):
                head = path.read_text(errors="replace")[:4000]
                if "<mujoco" not in head:
                    continue
                for hold in (False, True):
                    with contextlib.suppress(UnicodeDecodeError):
                        what, detail = judge(str(path), hold)
                        if what is None:
                            continue
                        counts[hold][what] += 1
                        if details:
                            print(name, path.relative_to(folder), hold, what,
                                  detail, file=sys.stderr, sep="\t")
        tables[name] = counts
    for hold in (False, True):
        print("## " + ("With free joints held (`hold=`), of those that have "
                       "any" if hold else "As they are") + "\n")
        reasons = sorted({what for counts in tables.values()
                          for what in counts[hold]},
                         key=lambda what: (not what.startswith("loads"), what))
        print("| | " + " | ".join(tables) + " |")
        print("|---|" + "---|" * len(tables))
        for what in reasons:
            print(f"| {what} | " + " | ".join(
                str(counts[hold][what]) for counts in tables.values()) + " |")
        print()


if __name__ == "__main__":
    main()
