#pragma once

#include <cstddef>

// Every constant of docs/judgement.md, which has the symbols.

namespace sysid {

// ---- What decides a verdict ----

// The comparison (J.2). What matters is a twentieth of the error: an effect
// that lowers it by less does next to nothing, however certain it is.
inline constexpr double kMatters = 0.05;
// z: what chance makes of the best of a hundred candidates, about the largest
// of as many standard normal deviates, sqrt(2 ln 100). (Two let a gap stand in
// for a friction that sticks.)
inline constexpr double kDeviations = 3.0;

// The linearisation (J.3). A stretch that is left out keeps this part of its
// weight: what it alone tells of stays where it is, and nothing is divided by
// zero.
inline constexpr double kLeftOut = 0.99;
// kappa at least: a linearisation at a model that follows the motion predicts
// another model's errors to about a twentieth of what is left.
inline constexpr double kLeastTrust = 0.05;
// Of a scaled normal matrix: below it a hundredth of a column is all that the
// others do not make. The data cannot tell them apart: one set with both is no
// answer, and two sets with one each are the same force.
inline constexpr double kLeastPivot = 1e-4;

// Proposals. Of two sets with as many parameters one is worth a fit where it
// should leave so much less (ln).
inline constexpr double kLeastGain = 0.01;
// A refit whose error is above the predicted one by more than this factor says
// the same of predictions of sets that have all that it added.
inline constexpr double kRefuted = 1.25;
// A set that was fitted is fitted again from elsewhere, where it may end in
// another minimum, if it should leave only this part of its error there.
inline constexpr double kMuchLess = 0.8;
// Errors this near (ln) are those of the same force under two names.
inline constexpr double kSameError = 1e-3;
// What may be as good as the answer explains so much of what that explains.
inline constexpr double kRivalExplains = 0.9;

// Horizons. A model follows the motion where it explains this part of it, by
// (8.2): beyond, errors are as large as they can be, and nothing is linear in
// them.
inline constexpr double kFollows = 50.0;  // percent
// Models are judged over so many segments at least: three to fit where one is
// left out, so that there is a standard error.
inline constexpr double kFewestSegments = 4.0;
// So many effects a search by segments adds at most; more are a regression's on
// the equations of motion.
inline constexpr int kMostEffectsBySegments = 8;

// Answers. A member whose parameters could be none by chance with this
// probability is not determined by the data.
inline constexpr double kByChance = 0.05;
// (7.14): the part of the excess over the noise that an answer must explain of
// what the model as given leaves: half of the error.
inline constexpr double kMost = 0.75;
// rho of (J.4) from which a law stands in for another: of right laws it is
// below 0.02 in simulations and up to about 0.15 on real machines, of others
// mostly 0.2 and more.
inline constexpr double kStandsIn = 0.15;

// ---- How much is tried: more costs time, and finds what less has missed ----

// Sets that go on at each size; terms that are added, one at a time.
inline constexpr int kBeam = 5;
inline constexpr int kDepth = 3;
// Fits at one horizon; of formulas, of which the first are the best and steep
// ones are slow; and in a row of which none became the best.
inline constexpr int kMostFits = 16;
inline constexpr int kMostFitsOfFormulas = 6;
inline constexpr int kMostFailures = 4;
// What can be followed over segments twice as long is fitted there in so many
// iterations: it begins near its minimum. More are chaos.
inline constexpr int kMostIterationsToFollow = 30;
// Sets that may be as good as the answer, of which each is fitted; and names of
// the same force.
inline constexpr size_t kMostRivalsFitted = 3;

}  // namespace sysid
