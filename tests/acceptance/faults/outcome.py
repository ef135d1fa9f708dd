"""What the programs make of a planted fault: what is a hit, and what is not.

Only check.json and fit.json are read (docs/checks.md, docs/interface.md).
"""

import dataclasses
import math
import re

import programs as flags_of
import urdf

# A right fix leaves at most this many times the clean recording's error. From
# `data_faults_suite.py --spread`: the fits of recordings that are mended by
# flags that are known to be right (docs/fault_suite.md).
ERROR_FACTOR = 1.1
# Standard errors in a 95 % interval.
INTERVAL = 1.96
# Of a parameter's value: where the fix is an estimated number, its error is
# the parameters' too, whose own intervals know nothing of it. One percent is
# what a scale or a ruler in a workshop says.
ESTIMATED_WITHIN = 0.01


@dataclasses.dataclass
class Reference:
    """The clean recording: its findings and its fit."""
    findings: list
    fit: dict  # None where the fit failed
    seconds: float  # of the check
    said: str


@dataclasses.dataclass
class Outcome:
    case: str
    recorded: bool
    seed: int
    fault: str
    size: str
    file: str
    first: str  # what was found first, for people
    named: bool
    located: bool  # named, on the right subject in the right run
    repaired: object  # None where no flag is a fix
    # Of what is not located: the fit with the fault is the clean one within
    # a standard error; it explains the data as well by other values.
    small: bool
    hidden: bool
    seconds: float  # of the check, of the processor
    note: str = ""


def reference(programs, case, folder):
    words = flags_of.as_words(case.write(folder))
    check = programs.check(words, folder)
    fit = programs.fit(words, folder)
    findings = check.json["findings"] if check.json else []
    said = "" if check.code in (0, 1) else "check: " + check.err[-300:]
    if fit.json is None:
        said += " fit: " + fit.err[-300:]
    return Reference(findings, fit.json, check.seconds, said.strip())


def tokens_of(subject):
    """"joint1.qw, joint1.qx" is {"joint1.q"}; also links and joints."""
    tokens = set()
    for word in re.split(r"\s*,\s*", subject.strip()):
        word = re.sub(r"\.q[wxyz]$", ".q", word)
        word = re.sub(r"\.w[xyz]$", ".qd", word)
        tokens.add(re.sub(r"\.tau[xyz]$", ".tau", word))
    return frozenset(tokens - {""})


def same_subject(found, right):
    """A joint's name alone stands for any of its columns, and no subject for
    the time of the whole file."""
    if right is None or found == right or (not found and right == {"t"}):
        return True
    return bool(found) and found == {t.rsplit(".", 1)[0] for t in right}


def place_of(finding, case):
    """(run's name, subjects) of a finding.

    A run that the reader refuses is named "a.csv:1:4", line and column: the
    fourth column is the subject.
    """
    found = tokens_of(finding["subject"])
    parts = (finding["file"] or "").rsplit("/", 1)[-1].split(":")
    names = list(next(iter(case.runs.values())).columns)
    if not found and len(parts) == 3 and 0 < int(parts[2]) <= len(names):
        name = names[int(parts[2]) - 1]
        found = frozenset(t for t in case.measured()
                          if name in case.file_columns(t))
    return parts[0], found


def is_right(finding, planted):
    """(named, located) of a finding."""
    named = [s for fault, s in planted.right if fault == finding["fault"]]
    place, found = place_of(finding, planted.case)
    runs = planted.case.runs
    right_run = (place == planted.file if planted.file
                 else place in ("", planted.case.model, *runs))
    located = right_run and any(same_subject(found, s) for s in named)
    return bool(named), bool(named) and located


def error_of(fit, clean):
    """Root mean square over the channels of the error in the clean
    recording's noise: another estimate of the noise earns nothing."""
    if fit is None or fit["error"]["train"] is None:
        return math.inf
    errors = {c["name"]: c["rms"] for c in fit["error"]["channels"]}
    total = 0.0
    channels = clean["error"]["channels"]
    for channel in channels:
        rms = errors.get(channel["name"])
        if rms is None:
            return math.inf
        total += (rms / channel["noise"]) ** 2
    return math.sqrt(total / len(channels))


def _parameters(fit):
    return {p["name"]: p for p in fit["parameters"]}


def largest_change(fit, clean, both, mirrored=False, within=0.0):
    """Of the parameters, in the clean fit's standard errors; with `both`, in
    the larger of both fits' (a mended recording may have fewer samples). In a
    mirror a bias has the other sign; what must be positive cannot. A change
    of at most `within` of the value is none."""
    largest, now = 0.0, _parameters(fit)
    for name, p in _parameters(clean).items():
        if p["std_error"] is None or name not in now:
            continue
        error = p["std_error"]
        if both:
            error = max(error, now[name]["std_error"] or 0.0)
        change = abs(now[name]["value"] - p["value"])
        if mirrored:
            change = min(change, abs(now[name]["value"] + p["value"]))
        if change > within * abs(p["value"]):
            largest = max(largest, change / error if error else math.inf)
    return largest


def fit_as(programs, flags, folder, clean):
    """A fit over segments as long as the clean fit's: errors over other
    horizons say nothing of each other."""
    pinned = {**flags, "segment": repr(clean["segment_s"])}
    fit = programs.fit(flags_of.as_words(pinned), folder)
    if fit.code == 2 and "segment" in fit.err:  # longer than the run now
        fit = programs.fit(flags_of.as_words(flags), folder)
    return fit.json


def fix_of(findings):
    """The flags of the first finding's first fix, and of its like in other
    runs or places: each repeats what the same flag said already, so that it
    takes its place."""
    flags = {}
    for finding in findings:
        if finding["fault"] != findings[0]["fault"]:
            continue
        for remedy in finding["remedies"][:1]:
            flags = flags_of.merged(flags, flags_of.parse_flags(remedy))
    return flags


_LINE = re.compile(r'link ([^:]+): <mass value="([^"]+)"/> <inertia ([^>]*)/>')


def paste_lines(findings, text):
    """The URDF with the lines that a finding wants there; None without."""
    found = [m for remedy in findings[0]["remedies"]
             for m in _LINE.finditer(remedy)]
    for match in found:
        moments = dict(re.findall(r'(\w+)="([^"]+)"', match.group(3)))
        text = urdf.with_link(
            text, match.group(1), float(match.group(2)),
            tuple(float(moments[m]) for m
                  in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")))
    return text if found else None


def is_repaired(programs, kind, planted, findings, flags, folder, clean):
    """(whether the fix brings the clean recording's fit, what it brings)."""
    fix = fix_of(findings)
    lines = paste_lines(findings, planted.case.urdf)
    if not fix and lines is None:
        return False, "no flag"
    if lines is not None:
        (folder / planted.case.model).write_text(lines)
    fit = fit_as(programs, {**flags, **fix}, folder, clean)
    ratio = error_of(fit, clean) / error_of(clean, clean)
    within = ESTIMATED_WITHIN if kind.estimated else 0.0
    change = (largest_change(fit, clean, True, planted.mirrored, within)
              if fit else math.inf)
    return (ratio <= ERROR_FACTOR and change <= INTERVAL,
            "fix leaves %.3g times the clean error, parameters off by %.3g "
            "standard errors" % (ratio, change))


def judge(programs, kind, planted, name, seed, folder, clean):
    """Plants, asks, mends and compares."""
    flags = planted.case.write(folder)
    check = programs.check(flags_of.as_words(flags), folder)
    findings = check.json["findings"] if check.json else []
    outcome = Outcome(name, planted.case.recorded, seed, kind.name,
                      planted.size, planted.file, "nothing", False, False,
                      None, False, False, check.seconds)
    if check.code not in (0, 1):
        outcome.first = "exit %s" % check.code
        outcome.note = check.err[-300:]
    if findings:
        first = findings[0]
        outcome.first = "%s %s %s" % (first["fault"], first["file"] or "",
                                      first["subject"])
        outcome.note = first["evidence"]
        outcome.named, outcome.located = is_right(first, planted)
    if clean.fit is None:
        outcome.note += "; no clean fit"
    elif outcome.located and not kind.no_flag:
        outcome.repaired, said = is_repaired(programs, kind, planted,
                                             findings, flags, folder,
                                             clean.fit)
        outcome.note += "; " + said
    elif not outcome.located:
        fit = fit_as(programs, flags, folder, clean.fit)
        if fit is not None:
            close = error_of(fit, clean.fit) <= ERROR_FACTOR * error_of(
                clean.fit, clean.fit)
            near = largest_change(fit, clean.fit, False) < 1.0
            outcome.small = close and near
            outcome.hidden = close and not near
    if not kind.no_flag and outcome.repaired is None:
        outcome.repaired = False
    return outcome


def spread(programs, planted, folder, clean):
    """The error of a recording that is mended by flags known to be right,
    over the clean one's, and how far the parameters are off."""
    flags = flags_of.merged(planted.case.write(folder), planted.truth)
    fit = fit_as(programs, flags, folder, clean)
    if fit is None:
        return math.inf, math.inf
    return (error_of(fit, clean) / error_of(clean, clean),
            largest_change(fit, clean, True))
