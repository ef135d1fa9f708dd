"""Faults of how a column is read: unit, sign, order, name; and of bodies."""

import math

import resample
import urdf
from planted import (Kind, Planted, mapping, of_kind, opposite,
                     put_quaternions, quaternions, runs_of, some)


def _scale(case, runs, tokens, factor):
    for run in runs:
        for token in tokens:
            for column in case.file_columns(token):
                case.runs[run][column] = [factor * v for v
                                          in case.runs[run][column]]


def _scaled(case, draw, tokens, factor, faults, size):
    """The tokens times a factor, in all runs or one."""
    case = case.copy()
    runs, file = runs_of(case, draw)
    _scale(case, runs, tokens, factor)
    truth = {}
    for token in tokens:
        joint, kind = token.rsplit(".", 1)
        if case.joints[joint].kind != "ball":
            truth[token] = "%s*%r" % (case.file_columns(token)[0],
                                      1.0 / factor)
    return Planted(case, "%s of %s" % (size, ", ".join(tokens)),
                   [(fault, frozenset(tokens)) for fault in faults], file,
                   mapping(case, file, truth))


def degrees(case, draw):
    tokens = of_kind(case, "q", "hinge")
    if not tokens:
        return None
    return _scaled(case, draw, some(tokens, draw), 180.0 / math.pi,
                   ["degrees"], "degrees")


def millimetres(case, draw):
    tokens = of_kind(case, "q", "slide")
    if not tokens:
        return None
    unit, factor = draw.one_of([("millimetres", 1e3), ("centimetres", 1e2)])
    return _scaled(case, draw, some(tokens, draw), factor, [unit], unit)


def _time_scaled(case, draw, factor, faults):
    case = case.copy()
    runs, file = runs_of(case, draw)
    name = case.time()
    for run in runs:
        t = case.runs[run][name]
        case.runs[run][name] = [t[0] + factor * (v - t[0]) for v in t]
    return Planted(case, "t by %.4g" % factor,
                   [(fault, frozenset(["t"])) for fault in faults], file,
                   mapping(case, file, {"t": "%s*%r" % (name, 1 / factor)}))


def milliseconds(case, draw):
    return _time_scaled(case, draw, 1e3, ["milliseconds", "clock_scale"])


def clock_scale(case, draw):
    return _time_scaled(case, draw, draw.log_uniform(0.5, 2.0),
                        ["clock_scale"])


def effort_scale(case, draw):
    tokens = of_kind(case, "tau")
    if not tokens:
        return None
    factor = draw.log_uniform(2.0, 1000.0) ** draw.sign()
    return _scaled(case, draw, some(tokens, draw), factor, ["effort_scale"],
                   "%.4g" % factor)


def _sign_fault(tokens):
    kinds = {token.rsplit(".", 1)[1] for token in tokens}
    return "effort_flipped" if kinds == {"tau"} else "axis_flipped"


def _flipped(case, draw, kind):
    tokens = of_kind(case, kind, "hinge", "slide")
    if not tokens:
        return None
    chosen = some(tokens, draw)
    planted = _scaled(case, draw, chosen, -1.0, [_sign_fault(chosen)], "sign")
    if kind == "q":  # the velocity of the same sensor
        for token in chosen:
            velocity = token.removesuffix("q") + "qd"
            if case.file_columns(velocity):
                names = [planted.file] if planted.file else list(case.runs)
                _scale(planted.case, names, [velocity], -1.0)
                column = case.file_columns(velocity)[0]
                more = mapping(case, planted.file, {velocity: "-" + column})
                planted.truth["columns"] += "," + more["columns"]
    # A mirrored machine does the same: all others flipped instead.
    if case.mirror:
        planted.right += opposite(case, _sign_fault, chosen)
        planted.mirrored = True
    return planted


def axis_flipped(case, draw):
    return _flipped(case, draw, "q")


def effort_flipped(case, draw):
    return _flipped(case, draw, "tau")


def _swapped(case, draw, kinds, fault):
    """Two joints of one type change their columns of these kinds."""
    joints = [j for j in case.joints if case.file_columns(j + "." + kinds[0])]
    pairs = [(a, b) for i, a in enumerate(joints) for b in joints[i + 1:]
             if case.joints[a].kind == case.joints[b].kind]
    if not pairs:
        return None
    a, b = draw.one_of(pairs)
    case = case.copy()
    runs, file = runs_of(case, draw)
    truth = {}
    for kind in kinds:
        first = case.file_columns(a + "." + kind)
        second = case.file_columns(b + "." + kind)
        if not first or not second:
            continue
        if len(first) == 1:
            truth.update({a + "." + kind: second[0], b + "." + kind: first[0]})
        for run in runs:
            table = case.runs[run]
            for one, other in zip(first, second):
                table[one], table[other] = table[other], table[one]
    tokens = frozenset([a + "." + kinds[0], b + "." + kinds[0]])
    return Planted(case, "%s and %s" % (a, b), [(fault, tokens)], file,
                   mapping(case, file, truth) if truth else None)


def joints_swapped(case, draw):
    return _swapped(case, draw, ("q", "qd"), "joints_swapped")


def efforts_swapped(case, draw):
    return _swapped(case, draw, ("tau",), "efforts_swapped")


def velocities_swapped(case, draw):
    return _swapped(case, draw, ("qd",), "velocities_swapped")


def absolute_angle(case, draw):
    """One hinge, or all of a chain, by the angle against the base's."""
    before = dict(urdf.parallel_chains(case.all_joints))
    joints = [j for j in before if case.file_columns(j + ".q")]
    if not joints:
        return None
    chosen = [token[:-2] for token in some([j + ".q" for j in joints], draw)]
    case = case.copy()
    runs, file = runs_of(case, draw)
    truth = {}
    for kind in ("q", "qd"):  # the velocity of the same sensor
        column = {j: case.file_columns(j + "." + kind)[0] for j in case.joints
                  if case.file_columns(j + "." + kind)}
        if not column:
            continue
        for run in runs:
            _sum_up(case.runs[run], column, chosen, before)
        for joint in chosen:
            # Less the hinges before, as they are now written.
            text, link = column[joint], before.get(joint)
            while link is not None:
                text += "-" + column[link]
                # One that is a sum already has all before it.
                link = None if link in chosen else before.get(link)
            truth[joint + "." + kind] = text
    return Planted(case, ", ".join(chosen),
                   [("absolute_angle", frozenset(j + ".q" for j in chosen))],
                   file, mapping(case, file, truth))


def _sum_up(table, column, chosen, before):
    """The columns of the chosen joints plus those of all before them."""
    relative = {j: list(table[c]) for j, c in column.items()}
    for joint in chosen:
        total, link = [0.0] * table.rows(), joint
        while link is not None:
            total = [s + v for s, v in zip(total, relative[link])]
            link = before.get(link)
        table[column[joint]] = total


def _turned(case, draw, change, fault):
    tokens = of_kind(case, "q", "ball")
    if not tokens:
        return None
    chosen = some(tokens, draw)
    case = case.copy()
    runs, file = runs_of(case, draw)
    for run in runs:
        for token in chosen:
            joint = token[:-2]
            table = case.runs[run]
            put_quaternions(case, table, joint,
                            [change(q) for q
                             in quaternions(case, table, joint)])
    return Planted(case, ", ".join(chosen), [(fault, frozenset(chosen))], file)


def quaternion_order(case, draw):
    """x, y, z, w in the columns w, x, y, z."""
    return _turned(case, draw, lambda q: (q[1], q[2], q[3], q[0]),
                   "quaternion_order")


def quaternion_inverse(case, draw):
    return _turned(case, draw, resample.conjugate, "quaternion_inverse")


def velocity_flipped(case, draw):
    tokens = of_kind(case, "qd", "hinge", "slide")
    if not tokens:
        return None
    return _scaled(case, draw, some(tokens, draw), -1.0,
                   ["velocity_flipped"], "sign")


def velocity_scale(case, draw):
    tokens = of_kind(case, "qd", "hinge", "slide")
    if not tokens:
        return None
    factor = draw.one_of([180.0 / math.pi, 30.0 / math.pi,
                          draw.log_uniform(1.1, 1000.0) ** draw.sign()])
    # Degrees a second is such a factor.
    return _scaled(case, draw, some(tokens, draw), factor,
                   ["velocity_scale", "degrees"], "%.4g" % factor)


def unmapped(case, draw):
    """A joint's columns by a name that is not ours."""
    joints = [j for j in case.joints if case.file_columns(j + ".q")]
    if case.recorded or len(joints) < 2:
        return None  # a recording's names are in its specification
    joint = draw.one_of(joints)
    number = 1 + joints.index(joint)
    case = case.copy()
    names, truth = {}, {}
    for kind, other in (("q", "pos"), ("qd", "vel"), ("tau", "cur")):
        for i, column in enumerate(case.file_columns(joint + "." + kind)):
            tail = "wxyz"[i] if case.joints[joint].kind == "ball" else ""
            names[column] = "%s%d%s" % (other, number, tail)
            ours = (joint + "." + kind if not tail
                    else joint + "." + ("q" + tail))
            truth[ours] = names[column]
    for table in case.runs.values():
        table.rename(names)
    if case.columns:
        case.columns = {ours: theirs for ours, theirs in case.columns.items()
                        if theirs not in names}
        case.flags["columns"] = ",".join("%s=%s" % c
                                         for c in case.columns.items())
    subjects = [frozenset([joint + ".q"]),
                frozenset(ours for ours in truth)]
    return Planted(case, joint, [(fault, s) for s in subjects for fault in
                                 ("not_mapped", "unmapped",
                                  "unmapped_columns")],
                   "", mapping(case, "", truth))


def _bodies(case):
    return [link for link in case.links.values() if link.mass > 0.0
            and any(j.child == link.name for j in case.all_joints
                    if j.kind != "fixed")]


def inertia_about_joint(case, draw):
    """I + m (r'r E - r r') in the URDF, which wants I."""
    links = [link for link in _bodies(case) if any(link.com)]
    if not links:
        return None
    link = draw.one_of(links)
    case = case.copy()
    case.urdf = urdf.with_link(case.urdf, link.name,
                               inertia=urdf.about_joint(link))
    return Planted(case, link.name,
                   [("inertia_about_joint", frozenset([link.name]))])


def mass_in_grams(case, draw):
    names = some([link.name for link in _bodies(case)], draw)
    case = case.copy()
    for name in names:
        case.urdf = urdf.with_link(case.urdf, name,
                                   mass=1e3 * case.links[name].mass)
    return Planted(case, ", ".join(names),
                   [("mass_in_grams", frozenset(names))])


KINDS = [
    Kind("degrees", degrees),
    Kind("millimetres", millimetres),
    Kind("milliseconds", milliseconds),
    Kind("clock_scale", clock_scale, estimated=True),
    Kind("effort_scale", effort_scale, estimated=True),
    Kind("axis_flipped", axis_flipped),
    Kind("effort_flipped", effort_flipped),
    Kind("joints_swapped", joints_swapped),
    Kind("efforts_swapped", efforts_swapped),
    Kind("absolute_angle", absolute_angle),
    Kind("quaternion_order", quaternion_order),
    Kind("quaternion_inverse", quaternion_inverse),
    Kind("velocity_flipped", velocity_flipped),
    Kind("velocity_scale", velocity_scale),
    Kind("velocities_swapped", velocities_swapped),
    Kind("unmapped", unmapped),
    Kind("inertia_about_joint", inertia_about_joint),
    Kind("mass_in_grams", mass_in_grams),
]
