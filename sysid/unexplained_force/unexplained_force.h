#pragma once

#include <string>
#include <vector>

#include "sysid/linearization/linearized_fit.h"

namespace sysid {

// The generalised force of one degree of freedom over one run that would
// explain what the model misses; piecewise linear between knots.
struct ForceCurve {
  std::string joint;
  std::string component;  // "", or "x", "y", "z": a spherical joint's axes,
                          // those of the child
  std::string unit;       // "N m" or "N"
  std::string trajectory;
  std::vector<double> t, value, std;  // s; std: standard deviation
  // The fitted motion at the same times: of the joint, of a spherical one the
  // tilt of its link's axis from neutral and this component of the angular
  // velocity; and the effort measured there, empty where none was.
  std::vector<double> position, velocity, effort;
};

// The curves of a joint, of all runs, together.
struct JointForce {
  std::string joint, unit;
  double rms = 0.0;  // of the values
  double std = 0.0;  // rms of the standard deviations
  // That there is no force; pays for the joints.
  double p_value = 1.0;
  // Its part of what the forces of all joints do to the errors.
  double share = 0.0;
  bool significant = false;
};

// How much of a joint's force one regressor explains alone.
struct ForceRegression {
  std::string joint;
  // "constant", "position", "sin, cos(position)", "velocity", "sign(velocity)",
  // "|velocity| velocity", "acceleration", "effort", "time".
  std::string regressor;
  // Share of the force's mean square that is not noise, 0 to 1.
  double r2 = 0.0;
  // Of the regressor, SI; the constant beside it where there is one comes last.
  // Three numbers for a constant or a sine of a spherical joint.
  std::vector<double> coefficients;
  // With its sign, for a sentence: "-sign(velocity)".
  std::string label;
};

struct UnexplainedForce {
  std::vector<ForceCurve> curves;
  std::vector<JointForce> joints;
  std::vector<ForceRegression> regression;  // by joint, best first
  // Of the whitened errors that remain with the forces; no less than 1.
  double variance = 1.0;
  double before = 1.0;  // without the forces
};

// Beside forces the free parameters may move: a force that a parameter can
// stand for is none that is missing.
UnexplainedForce EstimateForce(const LinearizedFit& fit);

}  // namespace sysid
