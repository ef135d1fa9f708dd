"""Faults of time: delays, clocks, rates, and how much was recorded."""

import resample
from planted import (Kind, Planted, at_times, noise_of, of_file, of_kind,
                     opposite, period, runs_of)


def _delay_fault(_tokens):
    return "channel_late"


def _delayed(case, draw, tokens, fault):
    """The tokens' columns read `delay` late: what stands at t was so at
    t - delay. Early is negative."""
    name = case.time()
    step = max(period(table[name]) for table in case.runs.values())
    if 2 * step > 0.06:
        return None
    delay = draw.uniform(2 * step, 0.06) * draw.sign()
    case = case.copy()
    runs, file = runs_of(case, draw)
    for run in runs:
        table = case.runs[run]
        t = table[name]
        # Rows whose late values were not recorded are left out.
        kept = [i for i, time in enumerate(t)
                if t[0] <= time - delay <= t[-1]]
        times = [t[i] - delay for i in kept]
        new = {}
        for token in tokens:
            new.update(at_times(case, table, token, times))
        table.keep(kept)
        for column, values in new.items():
            table[column] = values
    truth = {"shift": ",".join("%s=%r" % (of_file(file, name), delay)
                               for name in map(case.first_name, tokens))}
    return Planted(case, "%.1f ms of %s" % (1e3 * delay, ", ".join(tokens)),
                   [(fault, frozenset(tokens))], file, truth)


def channel_late(case, draw):
    """A position, an effort or all efforts, against everything else."""
    positions, efforts = of_kind(case, "q"), of_kind(case, "tau")
    if len(positions + efforts) < 2:
        return None  # when a single column began is nobody's question
    groups = [[token] for token in positions + efforts]
    if len(efforts) > 1:
        groups.append(efforts)
    chosen = draw.one_of(groups)
    # The velocity of the same sensor is as late.
    velocities = [token + "d" for token in chosen if token.endswith(".q")
                  and case.file_columns(token + "d")]
    planted = _delayed(case, draw, chosen + velocities, "channel_late")
    if planted is None:
        return None
    if velocities:
        planted.right.append(("channel_late", frozenset(chosen)))
    if not of_kind(case, "qd"):
        # All others as much the other way: only where t is zero differs.
        planted.right += opposite(case, _delay_fault, chosen)
    return planted


def velocity_late(case, draw):
    tokens = of_kind(case, "qd")
    if not tokens:
        return None
    return _delayed(case, draw, [draw.one_of(tokens)], "velocity_late")


def _resampled(case, draw, rows_of_run, fault, size, file=None):
    case = case.copy()
    runs, one = runs_of(case, draw) if file is None else (list(case.runs), "")
    for run in runs:
        case.runs[run].keep(rows_of_run(case.runs[run]))
    return Planted(case, size, [(fault, None)], one)


def time_jitter(case, draw):
    """Stamps that wander by a part of a period, while samples were even."""
    part = draw.log_uniform(0.02, 0.45)
    case = case.copy()
    runs, file = runs_of(case, draw)
    for run in runs:
        table = case.runs[run]
        t = table[case.time()]
        step = min(b - a for a, b in zip(t, t[1:]))
        table[case.time()] = [v + part * step * draw.uniform(-1, 1) for v in t]
    return Planted(case, "%.3g of a step" % part,
                   [("time_jitter", frozenset(["t"]))], file)


def gap(case, draw):
    name = case.time()
    shortest = min(t[name][-1] - t[name][0] for t in case.runs.values())
    step = max(period(t[name]) for t in case.runs.values())
    length = draw.log_uniform(5 * step, max(shortest / 3, 6 * step))
    at = draw.uniform(0.1, 0.6)

    def rows(table):
        t = table[name]
        start = t[0] + at * (t[-1] - t[0])
        return [i for i, v in enumerate(t)
                if not start < v < start + length]

    return _resampled(case, draw, rows, "gap", "%.3g s" % length)


def slow_sampling(case, draw):
    name = case.time()
    step = max(period(t[name]) for t in case.runs.values())
    every = int(draw.log_uniform(5, max(0.5 / step, 10)))
    return _resampled(case, draw, lambda t: range(0, t.rows(), every),
                      "slow_sampling", "every %d" % every, "")


def few_samples(case, draw):
    rows = 3 + draw.index(23)
    return _resampled(case, draw, lambda t: range(min(rows, t.rows())),
                      "few_samples", "%d rows" % rows, "")


def still(case, draw):
    """Held at its first position before it is let go, recorded all along."""
    share = draw.log_uniform(0.5, 0.95)
    case = case.copy()
    runs, file = runs_of(case, draw)
    for run in runs:
        table = case.runs[run]
        t = table[case.time()]
        step = period(t)
        count = int(share / (1 - share) * table.rows())
        held = {}
        for joint, kind in ((j, case.joints[j].kind) for j in case.joints):
            for column in case.file_columns(joint + ".q"):
                sigma = noise_of(table[column])
                held[column] = [table[column][0] + sigma * draw.normal()
                                for _ in range(count)]
            for column in case.file_columns(joint + ".qd"):
                sigma = noise_of(table[column])
                held[column] = [sigma * draw.normal() for _ in range(count)]
            if kind == "ball" and case.file_columns(joint + ".q"):
                columns = case.file_columns(joint + ".q")
                rows = [resample.normalised(q)
                        for q in zip(*(held[c] for c in columns))]
                for column, values in zip(columns, zip(*rows)):
                    held[column] = list(values)
        first = t[0]
        table[case.time()] = ([first + step * i for i in range(count)]
                              + [v + step * count for v in t])
        for column, values in table.columns.items():
            if column != case.time():
                table[column] = held.get(column, [0.0] * count) + values
    return Planted(case, "%.0f %%" % (100 * share),
                   [("still", None)], file)


KINDS = [
    Kind("channel_late", channel_late, estimated=True),
    Kind("velocity_late", velocity_late, estimated=True),
    Kind("time_jitter", time_jitter, "the true stamps are lost"),
    Kind("gap", gap, "the file is cut there"),
    Kind("slow_sampling", slow_sampling, "it is recorded again"),
    Kind("few_samples", few_samples, "it is recorded again"),
    Kind("still", still),
]
