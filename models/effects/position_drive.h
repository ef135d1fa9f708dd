#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sysid {

// A drive that is commanded positions, of servos and legged robots: with the
// commanded position u (J.cmd) of the time d before,
//   tau = kp (u - q) - kd qd,
// no more than the URDF's effort limit.
class PositionDrive : public EffectOf<PositionDrive> {
 public:
  static constexpr char kName[] = "position_drive";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kLaw[] = "kp (u(t - d) - q) - kd qd";
  static constexpr char kShowsIn[] =
      "commands that change quickly and a load that makes the joint miss them: "
      "of slow motion any kp follows";

  PositionDrive(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kEffortHook | kDriveHook | kOwnDelayHook, mechanism,
                 joint),
        limit_(mechanism.joints[this->joint()].effort_limit) {
    AddParameter(joint + ".kp", "{effort}/{position}", 10.0, 0.0);
    AddParameter(joint + ".kd", "{effort} s/{position}", 1.0, 0.0);
    AddSearchedParameter(joint + ".drive_delay", "s", 0.0,
                         {0.0, 0.01, 0.02, 0.05, 0.1}, 0.0, 0.5);
    ReadsInput(joint + ".cmd", IsPrismatic() ? "m" : "rad");
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    const T given = p[0] * (joint.inputs[0] - joint.q[0]) - p[1] * joint.qd[0];
    if (limit_ > 0.0 && std::abs(ValueOf(given)) > limit_) {
      tau[0] += T(std::copysign(limit_, ValueOf(given)));
    } else {
      tau[0] += given;
    }
  }

  template <typename T>
  void AddOwnDelay(const T* p, T* delay) const {
    *delay += p[2];
  }

 private:
  double limit_;  // 0: none
};

}  // namespace sysid
