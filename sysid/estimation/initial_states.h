#pragma once

#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// States of a run from its measurements alone, samples x state_size: positions
// as measured, smoothed by a cubic over about 0.1 s; velocities from the same
// cubic (a spherical joint: of the rotation vectors relative to the middle
// sample). Where a joint is not measured, its position follows from measured
// frames by inverse kinematics at the starting parameters, or else is neutral.
// Gaps are bridged linearly. Internal states are where the sensors of motors
// say they are; the others start as their effects say. The first is as
// Run::start knows it.
RowMatrixXd StatesFromData(const ShootingProblem& problem, int run);
// Of every run, spread over the threads.
std::vector<RowMatrixXd> AllStatesFromData(const ShootingProblem& problem);

}  // namespace sysid
