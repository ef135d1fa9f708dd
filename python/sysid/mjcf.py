"""Models of MuJoCo as URDF and specification.

MuJoCo compiles the file (defaults, includes, meshes, inertia of geoms), and
what it made of it is translated. A body b of MuJoCo with the joints j = 1..n is
at

    T_b(q) = T_b0 prod_j Trans(a_j) Turn(u_j, q_j - ref_j) Trans(-a_j),     (1)

with anchors a_j and axes u_j in the body's axes. In a URDF each joint carries a
link whose origin is its anchor and whose axes are the body's, so that link j is
at a_j; all but the last are without mass. The frame of the last, which has the
body's inertia, is the body's, moved to a_n. The coordinate is MuJoCo's qpos: the
origin of joint j is turned (a slide's: moved) back by ref_j.
"""

import dataclasses
import importlib
import os
from typing import Any, Dict, List, Optional, Tuple
from xml.sax.saxutils import quoteattr

import numpy as np

from ._errors import InputError


@dataclasses.dataclass
class Translation:
    """A model as text.

    Attributes
    ----------
    urdf, specification : str
        The specification holds what a URDF cannot say: gravity, armatures,
        springs.
    blocks : list of (element, why, hint)
        What forward dynamics would need and this cannot say: empty, or the
        model is another.
    notices : list of str
        What is left out without a change of the free motion, and drives.
    joints : dict
        Name in the URDF to the joint's number in MuJoCo.
    """

    urdf: str
    specification: str
    blocks: List[Tuple[str, str, str]]
    notices: List[str]
    joints: Dict[str, int]


def compile_model(source: Any) -> Any:
    """MuJoCo's model of a path, a MjSpec or a MjModel.

    Raises
    ------
    InputError
        Where MuJoCo is missing, or does not compile it.
    """
    try:
        mj = importlib.import_module("mujoco")
    except ImportError:
        raise InputError("MJCF", "is read by MuJoCo, which is not installed",
                         "pip install mujoco") from None
    if isinstance(source, mj.MjModel):
        return source
    place = "MjSpec"
    try:
        if isinstance(source, mj.MjSpec):
            return source.compile()
        place = os.fspath(source)
        return mj.MjModel.from_xml_path(place)
    except (ValueError, mj.FatalError) as error:
        raise InputError(place, f"MuJoCo does not compile it: {error}",
                         "files that others include are no models by "
                         "themselves: give the one that includes them"
                         ) from None


def is_source(value: Any) -> bool:
    """Whether it is a path of MJCF, or an object of MuJoCo."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value).endswith((".xml", ".mjcf"))
    return type(value).__module__.split(".")[0] == "mujoco"


def _text(values: Any) -> str:
    return " ".join(repr(float(of)) for of in np.atleast_1d(values))


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (np.eye(3) + np.sin(angle) * cross
            + (1 - np.cos(angle)) * cross @ cross)


def _rpy(turn: np.ndarray) -> np.ndarray:
    yaw = np.arctan2(turn[1, 0], turn[0, 0])
    pitch = np.arctan2(-turn[2, 0], np.hypot(turn[0, 0], turn[1, 0]))
    s, c = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(s * turn[0, 2] - c * turn[1, 2],
                      c * turn[1, 1] - s * turn[0, 1])
    return np.array([roll, pitch, yaw])


def _matrix(mj: Any, quaternion: np.ndarray) -> np.ndarray:
    out = np.empty(9)
    mj.mju_quat2Mat(out, quaternion)
    return out.reshape(3, 3)


class _Translator:
    def __init__(self, model: Any, hold: Any) -> None:
        self._mj = importlib.import_module("mujoco")
        self._model = model
        self._hold = set(hold)
        self._urdf: List[str] = []
        self._fix: Dict[str, float] = {}
        self._effects: List[str] = []
        self._offsets = {0: np.zeros(3)}  # of a link in its body's axes
        self._mimics = self._find_mimics()
        self.blocks: List[Tuple[str, str, str]] = []
        self.notices: List[str] = []
        self.joints: Dict[str, int] = {}

    def _name(self, kind: str, index: int) -> str:
        mj_name = self._mj.mj_id2name(
            self._model, getattr(self._mj.mjtObj, f"mjOBJ_{kind}"), index)
        return mj_name or f"{kind.lower()}{index}"

    def _block(self, element: str, why: str, hint: str = "") -> None:
        self.blocks.append((element, why, hint))

    def translate(self) -> Translation:
        m = self._model
        names = b"".join(m.names.split(b"\0")[:1]).decode() or "mjcf"
        unknown = self._hold - {self._name("JOINT", i) for i in range(m.njnt)}
        if unknown:
            raise InputError("hold", f"'{sorted(unknown)[0]}' is no joint",
                             "known: " + ", ".join(
                                 self._name("JOINT", i)
                                 for i in range(m.njnt)))
        self._link("world", 0, None)
        for body in range(1, m.nbody):
            self._body(body)
        if not self.joints:
            self._block("worldbody", "has no joint that moves",
                        "nothing can be identified")
        self._gravity()
        self._others()
        self._actuators()
        text = "\n".join([f"<robot name={quoteattr(names)}>", *self._urdf,
                          "</robot>", ""])
        return Translation(text, self._specification(), self.blocks,
                           self.notices, self.joints)

    def _link(self, name: str, body: int, offset: Optional[np.ndarray]
              ) -> None:
        m = self._model
        if offset is None or m.body_mass[body] == 0.0 and not np.any(
                m.body_inertia[body]):
            self._urdf.append(f"  <link name={quoteattr(name)}/>")
            return
        axes = _matrix(self._mj, m.body_iquat[body])
        inertia = axes @ np.diag(m.body_inertia[body]) @ axes.T
        moments = " ".join(
            f'i{"xyz"[i]}{"xyz"[k]}="{float(inertia[i, k])!r}"'
            for i in range(3) for k in range(i, 3))
        self._urdf.append(
            f"  <link name={quoteattr(name)}>\n    <inertial>\n      "
            f'<origin xyz="{_text(m.body_ipos[body] - offset)}"/>\n      '
            f'<mass value="{float(m.body_mass[body])!r}"/>\n      '
            f"<inertia {moments}/>\n    </inertial>\n  </link>")

    def _body(self, body: int) -> None:
        m, mj = self._model, self._mj
        parent = m.body_parentid[body]
        name = self._name("BODY", body)
        position = m.body_pos[body] - self._offsets[parent]
        turn = _matrix(mj, m.body_quat[body])
        parent_name = ("world" if parent == 0 else self._name("BODY", parent))
        first = m.body_jntadr[body]
        moving = []
        for joint in range(first, first + m.body_jntnum[body]):
            joint_name = self._name("JOINT", joint)
            if joint_name in self._hold:
                if m.jnt_type[joint] in (mj.mjtJoint.mjJNT_HINGE,
                                         mj.mjtJoint.mjJNT_SLIDE):
                    self.notices.append(f"joint '{joint_name}' is held where "
                                        "the file has it")
            elif m.jnt_type[joint] == mj.mjtJoint.mjJNT_FREE:
                self._block(
                    f"joint '{joint_name}' of body '{name}'",
                    "is free, and floating bases are not read",
                    f"sysid.load(path, hold=[{joint_name!r}]) holds it where "
                    "the file has it")
            else:
                moving.append(joint)
        if m.body_mocapid[body] >= 0:
            self.notices.append(f"body '{name}' is moved from outside "
                                "(mocap): it stands where the file has it")
        if not moving:
            self._offsets[body] = np.zeros(3)
            self._joint_element(f"{name}_fixed", "fixed", parent_name, name,
                                position, turn)
            self._link(name, body, np.zeros(3))
            return
        at = np.zeros(3)  # of the last link in the body's axes
        for i, joint in enumerate(moving):
            last = i + 1 == len(moving)
            anchor = m.jnt_pos[joint]
            axis = m.jnt_axis[joint]
            child = name if last else f"{name}_{self._name('JOINT', joint)}"
            place, axes = position + turn @ (anchor - at), turn
            ref = m.qpos0[m.jnt_qposadr[joint]]
            if m.jnt_type[joint] == mj.mjtJoint.mjJNT_SLIDE:
                place = place - axes @ axis * ref
            elif m.jnt_type[joint] == mj.mjtJoint.mjJNT_HINGE:
                axes = axes @ _turn(axis, -ref)
            self._moving_joint(joint, parent_name, child, place, axes, axis)
            self._link(child, body, anchor if last else None)
            parent_name, position, turn = child, np.zeros(3), np.eye(3)
            at = anchor
        self._offsets[body] = at

    def _joint_element(self, name: str, kind: str, parent: str, child: str,
                       place: np.ndarray, axes: np.ndarray,
                       more: Tuple[str, ...] = ()) -> None:
        self._urdf.append("\n".join([
            f"  <joint name={quoteattr(name)} type=\"{kind}\">",
            f"    <parent link={quoteattr(parent)}/>",
            f"    <child link={quoteattr(child)}/>",
            f'    <origin xyz="{_text(place)}" rpy="{_text(_rpy(axes))}"/>',
            *(f"    {line}" for line in more), "  </joint>"]))

    def _moving_joint(self, joint: int, parent: str, child: str,
                      place: np.ndarray, axes: np.ndarray, axis: np.ndarray
                      ) -> None:
        m, mj = self._model, self._mj
        name = self._name("JOINT", joint)
        self.joints[name] = joint
        dof = m.jnt_dofadr[joint]
        more = []
        kinds = {int(mj.mjtJoint.mjJNT_BALL): "spherical",
                 int(mj.mjtJoint.mjJNT_SLIDE): "prismatic",
                 int(mj.mjtJoint.mjJNT_HINGE): ("revolute" if m.jnt_limited[joint]
                                           else "continuous")}
        kind = kinds[int(m.jnt_type[joint])]
        if kind != "spherical":
            more.append(f'<axis xyz="{_text(axis)}"/>')
            if m.jnt_limited[joint]:
                low, high = (float(of) for of in m.jnt_range[joint])
                more.append(f'<limit lower="{low!r}" upper="{high!r}"/>')
        damping = float(m.dof_damping[dof])
        friction = float(m.dof_frictionloss[dof])
        if damping > 0.0 or friction > 0.0:
            more.append(f'<dynamics damping="{damping!r}" '
                        f'friction="{friction!r}"/>')
        if joint in self._mimics:
            leader, offset, multiplier = self._mimics[joint]
            more.append(f"<mimic joint={quoteattr(leader)} "
                        f'multiplier="{multiplier!r}" offset="{offset!r}"/>')
        self._laws(joint, name, kind)
        self._joint_element(name, kind, parent, child, place, axes,
                            tuple(more))

    def _laws(self, joint: int, name: str, kind: str) -> None:
        m = self._model
        dof, at = m.jnt_dofadr[joint], m.jnt_qposadr[joint]
        stiffness = float(m.jnt_stiffness[joint])
        if m.dof_armature[dof] > 0.0:
            self._effect(f"armature@{name}",
                         {f"{name}.armature": m.dof_armature[dof]})
        if stiffness > 0.0:
            values = {f"{name}.stiffness": stiffness}
            if kind != "spherical":
                values[f"{name}.spring_reference"] = m.qpos_spring[at]
            self._effect(f"spring@{name}", values)
        high = getattr(m, "dof_dampingpoly", None)
        for i, law in enumerate(("quadratic_drag", "cubic_damping")):
            if high is not None and high[dof][i] != 0.0:
                self._effect(f"{law}@{name}", {f"{name}.{law}": high[dof][i]})
        spring = getattr(m, "jnt_stiffnesspoly", None)
        if spring is not None and np.any(spring[joint]):
            self._block(f"joint '{name}'", "has a spring that is no straight "
                        "line", "a law of the kind custom@J can be added")

    def _effect(self, effect: str, values: Dict[str, Any]) -> None:
        self._effects.append(effect)
        self._fix.update({key: float(of) for key, of in values.items()})

    def _find_mimics(self) -> Dict[int, Tuple[str, float, float]]:
        m, found = self._model, {}
        for i in range(m.neq):
            p = m.eq_data[i, :5]
            if (m.eq_type[i] == self._mj.mjtEq.mjEQ_JOINT
                    and m.eq_obj2id[i] >= 0 and not np.any(p[2:])
                    and m.eq_active0[i]):
                one, two = m.eq_obj1id[i], m.eq_obj2id[i]
                first, second = (m.qpos0[m.jnt_qposadr[of]]
                                 for of in (one, two))
                found[one] = (self._name("JOINT", two),
                              float(first + p[0] - p[1] * second),
                              float(p[1]))
        return found

    def _gravity(self) -> None:
        m = self._model
        gravity = np.array(m.opt.gravity)
        if m.opt.disableflags & self._mj.mjtDisableBit.mjDSBL_GRAVITY:
            gravity[:] = 0.0
        size = float(np.linalg.norm(gravity))
        if size != 9.81:
            self._fix["gravity"] = size
        across = float(np.hypot(gravity[0], gravity[1]))
        if across > 0.0:
            ratio = float(np.arctan2(across, -gravity[2])) / across
            self._effect("gravity_tilt@base",
                         {"gravity_tilt_x": ratio * gravity[1],
                          "gravity_tilt_y": -ratio * gravity[0]})

    def _others(self) -> None:
        """What acts beside joints and bodies."""
        m, mj = self._model, self._mj
        for i in range(m.neq):
            if not m.eq_active0[i]:
                continue
            if m.eq_type[i] != mj.mjtEq.mjEQ_JOINT or (
                    m.eq_obj1id[i] not in self._mimics):
                self._block(f"equality '{self._name('EQUALITY', i)}'",
                            "is a constraint that only MuJoCo solves",
                            "remove it, or what it closes, from the file")
        for i in range(m.ntendon):
            forces = [of for of in ("stiffness", "damping", "frictionloss",
                                    "armature")
                      if np.any(getattr(m, f"tendon_{of}", [0] * (i + 1))[i])]
            if forces:
                self._block(f"tendon '{self._name('TENDON', i)}'",
                            f"has {', '.join(forces)}",
                            "set them to 0, or give the law to a joint")
        if getattr(m, "nflex", 0):
            self._block("flex", "deformable bodies are not read",
                        "remove them from the file")
        if m.opt.density > 0.0 or m.opt.viscosity > 0.0:
            self._block("option density, viscosity", "is a fluid, which acts "
                        "on the bodies by their shape",
                        "set them to 0; aerodynamic_drag@link is a drag")
        if np.any(m.body_gravcomp):
            body = self._name("BODY", int(np.argmax(m.body_gravcomp != 0)))
            self._block(f"body '{body}' gravcomp", "is a force that only "
                        "MuJoCo knows", "set it to 0")
        touches = int(np.count_nonzero((m.geom_contype | m.geom_conaffinity)))
        if touches:
            self.notices.append(
                f"contacts of {touches} geoms are left out: identify from "
                "recordings in which nothing touches")
        if np.any(m.jnt_limited):
            self.notices.append("limits of joints do not act: the model has "
                                "no stops")

    def _actuators(self) -> None:
        m, mj = self._model, self._mj
        for i in range(m.nu):
            name = self._name("ACTUATOR", i)
            joint = m.actuator_trnid[i, 0]
            if m.actuator_trntype[i] != mj.mjtTrn.mjTRN_JOINT:
                self.notices.append(
                    f"actuator '{name}' acts on no joint: give the efforts of "
                    "the joints that it moves as J.tau")
                continue
            of = self._name("JOINT", joint)
            gear = m.actuator_gear[i, 0]
            gain, bias = m.actuator_gainprm[i, 0], m.actuator_biasprm[i]
            if m.actuator_biastype[i] == mj.mjtBias.mjBIAS_AFFINE and (
                    bias[1] != 0.0):
                self.notices.append(
                    f"actuator '{name}' is a drive: with its ctrl as {of}.cmd "
                    f"add=['position_drive@{of}'], kp = "
                    f"{-bias[1] * gear**2:g}, kd = {-bias[2] * gear**2:g}"
                    + (f", and {of}.cmd = ctrl * {-gain / (bias[1] * gear):g}"
                       if gain != -bias[1] * gear else ""))
            elif m.actuator_biastype[i] == mj.mjtBias.mjBIAS_AFFINE and (
                    bias[2] != 0.0):
                self.notices.append(
                    f"actuator '{name}' is a drive of velocities: {of}.tau = "
                    f"{gain * gear:g} ctrl, and {-bias[2] * gear**2:g} more "
                    f"of {of}.damping")
            else:
                self.notices.append(f"actuator '{name}': {of}.tau = "
                                    f"{gain * gear:g} ctrl")

    def _specification(self) -> str:
        lines = []
        if self._fix:
            lines.append("fix:")
            lines += [f"  {key!r}: {of!r}" for key, of in self._fix.items()]
        if self._effects:
            lines.append("effects:")
            lines += [f"  - {of!r}" for of in self._effects]
        return "\n".join(lines) + "\n" if lines else ""


def translate(model: Any, hold: Any = ()) -> Translation:
    """A compiled model as URDF and specification; joints of ``hold`` stay
    where the file has them."""
    return _Translator(model, hold).translate()
