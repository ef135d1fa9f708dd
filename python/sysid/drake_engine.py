"""Drake as an engine of verify: SDF, URDF and MJCF."""

from typing import Any, Dict, List, Optional

import numpy as np

from ._errors import InputError
from .engines import Arrays, _moment, _need, _vector_part


class Drake:
    """A continuous plant, integrated by Drake's RK3 with an accuracy of
    1e-8."""

    name = "drake"

    def __init__(self, path: str) -> None:
        _need("pydrake", "drake")
        parsing = _need("pydrake.multibody.parsing", "drake")
        plants = _need("pydrake.multibody.plant", "drake")
        self.notes: List[str] = []
        self._plant = plants.MultibodyPlant(0.0)
        try:
            parsing.Parser(self._plant).AddModels(path)
            bodies = [self._plant.get_body(i) for i in
                      self._plant.GetBodyIndices(
                          self._plant.GetModelInstanceByName(
                              self._models()[-1]))]
            root = self._plant.world_frame()
            if path.endswith(".urdf") and bodies[0].name() != "world":
                self._plant.WeldFrames(root, bodies[0].body_frame())
            self._plant.Finalize()
        except RuntimeError as error:
            raise InputError(path, f"Drake does not load it: {error}",
                             "export.json says what was written") from None

    def _models(self) -> List[str]:
        tree = _need("pydrake.multibody.tree", "drake")
        return [self._plant.GetModelInstanceName(tree.ModelInstanceIndex(i))
                for i in range(self._plant.num_model_instances())]

    def passes_by(self, name: str) -> bool:
        """Drake has no friction of joints."""
        return name.endswith(".friction")

    def number(self, name: str) -> Optional[float]:
        """As in Mujoco.number."""
        target, _, what = name.rpartition(".")
        plant = self._plant
        if target and plant.HasJointNamed(target):
            joint = plant.GetJointByName(target)
            if what == "damping" and hasattr(joint, "default_damping"):
                return float(joint.default_damping())
            if what == "armature" and plant.HasJointActuatorNamed(target):
                motor = plant.GetJointActuatorByName(target)
                return float(motor.default_rotor_inertia()
                             * motor.default_gear_ratio() ** 2)
            if what == "armature":
                return self._rotor(target)
            return None
        if not target or not plant.HasBodyNamed(target):
            return None
        body = plant.GetBodyByName(target)
        if what == "mass":
            return float(body.default_mass())
        part = _vector_part(name, "com_")
        if part is not None:
            return float(body.default_com()[part])
        inertia = body.default_spatial_inertia()
        about = inertia.CalcRotationalInertia().ShiftToCenterOfMass(
            inertia.get_mass(), inertia.get_com())
        return _moment(name, about.CopyToFullMatrix3())

    def _rotor(self, joint: str) -> Optional[float]:
        for i in self._plant.GetJointActuatorIndices():
            motor = self._plant.get_joint_actuator(i)
            if motor.joint().name() == joint:
                return float(motor.default_rotor_inertia()
                             * motor.default_gear_ratio() ** 2)
        return None

    def replay(self, t: np.ndarray, joints: List[Dict[str, Any]],
               start: np.ndarray, efforts: Arrays, commands: Arrays
               ) -> np.ndarray:
        """As Mujoco.replay; of hinges and slides alone."""
        analysis = _need("pydrake.systems.analysis", "drake")
        plant = self._plant
        if any(of["ball"] for of in joints):
            raise InputError("engine 'drake'", "replays hinges and slides",
                             "verify balls with engine='mujoco'")
        self.notes += [f"{name}: Drake has no such drive" for name in commands]
        simulator = analysis.Simulator(plant)
        analysis.ApplySimulatorConfig(analysis.SimulatorConfig(
            integration_scheme="runge_kutta3", accuracy=1e-8,
            max_step_size=0.005), simulator)
        context = simulator.get_mutable_context()
        context.SetTime(float(t[0]))
        places = []
        for of in joints:
            joint = plant.GetJointByName(of["name"])
            at, dof = joint.position_start(), joint.velocity_start()
            places.append((of, at, dof))
        q, v = plant.GetPositions(context), plant.GetVelocities(context)
        for of, at, dof in places:
            q[at], v[dof] = start[of["q"]], start[of["v"]]
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        port = plant.get_applied_generalized_force_input_port()
        out = np.empty((len(t), len(start)))
        for k, time in enumerate(t):
            force = np.zeros(plant.num_velocities())
            for of, at, dof in places:
                out[k, of["q"]] = plant.GetPositions(context)[at]
                out[k, of["v"]] = plant.GetVelocities(context)[dof]
                column = efforts.get(f"{of['name']}.tau")
                if column is not None:
                    force[dof] = column[k]
            if k + 1 < len(t):
                port.FixValue(context, force)
                simulator.AdvanceTo(float(t[k + 1]))
        return out
