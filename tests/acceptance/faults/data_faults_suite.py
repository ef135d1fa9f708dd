#!/usr/bin/env python3
"""How often sysid_check names a planted fault, where, and with what fix.

  data_faults_suite.py --programs build/release/tools --half set

plants every fault in recordings of machines that the detector's constants may
be set on (`set`, odd seeds) or of others (`judge`, even seeds; for published
figures, once), asks sysid_check and sysid_fit as users do, and prints the
table of docs/checks.md. docs/fault_suite.md says what is drawn and what a hit
is. What is missed goes to standard error, case by case.
"""

import argparse
import concurrent.futures
import dataclasses
import json
import math
import shutil
import signal
import sys
import tempfile
import threading
from pathlib import Path

import cases
import outcome as outcomes
import readings
import timing
import values
from draw import Draw
from programs import Programs

KINDS = readings.KINDS + timing.KINDS + values.KINDS


def bound_of(alarms, count):
    """Clopper and Pearson's one-sided upper 95 % bound of a rate."""
    if alarms >= count:
        return 1.0

    def at_most(p):
        """P(X <= alarms) of a binomial count."""
        return sum(math.exp(math.lgamma(count + 1) - math.lgamma(k + 1)
                            - math.lgamma(count - k + 1) + k * math.log(p)
                            + (count - k) * math.log1p(-p))
                   for k in range(alarms + 1))

    lower, upper = 0.0, 1.0
    for _ in range(60):
        p = (lower + upper) / 2
        lower, upper = (p, upper) if at_most(p) > 0.05 else (lower, p)
    return upper


class Suite:
    """The clean cases of one half, made and fitted once each."""

    def __init__(self, programs, half, folder):
        self.programs = programs
        self.half = half
        self.folder = Path(folder)
        self._cases, self._references = {}, {}
        self._locks, self._lock = {}, threading.Lock()

    def _lock_of(self, key):
        with self._lock:
            return self._locks.setdefault(key, threading.Lock())

    def seed(self, i):
        """The i-th seed, from 0: odd ones set, even ones judge."""
        return 2 * i + (1 if self.half == "set" else 2)

    def case(self, maker, seed):
        """None where what it needs is absent."""
        with self._lock_of((maker.__name__, seed)):
            key = (maker.__name__, seed)
            if key not in self._cases:
                self._cases[key] = maker(self.programs, seed)
            return self._cases[key]

    def reference(self, maker, seed):
        case = self.case(maker, seed)
        key = (maker.__name__, seed, "reference")
        with self._lock_of(key):
            if key not in self._references:
                folder = self.folder / ("%s_%d" % (maker.__name__, seed))
                self._references[key] = outcomes.reference(
                    self.programs, case, folder)
                shutil.rmtree(folder)
            return self._references[key]

    def planted(self, kind, maker, seed):
        case = self.case(maker, seed)
        if case is None:
            return None
        return kind.plant(case, Draw("fault", kind.name, maker.__name__, seed))

    def chosen(self, kind, makers, seed, count):
        """At most `count` of the cases that can have the fault."""
        order = Draw("order", kind.name, self.half, seed).shuffled(makers)
        found = []
        for maker in order:
            if len(found) == count:
                break
            planted = self.planted(kind, maker, seed)
            if planted is not None:
                found.append((maker, planted))
        return found

    def scratch(self, *words):
        return self.folder / "_".join(str(word) for word in words)

    def judge(self, kind, maker, planted, seed):
        folder = self.scratch(kind.name, maker.__name__, seed)
        result = outcomes.judge(self.programs, kind, planted, maker.__name__,
                                seed, folder, self.reference(maker, seed))
        shutil.rmtree(folder)
        if not result.located or result.repaired is False:
            print("%s %s in %s%s, seed %d: %s (%s)%s" % (
                kind.name, planted.size, maker.__name__,
                "/" + planted.file if planted.file else "", seed,
                result.first, result.note,
                "; too small" if result.small else
                "; hidden" if result.hidden else ""), file=sys.stderr,
                flush=True)
        return result

    def spread(self, kind, maker, planted, seed):
        clean = self.reference(maker, seed)
        if planted.truth is None or clean.fit is None:
            return None
        folder = self.scratch("spread", kind.name, maker.__name__, seed)
        ratio, change = outcomes.spread(self.programs, planted, folder,
                                        clean.fit)
        shutil.rmtree(folder)
        print("%s %s in %s, seed %d: %.4g times the clean error, %.3g "
              "standard errors" % (kind.name, planted.size, maker.__name__,
                                   seed, ratio, change), flush=True)
        return ratio, change


def row_of(name, results):
    """A row of the table."""
    count = len(results)
    flags = [r for r in results if r.repaired is not None]
    instead = {}
    for r in results:
        if not r.located:
            words = r.first.split()
            text = "%s (%s)" % (
                words[0] if not r.named else "elsewhere", r.case)
            instead[text] = instead.get(text, 0) + 1
    return "| %s | %d | %d | %d | %s | %d | %d | %s |" % (
        name, count, sum(r.named for r in results),
        sum(r.located for r in results),
        "%d of %d" % (sum(bool(r.repaired) for r in flags), len(flags))
        if flags else "-",
        sum(r.small for r in results), sum(r.hidden for r in results),
        ", ".join("%s x%d" % item for item in sorted(instead.items())))


def print_table(results):
    print("| fault | planted | named | located | repaired | missed, too small "
          "| missed, hidden | instead |\n|---|---|---|---|---|---|---|---|")
    for kind in KINDS:
        own = [r for r in results if r.fault == kind.name]
        if own:
            print(row_of("`%s`" % kind.name, own))
    for name, recorded in (("all simulated", False), ("all recorded", True)):
        own = [r for r in results if r.recorded == recorded]
        if own:
            print(row_of(name, own).rsplit("|", 2)[0] + "| |")


def print_clean(findings):
    """findings: {(case, recorded, seed): Reference}."""
    for recorded in (False, True):
        own = {key: ref for key, ref in findings.items()
               if key[1] == recorded}
        if not own:
            continue
        alarms = [key for key, ref in own.items() if ref.findings]
        print("\nclean, %s: %d of %d have a finding; the rate is at most "
              "%.2g %% (95 %%)" % (
                  "recorded" if recorded else "simulated", len(alarms),
                  len(own), 100 * bound_of(len(alarms), len(own))))
        for key in alarms:
            first = own[key].findings[0]
            print("  %s, seed %d: %s %s %s: %s" % (
                key[0], key[2], first["fault"], first["file"],
                first["subject"], first["evidence"]))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--programs", required=True,
                        help="folder of sysid_check and the others")
    parser.add_argument("--mujoco_recording",
                        help="its file; without it no machine is by MuJoCo")
    parser.add_argument("--half", choices=("set", "judge"), required=True)
    parser.add_argument("--seeds", default="1", metavar="[FIRST:]COUNT",
                        help="how many of the half's seeds, and which first")
    parser.add_argument("--per_fault", type=int, default=99,
                        help="machines that get a fault, for each seed")
    parser.add_argument("--faults", default="", help="only these")
    parser.add_argument("--cases", default="", help="only these machines")
    parser.add_argument("--clean", type=int, default=0,
                        help="only so many seeds of clean recordings")
    parser.add_argument("--spread", action="store_true",
                        help="only what right fixes leave")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--limit", type=int, default=600,
                        help="seconds of the processor for one program")
    parser.add_argument("--json", help="every outcome, in this file")
    args = parser.parse_args()
    first, _, count = args.seeds.rpartition(":")
    indices = range(int(first or 1) - 1, int(first or 1) - 1 + int(count))
    # Ended early, by a shell or by timeout: the table of what is done.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    programs = Programs(args.programs, args.mujoco_recording, args.limit)
    makers = [m for m in cases.HALVES[args.half]
              if not args.cases or m.__name__ in args.cases.split(",")]
    kinds = [k for k in KINDS
             if not args.faults or k.name in args.faults.split(",")]
    with tempfile.TemporaryDirectory(prefix="faults_") as folder, \
            concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        suite = Suite(programs, args.half, folder)
        absent = [m.__name__ for m in makers
                  if suite.case(m, suite.seed(indices[0])) is None]
        if absent:
            print("absent: " + ", ".join(absent), file=sys.stderr)
            makers = [m for m in makers if m.__name__ not in absent]
        if args.clean:
            keys = [(m, suite.seed(i)) for i in range(args.clean)
                    for m in makers
                    if i == 0 or m.__name__ not in cases.RECORDED]
            found = pool.map(lambda key: suite.reference(*key), keys)
            print_clean({(m.__name__, m.__name__ in cases.RECORDED, seed): ref
                         for (m, seed), ref in zip(keys, found)})
            return
        tasks = [(kind, maker, planted, suite.seed(i))
                 for i in indices for kind in kinds
                 for maker, planted in suite.chosen(
                     kind, makers, suite.seed(i), args.per_fault)]
        if args.spread:
            ratios = [r for r in pool.map(lambda t: suite.spread(*t), tasks)
                      if r is not None]
            for what, of in (("error", sorted(r[0] for r in ratios)),
                             ("parameters", sorted(r[1] for r in ratios))):
                print("%s: median %.4g, 95 %% %.4g, largest %.4g of %d" % (
                    what, of[len(of) // 2], of[int(0.95 * (len(of) - 1))],
                    of[-1], len(of)))
            return
        results = []
        try:
            for result in pool.map(lambda t: suite.judge(*t), tasks):
                results.append(result)
            references = {
                (m.__name__, m.__name__ in cases.RECORDED, suite.seed(i)):
                suite.reference(m, suite.seed(i))
                for i in indices for m in makers}
        except KeyboardInterrupt:
            print("interrupted: %d of %d" % (len(results), len(tasks)),
                  file=sys.stderr)
            # A shell and timeout may each send one.
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            pool.shutdown(cancel_futures=True)
            references = {}
        print_table(results)
        print_clean(references)
        for key, ref in references.items():
            if ref.said:
                print("%s, seed %d: %s" % (key[0], key[2], ref.said),
                      file=sys.stderr)
        print("\nprocessor time of the checks: %.0f s, the longest %.1f s" % (
            sum(r.seconds for r in results),
            max((r.seconds for r in results), default=0.0)))
        if args.json:
            Path(args.json).write_text(json.dumps(
                [dataclasses.asdict(r) for r in results], indent=1))


if __name__ == "__main__":
    main()
