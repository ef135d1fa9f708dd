"""Simulators that load what a fit wrote: the numbers in them, and replays."""

import importlib
import os
from typing import Any, Dict, List, Optional

import numpy as np

from ._errors import InputError

Arrays = Dict[str, np.ndarray]


def _need(package: str, pip: str) -> Any:
    try:
        return importlib.import_module(package)
    except ImportError:
        raise InputError(f"engine '{pip}'", "is not installed",
                         f"pip install {pip}") from None


def _vector_part(name: str, key: str) -> Optional[int]:
    """2 of "link1.com_z" with the key "com_"."""
    end = name.rsplit(".", 1)[-1]
    if end.startswith(key) and end[len(key):] in ("x", "y", "z"):
        return "xyz".index(end[len(key):])
    return None


def _moment(name: str, inertia: np.ndarray) -> Optional[float]:
    end = name.rsplit(".", 1)[-1]
    if len(end) == 3 and end[0] == "i" and set(end[1:]) <= set("xyz"):
        return float(inertia["xyz".index(end[1]), "xyz".index(end[2])])
    return None


class Mujoco:
    """MuJoCo: MJCF and URDF."""

    name = "mujoco"

    def __init__(self, path: str) -> None:
        self._mj = _need("mujoco", "mujoco")
        try:
            self.model = self._mj.MjModel.from_xml_path(path)
        except ValueError as error:
            raise InputError(path, f"MuJoCo does not load it: {error}",
                             "export.json says what was written") from None
        self._step = self.model.opt.timestep
        self.notes: List[str] = []

    def _id(self, kind: str, name: str) -> int:
        return int(self._mj.mj_name2id(
            self.model, getattr(self._mj.mjtObj, f"mjOBJ_{kind}"), name))

    def number(self, name: str) -> Optional[float]:
        """The parameter of this name as the loaded model has it; None where
        it has none."""
        if "." not in name:
            return self._of_world(name)
        target, what = name.rsplit(".", 1)
        joint = self._id("JOINT", target)
        if joint >= 0:
            found = self._of_joint(target, joint, what)
            if found is not None:
                return found
        body = self._id("BODY", target)
        return self._of_body(body, name, what) if body >= 0 else None

    def passes_by(self, _name: str) -> bool:
        """Whether the engine reads files that have it, and ignores it."""
        return False

    def _of_world(self, name: str) -> Optional[float]:
        m = self.model
        if name == "effort_delay":
            motors = [i for i in range(m.nu) if m.actuator(i).name.endswith(
                (".tau", ".taux"))]
            return float(m.actuator_delay[motors[0]]) if motors else None
        gravity = m.opt.gravity
        size = float(np.linalg.norm(gravity))
        if name == "gravity":
            return size
        # (0, 0, -g) turned by (x, y, 0): -g (s y, -s x, cos), s = sin / angle.
        across = float(np.hypot(gravity[0], gravity[1]))
        ratio = np.arctan2(across, -gravity[2]) / across if across else 0.0
        tilt = {"gravity_tilt_x": ratio * gravity[1],
                "gravity_tilt_y": -ratio * gravity[0]}
        return float(tilt[name]) if name in tilt else None

    def _of_joint(self, target: str, joint: int, what: str
                  ) -> Optional[float]:
        m = self.model
        dof, at = m.jnt_dofadr[joint], m.jnt_qposadr[joint]
        ball = m.jnt_type[joint] == self._mj.mjtJoint.mjJNT_BALL
        simple = {"damping": m.dof_damping, "friction": m.dof_frictionloss,
                  "armature": m.dof_armature}
        if what in simple:
            return float(simple[what][dof])
        if what in ("quadratic_drag", "cubic_damping"):
            high = getattr(m, "dof_dampingpoly", None)
            return None if high is None else float(
                high[dof][int(what == "cubic_damping")])
        if what == "stiffness":
            return float(m.jnt_stiffness[joint])
        if what == "spring_reference" and not ball:
            return float(m.qpos_spring[at] - m.qpos0[at])
        if what == "sensor_offset" and not ball:
            return float(m.qpos0[at])
        if what == "sensor_delay":
            sensor = self._id("SENSOR", f"{target}.q")
            return float(m.sensor_delay[sensor]) if sensor >= 0 else None
        if what == "effort_bias":
            force = sum(m.actuator_biasprm[i, 0] for i in self._of(target)
                        if m.actuator(i).name.endswith(("tau", "_bias")))
            return float(force)
        if what.startswith("coupling_"):
            return self._of_tendon(target, what)
        if what in "xyz":
            return float(m.body_pos[m.jnt_bodyid[joint], "xyz".index(what)])
        return self._of_actuator(target, what)

    def _of(self, target: str) -> List[int]:
        m = self.model
        joint = self._id("JOINT", target)
        return [i for i in range(m.nu) if m.actuator_trnid[i, 0] == joint]

    def _of_actuator(self, target: str, what: str) -> Optional[float]:
        m = self.model
        ends = {"kp": "cmd", "kd": "cmd", "drive_delay": "cmd"}
        names = [f"{target}.{ends.get(what, 'tau')}"]
        if what == "effort_limit":
            names.append(f"{target}.cmd")
        if what == "effort_gain":
            names.append(f"{target}.taux")
        if what.startswith(("cogging_", "presliding_")):
            return self._of_passive(f"{target}.{what.split('_')[0]}", what)
        found = [i for i in (self._id("ACTUATOR", of) for of in names)
                 if i >= 0]
        if not found:
            return None
        i = found[0]
        if what == "effort_gain":
            return float(m.actuator_gainprm[i, 0] - 1.0)
        if what == "effort_limit":
            return float(m.actuator_forcerange[i, 1])
        if what == "actuator_lag":
            return float(m.actuator_dynprm[i, 0])
        if what == "kp":
            return float(m.actuator_gainprm[i, 0])
        if what == "kd":
            return float(-m.actuator_biasprm[i, 2])
        if what == "drive_delay":
            return float(m.actuator_delay[i])
        return None

    def _of_passive(self, actuator: str, what: str) -> Optional[float]:
        """Of a motor without inputs, by its angle as the joint's sensor
        measures it."""
        m, i = self.model, self._id("ACTUATOR", actuator)
        if i < 0:
            return None
        bias = m.actuator_biasprm[i]
        size, order, phase = bias[0], bias[1], bias[2]
        offset = m.qpos0[m.jnt_qposadr[m.actuator_trnid[i, 0]]]
        phase += order * offset
        known = {"cogging_sin": size * np.cos(phase),
                 "cogging_cos": size * np.sin(phase), "cogging_order": order,
                 "presliding_friction": bias[3]}
        return float(known[what]) if what in known else None

    def _of_tendon(self, target: str, what: str) -> Optional[float]:
        m = self.model
        for i in range(m.ntendon):
            if m.tendon(i).name.split(",")[-1] != target:
                continue
            last = m.tendon_adr[i] + m.tendon_num[i] - 1
            return float({"coupling_armature": m.tendon_armature[i],
                          "coupling_damping": m.tendon_damping[i],
                          "coupling_friction": m.tendon_frictionloss[i],
                          "coupling_sign": m.wrap_prm[last]}[what])
        return None

    def _of_body(self, body: int, name: str, what: str) -> Optional[float]:
        m = self.model
        if what == "mass":
            return float(m.body_mass[body])
        part = _vector_part(name, "com_")
        if part is not None:
            return float(m.body_ipos[body, part])
        if what == "length":
            children = [i for i in range(1, m.nbody)
                        if m.body_parentid[i] == body]
            return float(np.linalg.norm(m.body_pos[children[0]]) if children
                         else 2 * np.linalg.norm(m.body_ipos[body]))
        axes = np.empty(9)
        self._mj.mju_quat2Mat(axes, m.body_iquat[body])
        axes = axes.reshape(3, 3)
        return _moment(name, axes @ np.diag(m.body_inertia[body]) @ axes.T)

    def replay(self, t: np.ndarray, joints: List[Dict[str, Any]],
               start: np.ndarray, efforts: Arrays, commands: Arrays
               ) -> np.ndarray:
        """States (samples x nq + nv, as Prediction.states has them) from the
        start, with the recorded inputs, each held until the next sample."""
        mj, m = self._mj, self.model
        d = mj.MjData(m)
        places = []
        for of in joints:
            joint = self._id("JOINT", of["name"])
            if joint < 0:
                raise InputError(of["name"], "is no joint of the loaded file",
                                 "verify what this fit exported")
            at, dof = m.jnt_qposadr[joint], m.jnt_dofadr[joint]
            places.append((of, at, dof))
            q = start[of["q"]:of["q"] + of["nq"]]
            d.qpos[at:at + of["nq"]] = (
                q[[3, 0, 1, 2]] if of["ball"] else q + m.qpos0[at])
            d.qvel[dof:dof + of["nv"]] = start[of["v"]:of["v"] + of["nv"]]
        self._follow(d)
        drives = self._drives(efforts, commands)
        self._fill(d, drives)
        out = np.empty((len(t), len(start)))
        for k in range(len(t)):
            for of, at, dof in places:
                q = d.qpos[at:at + of["nq"]]
                out[k, of["q"]:of["q"] + of["nq"]] = (
                    q[[1, 2, 3, 0]] if of["ball"] else q - m.qpos0[at])
                out[k, of["v"]:of["v"] + of["nv"]] = (
                    d.qvel[dof:dof + of["nv"]])
            if k + 1 == len(t):
                break
            d.qfrc_applied[:] = 0.0
            for actuator, dof, values in drives:
                if actuator >= 0:
                    d.ctrl[actuator] = values[k]
                else:
                    d.qfrc_applied[dof] += values[k]
            gap = t[k + 1] - t[k]
            count = max(1, int(np.ceil(gap / self._step - 1e-6)))
            m.opt.timestep = gap / count
            for _ in range(count):
                mj.mj_step(m, d)
        m.opt.timestep = self._step
        return out

    def _follow(self, d: Any) -> None:
        """Joints of equalities start where these have them."""
        m = self.model
        for i in range(m.neq):
            if m.eq_type[i] != self._mj.mjtEq.mjEQ_JOINT or m.eq_obj2id[i] < 0:
                continue
            one, two = m.eq_obj1id[i], m.eq_obj2id[i]
            x = d.qpos[m.jnt_qposadr[two]] - m.qpos0[m.jnt_qposadr[two]]
            p = m.eq_data[i, :5]
            d.qpos[m.jnt_qposadr[one]] = (
                m.qpos0[m.jnt_qposadr[one]] + np.polyval(p[::-1], x))
            d.qvel[m.jnt_dofadr[one]] = (
                np.polyval(np.polyder(p[::-1]), x)
                * d.qvel[m.jnt_dofadr[two]])

    def _drives(self, efforts: Arrays, commands: Arrays) -> List[Any]:
        """(actuator, or -1; degree of freedom; values) of each input."""
        found = []
        for column, values in {**efforts, **commands}.items():
            target, what = column.rsplit(".", 1)
            joint = self._id("JOINT", target)
            if joint < 0:
                continue
            part = max(0, "xyz".find(what[-1])) if what != "tau" else 0
            actuator = self._id("ACTUATOR", column)
            if actuator < 0 and what == "cmd":
                self.notes.append(f"{column}: no actuator takes it")
                continue
            found.append((actuator, self.model.jnt_dofadr[joint] + part,
                          values))
        return found

    def _fill(self, d: Any, drives: List[Any]) -> None:
        """What was before the first sample is as that: buffers of delays,
        states of lags."""
        m = self.model
        for actuator, _, values in drives:
            if actuator < 0:
                continue
            if m.actuator_dyntype[actuator] == (
                    self._mj.mjtDyn.mjDYN_FILTEREXACT):
                d.act[m.actuator_actadr[actuator]] = values[0]
            count = (int(m.actuator_history[actuator, 0])
                     if hasattr(m, "actuator_history") else 0)
            if count > 0:
                times = (np.arange(count) - count) * m.opt.timestep
                self._mj.mj_initCtrlHistory(
                    m, d, actuator, times, np.full(count, values[0]))


def open_engine(engine: str, path: str) -> Any:
    """The engine with the file in it."""
    kinds = {"mujoco": (".engines", "Mujoco"),
             "drake": (".drake_engine", "Drake"),
             "pinocchio": (".pinocchio_engine", "Pinocchio")}
    if engine not in kinds:
        raise InputError("engine", f"'{engine}' is none that is known",
                         "known: " + ", ".join(kinds))
    if not os.path.exists(path):
        raise InputError(path, "there is no such file",
                         f"fit.export({path!r}) writes it")
    module, kind = kinds[engine]
    opener = getattr(importlib.import_module(module, __package__), kind)
    return opener(path)
