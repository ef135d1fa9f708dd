#!/usr/bin/env python3
"""What the programs say of a recording does not hang on its last bits.

  last_bits_test.py --programs build/release/tools [CASE...]

runs sysid_check, sysid_fit and sysid_diagnose on recordings as they are and
perturbed by 1e-13 (perturb.py), and compares what is said: exit codes, first
finding with its fix, what a fit calls unidentifiable or at its bound, verdict
and effects of a diagnosis. Numbers are not compared: a chaotic fit may end
elsewhere. last_bits.json has what was said where the test was written, so that
each preset's run is compared with the others'; --write makes it again. Exit
code 77: no case could run.
"""

import argparse
import json
import re
import sys
import tempfile
from pathlib import Path

import cases
import programs as flags_of
import readings
import timing
from draw import Draw
from perturb import perturbed
from programs import Programs
from table import read_table

EXPECTED = Path(__file__).resolve().parent / "last_bits.json"
SEEDS = (1, 2)  # each another perturbation


def _shipped(run, model, flags=None):
    """A shipped run with a shipped model."""

    def make(_programs):
        text, spec = cases.model_files(cases.ROBOTS, model)
        table = read_table(cases.SOURCE / "data" / "runs" / run)
        return cases.Case(model, model + ".urdf", text, spec, {run: table},
                          {}, flags or {})

    return make


def _clean(maker, seed):
    return lambda programs: maker(programs, seed)


def _faulty(maker, seed, kinds, name):
    """With a planted fault of the suite."""

    def make(programs):
        case = maker(programs, seed)
        kind = next(k for k in kinds if k.name == name)
        return case and kind.plant(case, Draw("last bits", name)).case

    return make


# What is asked of each: the names of programs.
CASES = {
    "pendulum3": (_shipped("pendulum3.csv", "pendulum3"),
                  ("check", "fit", "diagnose")),
    "figure1_damped": (_shipped("figure1_damped.csv", "pendulum2"),
                       ("check", "fit", "diagnose")),
    "cartpole": (_shipped("cartpole.csv", "cartpole"),
                 ("check", "fit", "diagnose")),
    "rod_and_bob": (_shipped("rod_and_bob.csv", "rod_and_bob"),
                    ("check", "fit")),
    "pendulum2_planar_friction": (
        _shipped("pendulum2_planar_friction.csv", "pendulum2_planar"),
        ("check", "fit", "diagnose")),
    "simulated": (_clean(cases.pendulum2_planar, 1), ("check", "diagnose")),
    "axis_flipped": (_faulty(cases.pendulum2_planar, 1, readings.KINDS,
                             "axis_flipped"), ("check",)),
    "channel_late": (_faulty(cases.pendulum2_planar, 1, timing.KINDS,
                             "channel_late"), ("check",)),
    "emps": (_clean(cases.emps, 1), ("check", "fit")),
    "simple_pendulum_dfki": (_clean(cases.simple_pendulum_dfki, 1),
                             ("check", "fit", "diagnose")),
}


def _without_digits(text):
    """A fix without the size of its numbers: "joint1.q=#"."""
    return re.sub(r"(?<![\w.])[-+]?\d[\d.]*(e[-+]?\d+)?", "#", text)


def _first_finding(document):
    for finding in document["findings"][:1]:
        return [finding["fault"], finding["file"], finding["subject"],
                _without_digits("".join(finding["remedies"][:1]))]
    return None


def said(programs, program, flags, folder):
    """What may not change, of one program."""
    words = flags_of.as_words(flags)
    if program == "check":
        result = programs.check(words, folder)
    elif program == "fit":
        result = programs.fit(words, folder)
    else:
        result = programs.diagnose(words + ["--auto"], folder)
    words = {"exit code": result.code}
    document = result.json
    if document is None:
        return words
    words["first finding"] = _first_finding(document)
    if program == "fit":
        words["converged"] = document["converged"]
        words["not identifiable"] = document["not_identifiable"]
        words["at bound"] = [p["name"] for p in document["parameters"]
                             if p["at_bound"]]
    if program == "diagnose":
        words["verdict"] = document["verdict"]
        # On an edge it is said that the data do not decide: not which of the
        # rivals comes first.
        if document["verdict"] != "undecided":
            words["added"] = [[a["effect"], a["target"]]
                              for a in document["added"]]
    return words


def run_case(programs, name):
    """(what is said as it is, and perturbed by each seed); None: absent."""
    make, asked = CASES[name]
    case = make(programs)
    if case is None:
        return None
    found = []
    runs = case.runs
    for seed in (None, *SEEDS):
        if seed is not None:
            case.runs = {file: perturbed(table, seed, file)
                         for file, table in runs.items()}
        with tempfile.TemporaryDirectory(prefix="last_bits_") as folder:
            flags = case.write(folder)
            found.append({program: said(programs, program, flags, folder)
                          for program in asked})
    return found


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--programs", required=True)
    parser.add_argument("--write", action="store_true",
                        help="write last_bits.json")
    parser.add_argument("cases", nargs="*", metavar="CASE")
    args = parser.parse_args()
    programs = Programs(args.programs, limit=900)
    expected = (json.loads(EXPECTED.read_text()) if EXPECTED.exists() else {})
    wrong, ran = 0, 0
    for name in args.cases or CASES:
        found = run_case(programs, name)
        if found is None:
            print("%s: absent" % name)
            continue
        ran += 1
        if args.write:
            expected[name] = found[0]
        for i, words in enumerate(found):
            for program in words:
                if words[program] != expected[name][program]:
                    wrong += 1
                    print("%s, sysid_%s, %s:\n  %s\nwhere last_bits.json has\n"
                          "  %s" % (name, program, "perturbed by seed %d" %
                                    SEEDS[i - 1] if i else "as it is",
                                    json.dumps(words[program]),
                                    json.dumps(expected[name][program])))
        print("%s: %s" % (name, json.dumps(found[0])), flush=True)
    if args.write:
        EXPECTED.write_text(json.dumps(expected, indent=1, sort_keys=True)
                            + "\n")
    if ran == 0:
        sys.exit(77)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
