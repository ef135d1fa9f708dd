#include "models/effects/effect.h"

#include "glog/logging.h"

namespace sysid {
namespace {

std::string Replace(std::string text, const std::string& from,
                    const std::string& to) {
  const size_t at = text.find(from);
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

}  // namespace

// A joint and a link may share a name: the kind of the target decides.
Effect::Effect(const std::string& kind, unsigned hooks, TargetKind target_kind,
               const Mechanism& mechanism, const std::string& target)
    : kind_(kind), target_(target), hooks_(hooks) {
  if (target_kind == TargetKind::kJoint) joint_ = mechanism.FindJoint(target);
  if (target_kind == TargetKind::kLink) link_ = mechanism.FindLink(target);
  prismatic_ =
      joint_ >= 0 && mechanism.joints[joint_].type == JointType::kPrismatic;
}

void Effect::AddParameter(const std::string& name, const std::string& unit,
                          double typical_scale, double lower, double upper) {
  EffectParameter parameter;
  parameter.name = name;
  parameter.unit = Replace(Replace(unit, "{effort}", prismatic_ ? "N" : "N m"),
                           "{position}", prismatic_ ? "m" : "rad");
  parameter.null_value = 0.0;
  parameter.typical_scale = typical_scale;
  parameter.lower = lower;
  parameter.upper = upper;
  parameters_.push_back(parameter);
}

}  // namespace sysid
