"""Faults of the values of a column: digits, limits, spikes, drift."""

import math

from planted import (Kind, Planted, mapping, of_file, of_kind, period, runs_of,
                     span)


def _one_position(case, draw):
    """One hinge's or slide's column, or None."""
    tokens = of_kind(case, "q", "hinge", "slide")
    return draw.one_of(tokens) if tokens else None


def _changed(case, draw, token, change, size, faults, truth=None):
    """The token's column changed run by run: change(times, values)."""
    case = case.copy()
    runs, file = runs_of(case, draw)
    ignored = []
    for run in runs:
        table = case.runs[run]
        column = case.file_columns(token)[0]
        t = table[case.time()]
        values, spoiled = change(t, table[column])
        table[column] = values
        step = period(t)
        for first, last in spoiled:
            ignored.append("%s@%r:%r" % (
                of_file(run if len(case.runs) > 1 else "", token),
                t[first] - step / 2, t[last] + step / 2))
    flags = {"ignore": ",".join(ignored)} if ignored else None
    if truth is not None:
        flags = mapping(case, file, {token: truth(case)})
    return Planted(case, "%s of %s" % (size, token),
                   [(fault, frozenset([token])) for fault in faults], file,
                   flags)


def _stretches(rows):
    """(first, last) of each run of successive rows."""
    found = []
    for row in rows:
        if found and row == found[-1][1] + 1:
            found[-1][1] = row
        else:
            found.append([row, row])
    return [tuple(pair) for pair in found]


def quantisation(case, draw):
    token = _one_position(case, draw)
    if token is None:
        return None
    levels = draw.log_uniform(8, 400)

    def change(_t, values):
        step = span(values) / levels
        return [step * math.floor(v / step + 0.5) for v in values], []

    return _changed(case, draw, token, change, "%.3g levels" % levels,
                    ["quantisation"])


def saturation(case, draw):
    token = _one_position(case, draw)
    if token is None:
        return None
    share = draw.log_uniform(0.01, 0.3)
    upper = draw.coin()

    def change(_t, values):
        ordered = sorted(values)
        count = max(1, int(share * len(values)))
        limit = ordered[-count] if upper else ordered[count - 1]
        cut = [min(v, limit) if upper else max(v, limit) for v in values]
        return cut, _stretches([i for i, v in enumerate(cut) if v == limit])

    return _changed(case, draw, token, change,
                    "%.2g %%" % (100 * share), ["saturation"])


def _spiked(case, draw, token, lower, upper, fault):
    count = 1 + draw.index(10)
    size = draw.log_uniform(lower, upper)

    def change(_t, values):
        wide = span(values)
        rows = sorted(draw.shuffled(range(2, len(values) - 2))[:count])
        new = list(values)
        for row in rows:
            new[row] += size * wide * draw.sign()
        return new, _stretches(rows)

    return _changed(case, draw, token, change,
                    "%d by %.3g of the range" % (count, size), [fault])


def spikes(case, draw):
    token = _one_position(case, draw)
    if token is None:
        return None
    return _spiked(case, draw, token, 0.02, 3.0, "spikes")


def effort_spikes(case, draw):
    tokens = of_kind(case, "tau")
    if not tokens:
        return None
    planted = _spiked(case, draw, draw.one_of(tokens), 0.5, 20.0, "spikes")
    planted.truth = None  # an effort that is not known acts all the same
    planted.right += [("effort_spikes", s) for _, s in planted.right]
    return planted


def frozen(case, draw):
    token = _one_position(case, draw)
    if token is None:
        return None
    name = case.time()
    step = max(period(t[name]) for t in case.runs.values())
    length = draw.log_uniform(4 * step, max(2.0, 8 * step))
    at = draw.uniform(0.1, 0.5)

    def change(t, values):
        first = int(at * len(t))
        last = max(i for i, v in enumerate(t) if v <= t[first] + length)
        new = list(values)
        new[first:last + 1] = [values[first]] * (last + 1 - first)
        return new, [(first + 1, last)]

    return _changed(case, draw, token, change, "%.3g s" % length, ["frozen"])


def drift(case, draw):
    """A trend, by its part of the motion's range at the end."""
    token = _one_position(case, draw)
    if token is None:
        return None
    size = draw.log_uniform(0.01, 1.0) * draw.sign()
    column = case.file_columns(token)[0]
    name = case.time()
    first = next(iter(case.runs.values()))
    rate = size * span(first[column]) / (first[name][-1] - first[name][0])

    def change(t, values):
        return [v + rate * (time - t[0]) for time, v in zip(t, values)], []

    start = first[name][0]
    return _changed(case, draw, token, change,
                    "%.3g a second" % rate, ["drift"],
                    lambda c: "%s-%r*(%s-%r)" % (column, rate, name, start))


def effort_idle(case, draw):
    """What was recorded is not what moved it: a plug that was not in, or
    another motor's effort, here the same one backwards and without its mean
    (which would still be right)."""
    tokens = of_kind(case, "tau")
    if not tokens:
        return None
    unplugged = draw.coin()

    def change(_t, values):
        if unplugged:
            sigma = 0.01 * span(values)
            return [sigma * draw.normal() for _ in values], []
        mean = sum(values) / len(values)
        return [v - mean for v in reversed(values)], []

    return _changed(case, draw, draw.one_of(tokens), change,
                    "unplugged" if unplugged else "backwards",
                    ["effort_idle"])


KINDS = [
    Kind("quantisation", quantisation, "the digits are lost"),
    Kind("saturation", saturation),
    Kind("spikes", spikes),
    Kind("effort_spikes", effort_spikes, "the effort is lost"),
    Kind("frozen", frozen),
    Kind("drift", drift, estimated=True),
    Kind("effort_idle", effort_idle, "the effort is lost"),
]
