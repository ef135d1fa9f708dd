#pragma once

#include <vector>

#include "ceres/ceres.h"
#include "sysid/estimation/processes.h"

namespace sysid {

// ceres::Solve where several processes share out the runs (SharedBlocks): each
// calls it with its own part of the problem. It is Ceres' Levenberg-Marquardt
// with its line search within bounds (Conn, Gould and Toint 2000; Nocedal and
// Wright 2006, 3.1), decision by decision: options, callbacks and summary mean
// the same, and so many steps lead to the same minimum. `theta` is the block
// that all share.
void SolveOverProcesses(const Processes& all,
                        const ceres::Solver::Options& options, double* theta,
                        ceres::Problem* problem,
                        ceres::EvaluationCallback* moved,
                        ceres::Solver::Summary* summary);

// The gradient of the whole cost by theta. False where it cannot be evaluated.
bool GradientOverProcesses(const Processes& all, int threads, double* theta,
                           ceres::Problem* problem,
                           ceres::EvaluationCallback* moved,
                           std::vector<double>* gradient);

}  // namespace sysid
