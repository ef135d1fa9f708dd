"""Identification of an arm by its inverse dynamics with FIGAROH (`pip install
figaroh`), as its documentation has it: a subclass that reads the recording, a
configuration, base parameters by QR and weighted least squares.

    figaroh_arm.py ARM.urdf RUN.csv STATES.txt CUT_OFF EVERY

STATES.txt: q, qd and qdd, a state a line. CUT_OFF, Hz, of its Butterworth filter;
it keeps one sample of EVERY. Viscous and Coulomb friction and the rotor's inertia
of each joint are free as well.

Prints JSON: `base`, the number of base parameters, and `efforts`, those that the
model found has at the states.
"""

import contextlib
import json
import os
import sys
import tempfile

import numpy as np
import yaml
from figaroh.identification.base_identification import BaseIdentification
from figaroh.tools.regressor import (
    build_regressor_basic,
    build_regressor_reduced,
)
from figaroh.tools.robot import Robot


class Arm(BaseIdentification):
    def __init__(self, robot, config, recording):
        super().__init__(robot, config)
        self.recording = recording
        joints = list(self.model.joints)[1:]
        self.identif_config["act_idxq"] = [joint.idx_q for joint in joints]
        self.identif_config["act_idxv"] = [joint.idx_v for joint in joints]

    def load_trajectory_data(self, data_source=None):
        with open(self.recording, encoding="utf-8") as file:
            lines = [line for line in file if not line.startswith("#")]
        names = lines[0].strip().split(",")
        table = np.loadtxt(lines[1:], delimiter=",")

        def of(column):
            return table[:, [names.index(f"{joint}.{column}")
                             for joint in list(self.model.names)[1:]]]
        return {"timestamps": table[:, 0], "positions": of("q"),
                "velocities": None, "accelerations": None,
                "torques": of("tau")}

    def process_torque_data(self, **kwargs):
        return self._apply_filters(self.raw_data["torques"],
                                   **self.filter_config["filter_params"])


def configuration(joints, rate, cut_off):
    zeros = [0.0] * len(joints)
    return {
        "robot": {"name": "arm", "properties": {
            "joints": {"active_joints": joints},
            "mechanics": {
                "friction_coefficients": {"viscous": zeros, "static": zeros},
                "actuator_inertias": zeros, "joint_offsets": zeros}}},
        "tasks": {"identification": {
            "enabled": True,
            "problem": {
                "include_external_forces": False, "use_joint_torques": True,
                "wls": True,
                "model_components": {"friction": True, "joint_offset": False,
                                     "actuator_inertia": True}},
            "signal_processing": {
                "sampling_frequency": rate, "cutoff_frequency": cut_off,
                "filter_type": "butterworth", "filter_order": 4}}}}


def main():
    urdf, recording, states, cut_off, every = sys.argv[1:]
    with contextlib.redirect_stdout(sys.stderr):
        robot = Robot(urdf, package_dirs=os.path.dirname(urdf))
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            yaml.safe_dump(configuration(list(robot.model.names)[1:], 500.0,
                                         float(cut_off)), file)
            file.flush()
            arm = Arm(robot, file.name, recording)
        arm.initialize()
        arm.solve(decimate=True, decimation_factor=int(every), plotting=False,
                  wls=True)
        at, n = np.loadtxt(states), robot.model.nv
        rows = build_regressor_basic(robot, at[:, :n], at[:, n:2 * n],
                                     at[:, 2 * n:], arm.identif_config)
        rows = build_regressor_reduced(rows, arm._idx_eliminated)
        efforts = rows[:, list(arm._base_indices)] @ arm.phi_base
    # Joint after joint, all states each.
    print(json.dumps({"base": len(arm.phi_base),
                      "efforts": efforts.reshape(n, -1).T.tolist()}))


if __name__ == "__main__":
    main()
