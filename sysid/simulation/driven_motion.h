#pragma once

#include <functional>

#include "models/integrator.h"
#include "models/model.h"
#include "residuals/run.h"

namespace sysid {

// Sets the efforts (nv numbers, zero before) that hold from a sample until the
// next, from the true state at it: a controller, an open loop. Called sample by
// sample, from the first, several times over.
using DriveLaw =
    std::function<void(int sample, double t, const Eigen::VectorXd& x,
                       Eigen::Ref<Eigen::VectorXd> effort)>;

// How a motion is integrated.
struct MotionOptions {
  Integrator integrator = Integrator::kRungeKutta4;
  // Longest step, s; 0: divided until halving it changes no position by more
  // than the tolerance (rad, m) over the whole run.
  double step = 0.0;
  double tolerance = 1e-9;
};

// The states at the times of the run, samples x state_size, from x0 under its
// efforts, or those of a drive, which are written into it. Empty where the
// motion does not stay finite.
RowMatrixXd DrivenMotion(const Model& model, const Eigen::VectorXd& x0,
                         const MotionOptions& options, const DriveLaw& drive,
                         Run* run);

}  // namespace sysid
