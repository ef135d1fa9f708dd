"""The identification of sysid_fit, made with MuJoCo's system identification
toolbox (`pip install mujoco[sysid]`) as its documentation recommends: parameters
with modifiers of the MjSpec, recordings as ModelSequences, the default residual
and the optimizer "mujoco" (Gauss-Newton, finite differences through rollouts on
all cores).

    mujoco_sysid.py MODEL.urdf RUN.csv[,RUN.csv...] --free link1.length=0.5,...
        [--friction joint1=0.01,...] [--step 0.01] [--states]

The recording starts at rest. Without --states the rollouts start where the first
row says, as the toolbox has it; with it the initial positions and velocities are
estimated too, as sysid_fit does (by its hook `custom_rollout`). The integrator is
Runge-Kutta of fourth order with the step of sysid_fit. Joints of one degree of
freedom are compared by position, ball joints by the heading of their links.

Prints JSON: `parameters` (name: value), `intervals` (name: half width, 95 %),
`iterations`.
"""

import argparse
import contextlib
import json
import sys
import xml.etree.ElementTree as tree

import mujoco
import numpy as np
from mujoco import sysid

STEP = 0.01  # s
# Bounds, those of the shipped specifications.
BOUNDS = {"length": (0.05, 10.0), "mass": (0.01, 100.0), "friction": (0.0, 1.0)}


def assignments(text):
    pairs = (item.split("=") for item in text.split(",") if item)
    return {name: float(value) for name, value in pairs}


class Length:
    """Of a link: every position in its frame scales, and the inertia by the
    square (docs/interface.md, section 3)."""

    def __init__(self, spec, link, tip):
        body = spec.body(link)
        self.link = link
        self.children = [b.name for b in spec.bodies
                         if b.parent is not None and b.parent.name == link]
        self.com = np.array(body.ipos)
        self.inertia = np.array(body.fullinertia)
        self.origins = [np.array(spec.body(c).pos) for c in self.children]
        of = self.origins[0] if self.children else tip
        self.nominal = np.linalg.norm(of)

    def __call__(self, spec, parameter):
        s = parameter.value[0] / self.nominal
        body = spec.body(self.link)
        body.ipos = s * self.com
        body.fullinertia = s * s * self.inertia
        for child, origin in zip(self.children, self.origins):
            spec.body(child).pos = s * origin


def parameter(spec, tips, name, start):
    link, kind = name.split(".")
    if kind == "length":
        modifier = Length(spec, link, tips.get(link))
    elif kind == "mass":
        def modifier(s, p):
            s.body(link).mass = p.value[0]
    else:
        raise SystemExit(f"no parameter {name}")
    low, high = BOUNDS[kind]
    return sysid.Parameter(name, start, low, high, modifier=modifier)


def friction(joint, start):
    def modifier(spec, p):
        spec.joint(joint).frictionloss = p.value[0]
    low, high = BOUNDS["friction"]
    return sysid.Parameter(f"{joint}.friction", start, low, high,
                           modifier=modifier)


def tips_of(urdf):
    """Where links end that have no child in MuJoCo, which fuses fixed frames."""
    tips = {}
    for joint in tree.parse(urdf).getroot().findall("joint"):
        if joint.get("type") == "fixed":
            tips[joint.find("parent").get("link")] = np.array(
                [float(v) for v in joint.find("origin").get("xyz").split()])
    return tips


def is_ball(joint):
    return joint.type == mujoco.mjtJoint.mjJNT_BALL


def load(path, joints):
    """Times, positions (quaternions w first) and efforts of a recording."""
    with open(path, encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    names = lines[0].strip().split(",")
    table = np.loadtxt(lines[1:], delimiter=",", ndmin=2)

    def columns(wanted):
        return table[:, [names.index(name) for name in wanted]]

    positions, efforts = [], []
    for joint in joints:
        positions += ([f"{joint.name}.q{c}" for c in "wxyz"] if is_ball(joint)
                      else [f"{joint.name}.q"])
        efforts += [c for c in [f"{joint.name}.tau"] if c in names]
    return table[:, 0], columns(positions), columns(efforts)


def headings(q):
    """-z of a ball joint's child, of quaternions."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return -np.stack([2 * (x * z + w * y), 2 * (y * z - w * x),
                      w * w - x * x - y * y + z * z], axis=-1)


def heading_residual(params, predicted, measured, model, return_all, **more):
    """Of ball joints; `state` has the time first, then all qpos."""
    state = more["state"]
    rows = np.searchsorted(state[:, 0], measured.times[1:] - 1e-9)
    joints = model.njnt
    found, wanted = (
        headings(q.reshape(len(q), joints, 4)).reshape(len(q), 3 * joints)
        for q in (state[rows, 1:1 + model.nq], measured.data[1:]))
    measured = sysid.TimeSeries.from_custom_map(
        measured.times[1:], wanted,
        [(f"heading{i}", 3, sysid.SignalType.CustomObs)
         for i in range(joints)])
    predicted = sysid.TimeSeries(measured.times, found,
                                 measured.signal_mapping)
    difference = sysid.weighted_diff(found, wanted, model)
    return sysid.normalize_residual(difference, wanted), predicted, measured


class StartRollout:
    """The toolbox's rollout, from the initial states among the parameters: of
    each run the change of the positions (of a ball a rotation vector) and of
    the velocities from what its first row says. A call has one of the runs."""

    def __init__(self, starts):
        self.starts = starts

    def __call__(self, models, initial_states, param_dicts, **more):
        moved = []
        for model, state, params in zip(models, initial_states, param_dicts):
            run = next(k for k, start in enumerate(self.starts)
                       if np.array_equal(start, state))
            change = params[f"start{run}"].value
            state = np.array(state)
            mujoco.mj_integratePos(model, state[1:1 + model.nq],
                                   change[:model.nv], 1.0)
            state[1 + model.nq:1 + model.nq + model.nv] += change[model.nv:]
            moved.append(state)
        return sysid.sysid_rollout(models=models, initial_states=moved, **more)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("urdf")
    parser.add_argument("runs")
    parser.add_argument("--free", required=True)
    parser.add_argument("--friction", default="")
    parser.add_argument("--step", type=float, default=STEP)
    parser.add_argument("--states", action="store_true")
    options = parser.parse_args()

    spec = mujoco.MjSpec.from_file(options.urdf)
    spec.option.timestep = options.step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags |= (mujoco.mjtDisableBit.mjDSBL_CONTACT |
                                 mujoco.mjtDisableBit.mjDSBL_LIMIT)
    joints = list(spec.joints)
    recordings = [load(path, joints) for path in options.runs.split(",")]
    driven = recordings[0][2].shape[1] > 0
    for joint in joints if driven else []:
        actuator = spec.add_actuator(name=joint.name, target=joint.name,
                                     trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_motor()
    model = spec.compile()

    params = sysid.ParameterDict()
    tips = tips_of(options.urdf)
    for name, start in assignments(options.free).items():
        params.add(parameter(spec, tips, name, start))
    for joint, start in assignments(options.friction).items():
        params.add(friction(joint, start))
    names = params.keys()
    if options.states:
        for k in range(len(recordings)):
            zero, far = np.zeros(2 * model.nv), np.full(2 * model.nv, 10.0)
            params.add(sysid.Parameter(f"start{k}", zero, -far, far))

    balls = all(is_ball(joint) for joint in joints)
    starts, controls, measurements = [], [], []
    for t, q, tau in recordings:
        starts.append(sysid.create_initial_state(model, q[0]))
        controls.append(sysid.TimeSeries.from_control_names(
            t, tau if driven else np.zeros((len(t), 0)), model))
        if balls:
            measurements.append(sysid.TimeSeries.from_custom_map(
                t, q, [(joint.name, 4, sysid.SignalType.CustomObs)
                       for joint in joints]))
        else:
            measurements.append(sysid.TimeSeries.from_names(
                t, q, model, names=[(joint.name, sysid.SignalType.MjStateQPos)
                                    for joint in joints]))
    sequences = sysid.ModelSequences(
        "robot", spec, [f"run{k}" for k in range(len(recordings))], starts,
        controls, measurements, allow_missing_sensors=True)
    residual = sysid.build_residual_fn(
        models_sequences=[sequences],
        modify_residual=heading_residual if balls else None,
        custom_rollout=StartRollout(starts) if options.states else None)
    with contextlib.redirect_stdout(sys.stderr):
        found, result = sysid.optimize(params, residual, optimizer="mujoco",
                                       verbose=False)
    residuals, _, _ = residual(result.x, found.copy())
    _, widths = sysid.calculate_intervals(
        [np.concatenate([r.ravel() for r in residuals])], result.jac)
    print(json.dumps({
        "parameters": {n: float(found[n].value[0]) for n in names},
        "intervals": {n: float(w) for n, w in zip(names, widths)},
        "iterations": len(result.extras["objective"]),
    }))


if __name__ == "__main__":
    main()
