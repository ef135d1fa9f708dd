#pragma once

#include <cstddef>

// The constants that decide a verdict of the search over sets
// (docs/judgement.md has the symbols).

namespace sysid {

// What matters: a twentieth of the error. An effect that lowers it by less does
// next to nothing, however certain it is.
inline constexpr double kMatters = 0.05;

// z of (J.2): what chance makes of the best of a hundred candidates, about the
// largest of as many standard normal deviates, sqrt(2 ln 100). (Two let a gap
// stand in for a friction that sticks.)
inline constexpr double kDeviations = 3.0;

// (J.3). A stretch that is left out keeps this part of its weight: what it
// alone tells of stays where it is, and nothing is divided by zero.
inline constexpr double kLeftOut = 0.99;
// kappa at least: a linearisation at a model that follows the motion predicts
// another model's errors to about a twentieth of what is left.
inline constexpr double kLeastTrust = 0.05;
// Of a set's scaled normal matrix: below it a hundredth of a column is all that
// the others do not make, and the data cannot tell them apart.
inline constexpr double kLeastPivot = 1e-4;

// The search for sets. So many go on at each size; so many terms are added, one
// at a time; exchanges and removals come after.
inline constexpr int kBeam = 5;
inline constexpr int kDepth = 3;

// The fits at one horizon end after so many, or so many in a row of which none
// became the best.
inline constexpr int kMostFits = 16;
inline constexpr int kMostFailures = 4;
// A refit whose error is above the predicted one by more than this factor says
// the same of predictions of sets that have all that it added.
inline constexpr double kRefuted = 1.25;
// Of two sets with as many parameters one is worth a fit where it should leave
// so much less (ln).
inline constexpr double kLeastGain = 0.01;

// A set that was fitted is fitted again from elsewhere, where it may end in
// another minimum, if it should leave only this part of its error there.
inline constexpr double kMuchLess = 0.8;
// Errors this near (ln) are those of the same force under two names.
inline constexpr double kSameError = 1e-3;

// What may be as good as the answer is fitted: so many sets, as the refits cost
// as much as the search; those predicted within one standard error, which of
// unlike stretches is no more than this (ln), or that explain so much of what
// the answer explains.
inline constexpr size_t kMostRivalsFitted = 3;
inline constexpr double kRivalFarOff = 0.3;
inline constexpr double kRivalExplains = 0.9;

// A model follows the motion where it explains this part of it, by (8.2):
// beyond, errors are as large as they can be, and nothing is linear in them.
inline constexpr double kFollows = 50.0;  // percent

// What can be followed over segments twice as long is fitted there in so many
// iterations: it begins near its minimum. More are chaos.
inline constexpr int kMostIterationsToFollow = 30;

// (7.14): the part of the excess over the noise that an answer must explain of
// what the model as given leaves: half of the error.
inline constexpr double kMost = 0.75;

// rho of (J.4) from which a law stands in for another: of right laws it is
// below 0.02 in simulations and up to about 0.15 on real machines, of others
// mostly 0.2 and more.
inline constexpr double kStandsIn = 0.15;

// A member whose parameters could be none by chance with this probability is
// not determined by the data.
inline constexpr double kByChance = 0.05;

}  // namespace sysid
