#pragma once

#include <string>
#include <vector>

#include "sysid/estimation/fit.h"
#include "sysid/inverse_dynamics/equation_look.h"
#include "sysid/linearization/residual_tests.h"
#include "sysid/unexplained_force/unexplained_force.h"

namespace sysid {

// Where a fitted model fails: how far its errors are above the noise, in time,
// in the motion and ahead; whether they are white; and the force that would
// explain them (docs/theory.md section 7).

// Normalised error of a joint's own channels where its motion lies in a range.
struct MotionBin {
  std::string joint;
  // "position" or "velocity"; of a spherical joint "tilt" (of the link's axis
  // from neutral) or "speed".
  std::string over;
  std::string unit;
  double from = 0.0, to = 0.0;
  int samples = 0;
  double normalized_rms = 0.0;
};

struct Where {
  // Of the training runs, all normalised: 1 is the noise floor.
  std::vector<ChannelError> channels;
  std::vector<SegmentError> segments;
  std::vector<MotionBin> bins;        // by joint, then position before velocity
  std::vector<HorizonError> horizon;  // SI
  std::vector<Whiteness> whiteness;   // per channel
  std::vector<InputCorrelation> inputs;  // per channel and measured effort
  std::vector<ForceCurve> force;         // per joint, component and run
  std::vector<JointForce> joints;        // what the curves of a joint say
  // Of the joints whose force is no chance: by joint, best first.
  std::vector<ForceRegression> regression;
  // LookByEquations; above a half.
  std::vector<FollowedMotion> followed;
  std::vector<RejectedEffort> rejected_efforts;
};

// Bins and tests stay empty where the dynamics fail at the fit. The force is
// sought in segments short enough for it to explain the errors; where the fit
// is not to be trusted, from where its parameters started.
Where FindWhere(const ShootingProblem& problem, const Fit& fit);

}  // namespace sysid
