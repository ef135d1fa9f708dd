#pragma once

#include <limits>
#include <vector>

#include "sysid/estimation/shooting_problem.h"
#include "sysid/estimation/shooting_segment.h"

namespace sysid {

// How runs are cut into segments, and how long those may be.

inline constexpr double kFirstLength = 0.1;  // s, of a first stage
// Longer ones save nothing, and fewer segments fall into wrong minima sooner:
// EMPS in one segment of 24.8 s ends at 90.7 kg, a minimum 4 % above that at
// 96.0 kg which segments of 0.8 s and of 3.2 s find.
inline constexpr double kLongestLength = 3.2;  // s

// Fewest samples of a segment: they must say more than its state is free to do.
int MinSegmentSamples(const ShootingProblem& problem);

// A start cut into segments of about `length` seconds, with states from
// `sample_states` (samples x state_size for each run), integrated as the
// problem's options say.
Solution CutPoint(const ShootingProblem& problem, const Eigen::VectorXd& theta,
                  const std::vector<RowMatrixXd>& sample_states, double length);

// The solution cut anew, with states from its own trajectories (from the data
// where the dynamics fail).
Solution Recut(const ShootingProblem& problem, const Solution& solution,
               double length);

// What a fit starts from: short segments from the states of the data; a step a
// sample where the options leave it open.
Solution ShortSegments(const ShootingProblem& problem);

// The same cut with the states that the data gives.
Solution WithStatesFromData(const ShootingProblem& problem, Solution solution);

bool SameCut(const Solution& a, const Solution& b);
double MeanSegment(const ShootingProblem& problem,
                   const Solution& point);  // s

// kLongestLength or the longest run.
double LongestSegment(const ShootingProblem& problem);

// How far neighbours may drift apart over a segment: fourfold at its end,
// within which models are linear enough to be judged by independent segments;
// or linearly in time, as those of any regular motion do (of a wide swing the
// period depends on the width) and those of chaos do not, which can be joined.
enum class Drift { kLittle, kLinear };
// The longest length, doubling from kFirstLength up to LongestSegment(), over
// which a change of the initial position grows no more than that anywhere.
// `segments`, those of the point, may know the derivatives.
double ChooseSegment(const ShootingProblem& problem, const Solution& point,
                     Drift allowed, ShootingSegments* segments = nullptr);
// Whether that is, linearly, as long as may be.
bool IsRegular(const ShootingProblem& problem, const Solution& point);

// The best states for the parameters as they are (theta stays), by one stage of
// the same cut.
struct StateOptions {
  double defect = std::numeric_limits<double>::infinity();  // not joined
  double twist_hold = 1.0;                                  // of StateBelief
  int max_iterations = 100;
  double tolerance = 1e-6;  // of the cost
  double news = 1e-6;       // ShootingStage::Options::news
};
Solution SolveStates(const ShootingProblem& problem, Solution solution,
                     const StateOptions& options);
// The same of segments that are not joined, each by itself: where there is no
// theta, one that is hard to reach the data with does not hold up the others.
Solution SolveSegments(const ShootingProblem& problem, const Solution& solution,
                       const StateOptions& options);

// Of independent segments, each a problem of its own: together they would share
// one trust region, and the most crooked of them would hold up all. Each of
// `which` starts from its state in every one of `starts`, which are cut alike,
// and keeps the best; the others stay as in the first.
Solution SolveOneByOne(const ShootingProblem& problem,
                       const StateOptions& options,
                       const std::vector<Solution>& starts,
                       const std::vector<SegmentPlace>& which);

// The states of a solution of the model `from` as those of `to`, AdoptState.
Solution AdoptStates(const Model& from, Solution solution, const Model& to);

// States of a model that has none yet: from the data, by short segments first,
// then `length`, joined by `defect` (infinity: independent).
Solution StatesFromScratch(const ShootingProblem& problem, double length,
                           double defect);

}  // namespace sysid
