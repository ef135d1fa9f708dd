#include "sysid/io/units.h"

#include <cmath>
#include <string_view>

#include "models/printable.h"

namespace sysid {
namespace {

using Of = Unit::Of;

constexpr double kDegree = M_PI / 180.0;

struct NamedUnit {
  std::string_view name;
  Of of;
  double factor;
};

constexpr NamedUnit kUnits[] = {
    {"", Of::kNone, 1.0},
    {"-", Of::kNone, 1.0},
    {"1", Of::kNone, 1.0},
    {"%", Of::kNone, 1.0},
    {"s", Of::kTime, 1.0},
    {"sec", Of::kTime, 1.0},
    {"ms", Of::kTime, 1e-3},
    {"us", Of::kTime, 1e-6},
    {"\u00b5s", Of::kTime, 1e-6},
    {"ns", Of::kTime, 1e-9},
    {"min", Of::kTime, 60.0},
    {"rad", Of::kAngle, 1.0},
    {"mrad", Of::kAngle, 1e-3},
    {"deg", Of::kAngle, kDegree},
    {"degree", Of::kAngle, kDegree},
    {"degrees", Of::kAngle, kDegree},
    {"\u00b0", Of::kAngle, kDegree},
    {"rev", Of::kAngle, 2.0 * M_PI},
    {"turns", Of::kAngle, 2.0 * M_PI},
    {"m", Of::kLength, 1.0},
    {"cm", Of::kLength, 1e-2},
    {"mm", Of::kLength, 1e-3},
    {"um", Of::kLength, 1e-6},
    {"\u00b5m", Of::kLength, 1e-6},
    {"rad/s", Of::kAngularVelocity, 1.0},
    {"deg/s", Of::kAngularVelocity, kDegree},
    {"\u00b0/s", Of::kAngularVelocity, kDegree},
    {"rpm", Of::kAngularVelocity, 2.0 * M_PI / 60.0},
    {"1/min", Of::kAngularVelocity, 2.0 * M_PI / 60.0},
    {"U/min", Of::kAngularVelocity, 2.0 * M_PI / 60.0},
    {"m/s", Of::kVelocity, 1.0},
    {"mm/s", Of::kVelocity, 1e-3},
    {"cm/s", Of::kVelocity, 1e-2},
    {"Nm", Of::kTorque, 1.0},
    {"N m", Of::kTorque, 1.0},
    {"N*m", Of::kTorque, 1.0},
    {"N.m", Of::kTorque, 1.0},
    {"N\u00b7m", Of::kTorque, 1.0},
    {"mNm", Of::kTorque, 1e-3},
    {"Ncm", Of::kTorque, 1e-2},
    {"N", Of::kForce, 1.0},
    {"mN", Of::kForce, 1e-3},
    {"kN", Of::kForce, 1e3},
    {"A", Of::kOther, 1.0},
    {"mA", Of::kOther, 1.0},
    {"V", Of::kOther, 1.0},
    {"W", Of::kOther, 1.0},
    {"Hz", Of::kOther, 1.0},
    {"K", Of::kOther, 1.0},
    {"\u00b0C", Of::kOther, 1.0},
    {"degC", Of::kOther, 1.0},
    {"m/s^2", Of::kOther, 1.0},
    {"m/s\u00b2", Of::kOther, 1.0},
    {"rad/s^2", Of::kOther, 1.0},
    {"rad/s\u00b2", Of::kOther, 1.0},
};

std::string_view WithoutBrackets(std::string_view text) {
  text = Trim(text);
  for (const std::string_view pair : {"[]", "()", "{}", "<>"}) {
    if (text.size() > 1 && text.front() == pair[0] && text.back() == pair[1]) {
      return Trim(text.substr(1, text.size() - 2));
    }
  }
  return text;
}

}  // namespace

std::optional<Unit> ParseUnit(const std::string& text) {
  const std::string_view name = WithoutBrackets(text);
  for (const NamedUnit& unit : kUnits) {
    if (name == unit.name) return Unit{unit.of, unit.factor};
  }
  return std::nullopt;
}

Unit::Of QuantityOf(const std::string& column, const Mechanism& mechanism) {
  if (column == "t") return Of::kTime;
  const size_t dot = column.rfind('.');
  if (dot == std::string::npos) return Of::kNone;
  const std::string suffix = column.substr(dot + 1);
  const int j = mechanism.FindJoint(column.substr(0, dot));
  if (j < 0) {
    const bool place = suffix == "px" || suffix == "py" || suffix == "pz";
    return place ? Of::kLength : Of::kNone;
  }
  const Joint& joint = mechanism.joints[j];
  const bool slides =
      (joint.held ? joint.held->type : joint.type) == JointType::kPrismatic;
  if (suffix == "q" || suffix == "cmd" || suffix == "motor_q") {
    return slides ? Of::kLength : Of::kAngle;
  }
  if (suffix == "qd") return slides ? Of::kVelocity : Of::kAngularVelocity;
  if (suffix == "tau") return slides ? Of::kForce : Of::kTorque;
  if (suffix == "wx" || suffix == "wy" || suffix == "wz") {
    return Of::kAngularVelocity;
  }
  return suffix.starts_with("tau") ? Of::kTorque : Of::kNone;
}

}  // namespace sysid
