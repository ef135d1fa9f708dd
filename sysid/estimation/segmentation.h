#pragma once

#include <vector>

#include "sysid/estimation/shooting_problem.h"
#include "sysid/estimation/shooting_stage.h"

namespace sysid {

// How runs are cut into segments, and how long those may be.

inline constexpr double kFirstLength = 0.1;  // s, of a first stage
// Longer ones save nothing, and fewer segments fall into wrong minima sooner:
// EMPS in one segment of 24.8 s ends at 90.7 kg, a minimum 4 % above that at
// 96.0 kg which segments of 0.8 s and of 3.2 s find.
inline constexpr double kLongestLength = 3.2;  // s

// Fewest samples of a segment: they must say more than its state is free to do.
int MinSegmentSamples(const ShootingProblem& problem);

// A point cut into segments of about `length` seconds, with states from
// `sample_states` (samples x state_size for each run).
ShootingPoint CutPoint(const ShootingProblem& problem,
                       const Eigen::VectorXd& theta,
                       const std::vector<RowMatrixXd>& sample_states,
                       double length);

// Cuts the point anew, with states from its own trajectories (from the data
// where the dynamics fail).
void Recut(const ShootingProblem& problem, double length, ShootingPoint* point);

bool SameCut(const ShootingPoint& a, const ShootingPoint& b);
double MeanSegment(const ShootingProblem& problem,
                   const ShootingPoint& point);  // s

// The longest length, doubling from kFirstLength up to kLongestLength or the
// whole run, over which a change of the initial position grows less than
// fourfold anywhere: chaos asks for short segments.
double ChooseSegment(const ShootingProblem& problem,
                     const ShootingPoint& point);

// States of independent segments, each a problem of its own: together they
// would share one trust region, and the most crooked of them would hold up all.
// Each of `which` starts from its state in every one of `starts`, which are cut
// alike, and keeps the best; the others stay as in the first. `options` of the
// stage that each is.
ShootingPoint SolveOneByOne(const ShootingProblem& problem,
                            ShootingStage::Options options,
                            const std::vector<ShootingPoint>& starts,
                            const std::vector<SegmentPlace>& which);

// The states alone, theta as the model has it (the problem frees nothing):
// short segments first, then `length`, joined by `defect`.
ShootingPoint StatesOnly(const ShootingProblem& problem, double length,
                         double defect);
// The same of independent segments, from those of a model that is near.
ShootingPoint StatesFrom(const ShootingProblem& problem,
                         const ShootingPoint& start);

}  // namespace sysid
