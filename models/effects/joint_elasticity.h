#pragma once

#include <string>

#include "models/effects/elastic_drive.h"

namespace sysid {

// A drive behind a spring and a damper: a strain-wave gear, a belt, a cable.
// (elastic_drive.h with g(x) = x.)
class JointElasticity : public ElasticDrive<JointElasticity> {
 public:
  static constexpr char kName[] = "joint_elasticity";
  static constexpr char kLaw[] =
      "k (theta - q) + d (theta' - qd) in place of the drive's effort u, "
      "I theta'' = u less that";
  static constexpr char kShowsIn[] =
      "efforts near the frequency at which the drive swings against the link";

  JointElasticity(const Mechanism& mechanism, const std::string& joint)
      : ElasticDrive(kName, mechanism, joint) {}

  template <typename T>
  void Spring(const JointState<T>& joint, const T*, T* g, T* slope) const {
    *g = joint.z[0];
    *slope = T(1.0);
  }
  template <typename T>
  T Slack(const T*) const {
    return T(0.0);
  }
};

}  // namespace sysid
