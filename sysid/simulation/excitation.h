#pragma once

#include <random>

#include "models/model.h"
#include "residuals/run.h"
#include "sysid/simulation/driven_motion.h"

namespace sysid {

// Motion that shows what a model does: sums of sines (docs/simulation.md).

// Five sines a joint, their frequencies spread over a band, random phases.
struct MultisineOptions {
  double lowest = 0.1, highest = 2.0;  // Hz, 0 < lowest < highest
  // Rms effort of a joint without limits as a part of the weight's largest
  // moment about it (a slide: of the weight of what it carries).
  double effort_level = 0.3;
  // Excursion of a joint with limits as a part of the room between them.
  double excursion = 1.0;  // in (0, 1]
  // Of a measurement, rad or m: kept free beside the limits.
  double noise = 0.0;
};

// Adds the efforts, whatever the limits, on all joints of one degree of
// freedom.
void AddMultisineEfforts(const Model& model, const MultisineOptions& options,
                         std::mt19937_64* random, Run* run);

// The states of a motion from x0 that stays within the limits of the URDF, at
// the times of the run (evenly spaced), whose efforts are filled in: joints
// with position limits follow a multisine in closed loop, by computed torque;
// the others of one degree of freedom have their open-loop efforts, and balls
// none. Excursions are scaled until position, velocity and effort limits are
// kept. Empty where there are no limits and the motion does not stay finite.
// Throws InputError where a joint starts outside of its limits, or no
// excursion, however small, keeps them.
RowMatrixXd ExciteWithinLimits(const Model& model, const Eigen::VectorXd& x0,
                               const MultisineOptions& options,
                               const MotionOptions& motion,
                               std::mt19937_64* random, Run* run);

}  // namespace sysid
