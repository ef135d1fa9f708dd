#!/usr/bin/env python3
"""The suite's own code, and a short selection of its faults.

  faults_test.py [--programs build/release/tools [--mujoco_recording FILE]]

Without programs only what needs none is tested.
"""

import argparse
import math
import sys
import tempfile
import unittest
from pathlib import Path

import cases
import data_faults_suite
import outcome as outcomes
import planted as planting
import programs as flags_of
import readings
import resample
import timing
import urdf
import values
from draw import Draw
from perturb import perturbed
from programs import Programs
from table import Table, read_table, write_table

PROGRAMS = None

_URDF = """<robot name="r"><link name="base"/>
<joint name="a" type="continuous"><parent link="base"/><child link="l1"/>
<axis xyz="0 1 0"/></joint>
<link name="l1"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"/></inertial>
</link>
<joint name="b" type="continuous"><origin xyz="0 0 -1"/>
<parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/></joint>
<link name="l2"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"/></inertial>
</link></robot>"""


def _case(runs=1, flags=None):
    """Two hinges that move by sines, with efforts and velocities."""
    t = [0.01 * i for i in range(400)]
    tables = {}
    for i in range(runs):
        table = Table({"t": t})
        for k, joint in enumerate("ab"):
            w = 3.0 + k + 0.3 * i
            table[joint + ".q"] = [0.6 * math.sin(w * v) for v in t]
            table[joint + ".qd"] = [0.6 * w * math.cos(w * v) for v in t]
            table[joint + ".tau"] = [math.cos(2.0 * w * v) for v in t]
        tables["xy"[i] + ".csv"] = table
    return cases.Case("r", "r.urdf", _URDF, "", tables, {}, flags or {})


class Drawing(unittest.TestCase):

    def test_is_the_same_on_every_machine(self):
        # Made once by this class; the Twister of any Python gives them.
        draw = Draw("portable", 1)
        self.assertEqual([draw.index(1000) for _ in range(5)], PORTABLE)

    def test_covers_its_range_evenly_in_the_logarithm(self):
        draw = Draw("even")
        drawn = [draw.log_uniform(2.0, 1000.0) for _ in range(4000)]
        self.assertTrue(all(2.0 <= v <= 1000.0 for v in drawn))
        below = sum(v < math.sqrt(2000.0) for v in drawn) / len(drawn)
        # Four standard errors of a half of 4000.
        self.assertAlmostEqual(below, 0.5, delta=4 * 0.5 / math.sqrt(4000))


class Resampling(unittest.TestCase):

    def test_a_cubic_is_interpolated_exactly_at_uneven_times(self):
        times = [0.0, 0.9, 2.1, 2.9, 4.2, 5.0]
        cube = lambda t: 1.0 - t + 0.5 * t ** 2 + 0.25 * t ** 3
        for t in (0.3, 1.7, 2.5, 4.9):
            self.assertAlmostEqual(
                resample.cubic(times, [cube(v) for v in times], t), cube(t),
                delta=1e-12)

    def test_a_held_signal_changes_at_its_samples_alone(self):
        times, held = [0.0, 1.0, 2.0], [5.0, 6.0, 7.0]
        self.assertEqual([resample.held(times, held, t)
                          for t in (0.0, 0.99, 1.0, 1.5, 2.5)],
                         [5.0, 5.0, 6.0, 6.0, 7.0])

    def test_quaternions_turn_at_a_constant_velocity(self):
        turn = (0.3, -0.2, 0.5)
        a = resample.rotation((0.1, 0.7, -0.4))
        b = resample.multiply(a, resample.rotation(turn))
        # Both signs are the same rotation.
        middle = resample.slerp([0.0, 2.0], [a, tuple(-v for v in b)], 0.5)
        right = resample.multiply(a, resample.rotation(
            tuple(0.25 * v for v in turn)))
        for one, other in zip(middle, right):
            self.assertAlmostEqual(one, other, delta=1e-14)


class Files(unittest.TestCase):

    def test_keep_every_digit_and_missing_cells(self):
        table = Table({"t": [0.0, 0.1], "q": [1 / 3, math.nan]})
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "a.csv"
            write_table(table, path)
            again = read_table(path)
        self.assertEqual(again["q"][0], 1 / 3)
        self.assertTrue(math.isnan(again["q"][1]))

    def test_a_perturbed_recording_differs_by_its_last_bits(self):
        table = _case().runs["x.csv"]
        new = perturbed(table, 1)
        change = max(abs(a - b) for a, b in zip(table["a.q"], new["a.q"]))
        self.assertGreater(change, 0.0)
        self.assertLessEqual(change, 1.01e-13 * planting.span(table["a.q"]))

    def test_a_body_about_its_joint(self):
        links, _ = urdf.parse(_URDF)
        text = urdf.with_link(_URDF, "l1", inertia=urdf.about_joint(
            links["l1"]))
        moments = urdf.parse(text)[0]["l1"].inertia
        # 0.1 + 2 x 0.5^2 across, nothing along.
        for one, other in zip(moments, (0.6, 0.6, 0.01, 0, 0, 0)):
            self.assertAlmostEqual(one, other)
        self.assertEqual(urdf.parse(text)[0]["l2"].inertia,
                         links["l2"].inertia)


class Flags(unittest.TestCase):

    def test_are_read_as_a_shell_reads_them(self):
        self.assertEqual(
            flags_of.parse_flags("--columns 'a.q=(x-90)*0.1,b.q=y' --noise=2"),
            {"columns": "a.q=(x-90)*0.1,b.q=y", "noise": "2"})
        self.assertEqual(flags_of.parse_flags("record it again"), {})

    def test_a_fix_replaces_what_is_about_its_column(self):
        given = {"columns": "t=time,a.q=p1,b.q=p2", "ignore": "a.q@1:2"}
        self.assertEqual(
            flags_of.merged(given, {"columns": "a.q=-p1",
                                    "ignore": "a.q@4:5",
                                    "shift": "b.q=0.01"}),
            {"columns": "t=time,b.q=p2,a.q=-p1",
             "ignore": "a.q@1:2,a.q@4:5", "shift": "b.q=0.01"})
        self.assertEqual(
            flags_of.merged({"columns": "a.q=(x,y)"},
                            {"columns": "y.csv/a.q=z"}),
            {"columns": "a.q=(x,y),y.csv/a.q=z"})


class Planting(unittest.TestCase):

    def test_a_late_column_says_what_was_so_before(self):
        for seed in range(20):
            planted = timing.velocity_late(_case(), Draw("late", seed))
            token, delay = planted.truth["shift"].split("=")
            table = planted.case.runs["x.csv"]
            w = 3.0 if token[0] == "a" else 4.0
            for t, v in zip(table["t"], table[token]):
                # The cubic misses a sine of 4 rad/s by (w h)^4 / 40.
                self.assertAlmostEqual(
                    v, 0.6 * w * math.cos(w * (t - float(delay))), delta=1e-6)

    def test_absolute_angles_are_sums(self):
        case = _case()
        planted = readings.absolute_angle(case, Draw("absolute"))
        before, after = case.runs["x.csv"], planted.case.runs["x.csv"]
        self.assertEqual(after["b.q"], [x + y for x, y in zip(
            before["a.q"], before["b.q"])])
        self.assertEqual(after["b.qd"], [x + y for x, y in zip(
            before["a.qd"], before["b.qd"])])
        self.assertEqual(planted.truth,
                         {"columns": "b.q=b.q-a.q,b.qd=b.qd-a.qd"})

    def test_one_run_of_several_leaves_the_others_alone(self):
        for seed in range(20):
            case = _case(runs=2)
            planted = readings.effort_scale(case, Draw("one", seed))
            for name, table in planted.case.runs.items():
                changed = table.columns != case.runs[name].columns
                self.assertEqual(changed, planted.file in ("", name))

    def test_no_fault_changes_the_case_it_is_planted_in(self):
        for kind in data_faults_suite.KINDS:
            case, same = _case(runs=2), _case(runs=2)
            planted = kind.plant(case, Draw("copy", kind.name))
            for name in case.runs:
                self.assertEqual(case.runs[name].columns,
                                 same.runs[name].columns, kind.name)
            self.assertEqual(case.urdf, same.urdf)
            if planted is not None:
                differs = planted.case.urdf != case.urdf or any(
                    planted.case.runs[name].columns
                    != case.runs[name].columns for name in case.runs)
                self.assertTrue(differs, kind.name)

    def test_sizes_differ_from_seed_to_seed(self):
        sizes = {readings.clock_scale(_case(), Draw("size", seed)).size
                 for seed in range(20)}
        self.assertEqual(len(sizes), 20)


class Hits(unittest.TestCase):

    def _finding(self, fault, subject, file=""):
        return {"fault": fault, "subject": subject, "file": file,
                "remedies": []}

    def test_need_the_right_name_place_and_run(self):
        case = _case(runs=2)
        planted = planting.Planted(
            case, "", [("axis_flipped", frozenset(["a.q"]))], "y.csv")
        for fault, subject, file, hit in (
                ("axis_flipped", "a.q", "y.csv", (True, True)),
                ("axis_flipped", "a", "y.csv", (True, True)),
                ("axis_flipped", "b.q", "y.csv", (True, False)),
                ("axis_flipped", "a.q, b.q", "y.csv", (True, False)),
                ("axis_flipped", "a.q", "x.csv", (True, False)),
                ("axis_flipped", "a.q", "", (True, False)),
                ("effort_flipped", "a.q", "y.csv", (False, False))):
            self.assertEqual(outcomes.is_right(
                self._finding(fault, subject, file), planted), hit)

    def test_a_refused_column_is_named_by_its_place(self):
        planted = planting.Planted(
            _case(), "", [("degrees", frozenset(["a.q"]))])
        for file, located in (("x.csv:1:2", True), ("x.csv:2:3", False),
                              ("x.csv", False)):
            self.assertEqual(outcomes.is_right(
                self._finding("degrees", "", file), planted), (True, located))

    def test_components_are_one_column(self):
        self.assertEqual(outcomes.tokens_of("j.qw, j.qx, k.tauy"),
                         {"j.q", "k.tau"})

    def test_all_others_the_other_way_is_the_same_delay(self):
        case = _case()
        for table in case.runs.values():
            for name in ("a.qd", "b.qd"):
                del table.columns[name]
        for seed in range(30):
            planted = timing.channel_late(case, Draw("other way", seed))
            own, rest = (subject for _, subject in planted.right)
            self.assertEqual(own | rest, {"a.q", "b.q", "a.tau", "b.tau"})
            self.assertFalse(own & rest)

    def test_an_error_is_measured_in_the_clean_noise(self):
        def fit(rms, noise):
            return {"error": {"train": {}, "channels": [
                {"name": "a", "rms": rms, "noise": noise}]}}
        self.assertAlmostEqual(outcomes.error_of(fit(4.0, 8.0), fit(1.0, 2.0)),
                               2.0)

    def test_a_bias_has_the_other_sign_in_a_mirror(self):
        def fit(bias):
            return {"parameters": [{"name": "bias", "value": bias,
                                    "std_error": 0.1}]}
        self.assertAlmostEqual(
            outcomes.largest_change(fit(-2.0), fit(2.0), True), 40.0)
        self.assertAlmostEqual(
            outcomes.largest_change(fit(-2.1), fit(2.0), True, True), 1.0)
        self.assertEqual(outcomes.largest_change(
            fit(2.1), fit(2.0), True, within=0.06), 0.0)

    def test_lines_of_a_urdf_are_pasted(self):
        found = [{"remedies": [
            'in r.urdf, link l1: <mass value="3"/> <inertia ixx="0.2" ixy="0" '
            'ixz="0" iyy="0.3" iyz="0" izz="0.1"/>']}]
        link = urdf.parse(outcomes.paste_lines(found, _URDF))[0]["l1"]
        self.assertEqual((link.mass, link.inertia),
                         (3.0, (0.2, 0.3, 0.1, 0.0, 0.0, 0.0)))

    def test_rates_are_bounded_as_clopper_and_pearson_do(self):
        # 1 - 0.05^(1/n) without an alarm; tabulated with one of 10.
        self.assertAlmostEqual(data_faults_suite.bound_of(0, 150),
                               1 - 0.05 ** (1 / 150), delta=1e-9)
        self.assertAlmostEqual(data_faults_suite.bound_of(1, 10), 0.3942,
                               delta=1e-4)


class WithPrograms(unittest.TestCase):
    """A few faults of the suite, each by its own seed. What is planted is so
    large and plain that no detector may miss it."""

    @classmethod
    def setUpClass(cls):
        if PROGRAMS is None:
            raise unittest.SkipTest("no programs")
        cls._folder = tempfile.TemporaryDirectory(prefix="faults_test_")
        cls.suite = data_faults_suite.Suite(PROGRAMS, "set", cls._folder.name)

    @classmethod
    def tearDownClass(cls):
        if PROGRAMS is not None:
            cls._folder.cleanup()

    def _judge(self, kind, maker, seed=1):
        if self.suite.case(maker, seed) is None:
            self.skipTest("no MuJoCo")
        planted = self.suite.planted(kind, maker, seed)
        return self.suite.judge(kind, maker, planted, seed)

    def test_nothing_is_found_where_nothing_was_planted(self):
        clean = self.suite.reference(cases.pendulum2_planar, 1)
        self.assertEqual(clean.findings, [])
        self.assertIsNotNone(clean.fit, clean.said)

    def test_right_fixes_bring_the_clean_fit(self):
        for kind in (readings.absolute_angle, readings.joints_swapped,
                     readings.milliseconds):
            case = self.suite.case(cases.pendulum2_planar, 1)
            planted = kind(case, Draw("right", kind.__name__))
            clean = self.suite.reference(cases.pendulum2_planar, 1)
            ratio, change = outcomes.spread(
                PROGRAMS, planted, self.suite.scratch("right"), clean.fit)
            self.assertLess(ratio, outcomes.ERROR_FACTOR, kind.__name__)
            self.assertLess(change, outcomes.INTERVAL, kind.__name__)

    def test_plain_faults_are_hit(self):
        by_name = {kind.name: kind for kind in data_faults_suite.KINDS}
        for name in ("milliseconds", "axis_flipped", "joints_swapped",
                     "absolute_angle"):
            with self.subTest(name):
                hit = self._judge(by_name[name], cases.pendulum2_planar)
                self.assertTrue(hit.named, hit)
                self.assertTrue(hit.located, hit)
                self.assertTrue(hit.repaired, hit)

    def test_a_fault_in_a_real_recording_is_hit(self):
        if self.suite.case(cases.emps, 1) is None:
            self.skipTest("no recordings")
        kind = next(k for k in readings.KINDS if k.name == "effort_flipped")
        hit = self._judge(kind, cases.emps)
        self.assertTrue(hit.repaired, hit)

    def test_efforts_of_an_arm_the_other_way_round_are_hit(self):
        # A short recording of many parameters: few equations for a first
        # look, and fits that need their second start.
        kind = next(k for k in readings.KINDS if k.name == "effort_flipped")
        hit = self._judge(kind, cases.arm7, 3)
        self.assertTrue(hit.located, hit)
        self.assertTrue(hit.repaired, hit)

    def test_a_flipped_effort_is_no_gain(self):
        # A gain of -1 does the same: it must not compete as physics.
        kind = next(k for k in readings.KINDS if k.name == "effort_flipped")
        hit = self._judge(kind, cases.pendulum3_planar, 3)
        self.assertTrue(hit.located, hit)

    def test_a_fault_of_one_run_of_several_is_hit_there(self):
        case = self.suite.case(cases.cartpole, 1)
        if case is None:
            self.skipTest("no MuJoCo")
        kind = next(k for k in readings.KINDS if k.name == "axis_flipped")
        planted = next(p for p in (
            kind.plant(case, Draw("one run", i)) for i in range(100))
            if p.file == "b.csv" and p.right[0][1] == {"hinge.q"})
        hit = self.suite.judge(kind, cases.cartpole, planted, 1)
        self.assertTrue(hit.located, hit)
        self.assertTrue(hit.repaired, hit)


PORTABLE = [285, 566, 485, 848, 610]

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs")
    parser.add_argument("--mujoco_recording")
    args, rest = parser.parse_known_args()
    if args.programs:
        PROGRAMS = Programs(args.programs, args.mujoco_recording)
    unittest.main(argv=[sys.argv[0], *rest])
