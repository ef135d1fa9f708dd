#pragma once

#include <string>

#include "models/mechanism.h"

namespace sysid {

// The inertia about the centre of mass of a body whose inertia is meant about
// its joint, by the parallel axes: I - m (r^2 E - r r^T), r the centre of mass.
Eigen::Matrix3d AboutCentre(const Inertial<double>& body);

// Whether a body's inertia looks like one about the joint: what AboutCentre
// leaves is still possible (principal moments that no body contradicts), and
// m r^2 is at least `share` of the largest moment. About the centre of
// mass that says the body reaches as far behind its joint as before it: its
// radius of gyration k exceeds r. A rod has k^2 = r^2 / 3; about its joint its
// m r^2 is a share of 3/4. A compact body with its motor at the joint has 0.65
// (the shipped arm7): above kPlain the numbers alone are a hint, above
// kPossible it is worth asking the motion.
inline constexpr double kPlain = 0.69, kPossible = 0.4;
bool CouldBeAboutJoint(const Inertial<double>& body, double share);

// What a URDF says of a body, as a fix: "in arm.urdf, link link1: <mass .../>
// <inertia .../>".
std::string InertialLine(const Inertial<double>& body, const std::string& link,
                         const std::string& file);

}  // namespace sysid
