"""A planted fault, and what every kind of fault needs to plant one."""

import dataclasses

import resample
from cases import Case


@dataclasses.dataclass
class Planted:
    """The recording with the fault, and what is a hit."""
    case: Case
    size: str  # for people
    # (fault, subjects): the names and places that are right; None is any
    # place. More than one where they say the same of the data
    # (docs/fault_suite.md).
    right: list
    file: str = ""  # the one run of several that has it; "" is all
    # The fix, as flags that are known to be right: only the suite's own tests
    # and the spread of right fixes use it. None where no flag is one.
    truth: dict = None
    # Whether one of `right` is the machine in a mirror: its fix brings the
    # clean fit with offsets and biases of the other sign.
    mirrored: bool = False


class Kind:
    """A kind of fault. plant(case, draw) is None where a case cannot have it;
    that must not depend on whether the fault would show."""

    def __init__(self, name, plant, no_flag="", estimated=False):
        self.name = name
        self.estimated = estimated  # whether the fix is a number to estimate
        self.plant = plant
        self.no_flag = no_flag  # why no flag can mend it; "" where one can


def runs_of(case, draw):
    """The runs that get the fault, and Planted.file: all, or one of several."""
    names = list(case.runs)
    if len(names) == 1 or draw.coin():
        return names, ""
    name = draw.one_of(names)
    return [name], name


def of_file(file, name):
    """A column or other name in a flag, for one run where `file` is given."""
    return file + "/" + name if file else name


def some(tokens, draw):
    """One of them, or all: what is done to one column is often done to all."""
    if len(tokens) > 1 and draw.index(4) == 0:
        return list(tokens)
    return [draw.one_of(tokens)]


def of_kind(case, kind, *joint_kinds):
    """Measured "joint.kind" of joints of these kinds."""
    return [token for token in case.measured(kind)
            if not joint_kinds
            or case.joints[token.rsplit(".", 1)[0]].kind in joint_kinds]


def mapping(case, file, expressions):
    """{"columns": ...} that reads tokens by expressions of file columns."""
    return {"columns": ",".join(of_file(file, ours) + "=" + text
                                for ours, text in expressions.items())}


def span(values):
    kept = [v for v in values if v == v]
    return max(kept) - min(kept)


def period(times):
    """The median step."""
    steps = sorted(b - a for a, b in zip(times, times[1:]))
    return steps[len(steps) // 2]


def noise_of(values):
    """Standard deviation of white noise on a smooth signal: the median size
    of third differences, whose variance is 20 times its own."""
    thirds = sorted(abs(d - 3 * c + 3 * b - a) for a, b, c, d
                    in zip(values, values[1:], values[2:], values[3:]))
    return thirds[len(thirds) // 2] / 0.6745 / 20.0 ** 0.5


def quaternions(case, table, joint):
    return list(zip(*(table[c] for c in case.file_columns(joint + ".q"))))


def put_quaternions(case, table, joint, values):
    for column, numbers in zip(case.file_columns(joint + ".q"),
                               zip(*values)):
        table[column] = numbers


def at_times(case, table, token, times):
    """The values of a token's columns at other times, column by column."""
    joint, kind = token.rsplit(".", 1)
    t = table[case.time()]
    columns = case.file_columns(token)
    if kind == "q" and case.joints[joint].kind == "ball":
        turned = [resample.slerp(t, quaternions(case, table, joint), time)
                  for time in times]
        return dict(zip(columns, (list(c) for c in zip(*turned))))
    # An effort is held from its row until the next.
    read = resample.held if kind == "tau" else resample.cubic
    return {c: [read(t, table[c], time) for time in times] for c in columns}


def opposite(case, kind_of, tokens):
    """What is the same as `tokens` seen the other way: all that is measured,
    less these. kind_of names the fault of a set of tokens."""
    rest = [t for t in case.measured() if not t.endswith(".qd")
            and t not in tokens]
    return [(kind_of(rest), frozenset(rest))] if rest else []
