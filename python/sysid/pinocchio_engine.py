"""Pinocchio as an engine of verify: URDF and MJCF."""

from typing import Any, Dict, List, Optional

import numpy as np

from ._errors import InputError
from .engines import Arrays, _moment, _need, _vector_part

_STEP = 1e-3  # s, of RK4


class Pinocchio:
    """Its articulated-body algorithm, which ignores damping and friction: a
    replay adds the damping that the file has, and no friction."""

    name = "pinocchio"

    def __init__(self, path: str) -> None:
        self._pin = _need("pinocchio", "pin")
        self._is_urdf = path.endswith(".urdf")
        read = (self._pin.buildModelFromMJCF if path.endswith(".xml")
                else self._pin.buildModelFromUrdf)
        if path.endswith(".sdf"):
            raise InputError(path, "is read by Pinocchio's build with SDFormat "
                             "alone", "give the .urdf or .xml of the same fit")
        try:
            self.model = read(path)
        except (ValueError, RuntimeError) as error:
            raise InputError(path, f"Pinocchio does not load it: {error}",
                             "give the .urdf: of MJCF it wants an inertia of "
                             "every body, also of what is fixed") from None
        self.notes: List[str] = []

    def passes_by(self, name: str) -> bool:
        """Whether its dynamics ignore it."""
        return name.endswith(".friction") or (
            self._is_urdf and name.endswith(".armature"))

    def number(self, name: str) -> Optional[float]:
        """As in Mujoco.number."""
        m = self.model
        target, _, what = name.rpartition(".")
        if m.existJointName(target):
            dof = m.joints[m.getJointId(target)].idx_v
            where = {"damping": ("damping", "jointDamping"),
                     "friction": ("friction", "upperDryFrictionLimit"),
                     "armature": ("armature",)}.get(what, ())
            for attribute in where:
                if hasattr(m, attribute):
                    return float(getattr(m, attribute)[dof])
        if m.existBodyName(target):
            # What is fixed to a body is part of it: not told apart.
            frame = m.frames[m.getBodyId(target)]
            inertia = frame.inertia
            if what == "mass":
                return float(inertia.mass)
            part = _vector_part(name, "com_")
            if part is not None:
                return float(inertia.lever[part])
            return _moment(name, inertia.inertia)
        return None

    def replay(self, t: np.ndarray, joints: List[Dict[str, Any]],
               start: np.ndarray, efforts: Arrays, commands: Arrays
               ) -> np.ndarray:
        """As Mujoco.replay; of hinges and slides alone."""
        pin, m = self._pin, self.model
        if any(of["ball"] for of in joints):
            raise InputError("engine 'pinocchio'", "replays hinges and slides",
                             "verify balls with engine='mujoco'")
        self.notes += [f"{name}: Pinocchio has no drives" for name in commands]
        data = m.createData()
        at = [m.joints[m.getJointId(of["name"])] for of in joints]
        q, v = pin.neutral(m), np.zeros(m.nv)
        turned = np.array([start[of["q"]] for of in joints])
        damping = np.array([self.number(f"{of['name']}.damping") or 0.0
                            for of in joints])
        for of, place in zip(joints, at):
            v[place.idx_v] = start[of["v"]]
        dofs = np.array([place.idx_v for place in at])

        def configuration(angles: np.ndarray) -> np.ndarray:
            for angle, place in zip(angles, at):
                if place.nq == 2:
                    q[place.idx_q:place.idx_q + 2] = (np.cos(angle),
                                                      np.sin(angle))
                else:
                    q[place.idx_q] = angle
            return q

        def rate(x: np.ndarray, force: np.ndarray) -> np.ndarray:
            speed = np.zeros(m.nv)
            speed[dofs] = x[len(at):]
            act = np.zeros(m.nv)
            act[dofs] = force - damping * x[len(at):]
            a = pin.aba(m, data, configuration(x[:len(at)]), speed, act)
            return np.concatenate([x[len(at):], a[dofs]])

        x = np.concatenate([turned, v[dofs]])
        out = np.empty((len(t), len(start)))
        for k in range(len(t)):
            for i, of in enumerate(joints):
                out[k, of["q"]], out[k, of["v"]] = x[i], x[len(at) + i]
            if k + 1 == len(t):
                break
            force = np.array([
                efforts[f"{of['name']}.tau"][k]
                if f"{of['name']}.tau" in efforts else 0.0 for of in joints])
            gap = t[k + 1] - t[k]
            count = max(1, int(np.ceil(gap / _STEP - 1e-6)))
            h = gap / count
            for _ in range(count):
                k1 = rate(x, force)
                k2 = rate(x + h / 2 * k1, force)
                k3 = rate(x + h / 2 * k2, force)
                k4 = rate(x + h * k3, force)
                x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return out
