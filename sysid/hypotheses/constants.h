#pragma once

// Every constant of the data hypotheses, with its reason; docs/checks.md has
// the same table. Bounds and starts of one hypothesis stand with its family.

namespace sysid::hypotheses {

// Excerpt: so many samples know a handful of parameters to some per cent, and
// thirty held-out windows are enough for a paired test.
inline constexpr int kSamples = 4000;
// Of fewer nothing is told: five windows of 60.
inline constexpr int kLeastSamples = 300;
// Fits that a budget must allow: the models that compete take about three, and
// eight or nine hypotheses one each.
inline constexpr double kParts = 12.0;
// A first look compares errors that differ by a factor: two fifths do.
inline constexpr int kLookSamples = 800;

// Segments, in radians of the motion: half a period shows stiffness, damping
// and gravity, and no chaos grows in it.
inline constexpr double kSegmentRadians = 3.0;
// The second start begins over so much: a state of the data that is wrong there
// has not yet led a segment into another minimum.
inline constexpr double kFirstRadians = 1.0;
inline constexpr double kShortest = 0.15;  // s; shorter ones show noise only
inline constexpr int kFewestSamples = 12;  // of a segment: its state takes two

// Iterations of a coarse fit: errors settle to a few per cent, and what is
// compared differs by more. The augmented model has more to find.
inline constexpr int kIterations = 15;
inline constexpr int kLookIterations = 8;
inline constexpr int kAugmentedIterations = 30;
inline constexpr double kTolerance = 1e-4;  // of the cost; so too
// Gauss-Newton of a scalar; it ends where a step is a third of its error.
inline constexpr int kSteps = 8;

// A test of about 40 hypotheses at 5 %, one-sided: Phi^-1(1 - 0.05 / 40).
inline constexpr double kSignificance = 3.0;
inline constexpr double kInterval = 1.96;  // a 95 % interval
inline constexpr double kTie = 1.0;        // standard errors: undecided
// What lowers the error by less than its own estimate is good for (15
// iterations) is not worth a word.
inline constexpr double kWorth = 1.1;
// Fewest held-out windows: of fewer the paired standard error is no estimate.
inline constexpr int kFewestWindows = 3;
// What leaves more than this part of the motion, beside the straight line that
// any state goes on along, is no explanation of it: R^2 < 0.9.
inline constexpr double kUnexplained = 0.316;

// rms errors beyond so many times the motion are cut: where a model cannot
// follow a window at all it misses all of its motion, and how much more it
// misses says nothing.
inline constexpr double kHopeless = 3.0;
// An angle with more noise, rad, is no smooth motion as it was read: encoders
// have a hundredth of it.
inline constexpr double kRough = 0.2;

// Of the median motion: a window with so much counts half, as no less passes
// for motion in the excerpt.
inline constexpr double kRest = 0.2;

// Runs that are asked alone, those that the model misses most.
inline constexpr int kMostRuns = 4;
// Refitted at most: of more, none of the planted cases was the one.
inline constexpr int kRefits = 24;
inline constexpr int kAugmentedRefits = 4;  // with the augmented model
inline constexpr int kEffects = 2;          // of the screening
// A first look that promises less than this is not refitted.
inline constexpr double kPromise = 0.98;
// The promise of what no first look can tell: below kPromise, so that it is
// refitted, after all that promises more.
inline constexpr double kUntold = 0.97;

// The budget after a fit, in parts of its counted work. A quarter of its
// processor time is allowed; a unit of work here takes about twice as long as
// one of the fit (windows are cut, changed and projected), and as much again is
// margin: double_pendulum_dfki took 0.39 of the fit's time with 0.2.
inline constexpr double kBudget = 0.08;

// Work of a derivative column beside a rollout without any (measured: a
// linearisation by 10 columns takes 2.6 times as long).
inline constexpr double kColumnWork = 0.16;
// Work of one Jet8 inverse dynamics beside a step of RK4 (four forward
// dynamics on doubles).
inline constexpr double kJetWork = 1.5;

// Equations of motion: Gaussian widths of the fit of the motion and of the
// average, s or samples, whichever is wider. Derivatives of encoders of
// 1e-3 rad need 10 ms; stick-slip is faster than 30 ms.
inline constexpr double kMotionWidth = 0.010, kMotionSamples = 2.0;
inline constexpr double kAverageWidth = 0.030, kAverageSamples = 3.0;

}  // namespace sysid::hypotheses
