#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "models/model.h"
#include "residuals/run.h"

namespace sysid {

// Positions, velocities and accelerations from measured positions: those of a
// quintic fitted to the samples around, weighed by a Gaussian (local polynomial
// regression: Fan and Gijbels 1996). It shifts no phase, and needs no even
// sampling. A spherical joint: of the rotation vectors from the sample nearest
// to the time, whose second derivative at their zero is the angular
// acceleration.

struct MotionSample {
  // Whether there are measurements of all joints around.
  bool known = false;
  Eigen::VectorXd q, qd, qdd;  // nq, nv, nv
  // Variance of qd by what the quintic leaves of the samples, (11.12); 0 of
  // spherical joints.
  Eigen::VectorXd qd_variance;  // nv
};

// Of each of the nv velocities: the joint, "shoulder.x" of a spherical one.
std::vector<std::string> VelocityNames(const Model& model);

// Moving joints whose position is not measured, by name.
std::vector<std::string> UnmeasuredJoints(const Model& model, const Run& run);

// Of a run that measures all joints; `width` is the Gaussian's standard
// deviation, s. Times one after another whose samples lie alike around them, as
// whole samples apart of an even recording, share the matrix of their fit. The
// model and the run must outlive it.
class MotionSmoother {
 public:
  MotionSmoother(const Model& model, const Run& run, double width);
  ~MotionSmoother();
  MotionSample At(double time);  // s

 private:
  class LocalQuintic;
  const Model& model_;
  const Run& run_;
  const double width_;
  std::unique_ptr<LocalQuintic> fit_;  // of the channel before
};

// At one time.
MotionSample SmoothMotion(const Model& model, const Run& run, double time,
                          double width);

// Widths beyond which a Gaussian is nothing.
inline constexpr double kGaussianReach = 2.5;
inline double GaussianWeight(double distance) {
  return std::exp(-0.5 * distance * distance);
}

// The state at a sample of a run: by SmoothMotion, or near the ends, where that
// has nothing to go by, on from the next sample that it has.
Eigen::VectorXd SmoothState(const Model& model, const Run& run, int sample,
                            double width);

}  // namespace sysid
