#pragma once

#include <optional>
#include <string>

#include "models/mechanism.h"

namespace sysid {

// A unit as tables write it: "[°]", "mm", "(Nm)", "rad/s".
struct Unit {
  enum class Of {
    kNone,  // "-", "%"
    kTime,
    kAngle,
    kLength,
    kAngularVelocity,
    kVelocity,
    kTorque,
    kForce,
    kOther  // known, and none of ours: "A", "V"
  };
  Of of = Of::kNone;
  double factor = 1.0;  // to SI
};

// The unit, in brackets or not; nothing for a word that is none.
std::optional<Unit> ParseUnit(const std::string& text);

// What one of our columns of a run is in: "t" is a time, "joint1.q" of a hinge
// an angle; kNone where it is not known here.
Unit::Of QuantityOf(const std::string& column, const Mechanism& mechanism);

}  // namespace sysid
