#include "models/effects/effect.h"

#include <cstring>

#include "glog/logging.h"

namespace sysid {
namespace {

std::string Replace(std::string text, const std::string& from,
                    const std::string& to) {
  const size_t at = text.find(from);
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

// Every list with every value appended to it.
std::vector<std::vector<double>> Times(
    const std::vector<std::vector<double>>& lists,
    const std::vector<double>& values) {
  std::vector<std::vector<double>> product;
  for (const std::vector<double>& list : lists) {
    for (const double value : values) {
      product.push_back(list);
      product.back().push_back(value);
    }
  }
  return product;
}

}  // namespace

// A joint and a link may share a name: the kind of the target decides.
Effect::Effect(const std::string& kind, unsigned hooks, TargetKind target_kind,
               const Mechanism& mechanism, const std::string& target)
    : kind_(kind), target_(target), hooks_(hooks) {
  if (target_kind == TargetKind::kJoint) {
    joint_ = mechanism.FindJoint(target);
    if (joint_ < 0 && target.ends_with(kOfMotor)) {
      joint_ = mechanism.FindJoint(
          target.substr(0, target.size() - std::strlen(kOfMotor)));
      on_motor_ = true;
      CHECK(!(hooks & ~(kMeasurementHook | kRatesHook)))
          << kind << " is no sensor's";
    }
  }
  if (target_kind == TargetKind::kJointPair) {
    const size_t comma = target.find(',');
    joint_ = mechanism.FindJoint(target.substr(0, comma));
    second_joint_ = mechanism.FindJoint(target.substr(comma + 1));
    CHECK_GE(second_joint_, 0) << kind << "@" << target;
  }
  if (target_kind == TargetKind::kLink) link_ = mechanism.FindLink(target);
  prismatic_ =
      joint_ >= 0 && mechanism.joints[joint_].type == JointType::kPrismatic;
  CHECK(joint_ >= 0 || !(hooks & (kEffortHook | kJointInertiaHook | kInputHook |
                                  kMeasurementHook | kDriveHook | kLimitHook |
                                  kInputLagHook | kReadsEffort)))
      << kind << " acts on a joint and has none";
  CHECK(joint_ >= 0 || !(hooks & (kStateRateHook | kMoveStateHook)))
      << kind << " has a state and no joint";
  CHECK(!(hooks & kDryFrictionHook) || (hooks & kEffortHook))
      << kind << " needs its law smoothed, too";
}

std::string Effect::UnitOf(const std::string& unit) const {
  return Replace(Replace(unit, "{effort}", prismatic_ ? "N" : "N m"),
                 "{position}", prismatic_ ? "m" : "rad");
}

void Effect::AddState(const std::string& name, const std::string& unit,
                      double typical_scale) {
  states_.push_back({name, UnitOf(unit), typical_scale});
}

void Effect::AddParameter(const std::string& name, const std::string& unit,
                          double typical_scale, double lower, double upper) {
  EffectParameter parameter;
  parameter.name = name;
  parameter.unit = UnitOf(unit);
  parameter.null_value = 0.0;
  parameter.typical_scale = typical_scale;
  parameter.lower = lower;
  parameter.upper = upper;
  parameters_.push_back(parameter);
}

void Effect::AddSearchedParameter(const std::string& name,
                                  const std::string& unit, double start,
                                  const std::vector<double>& grid, double lower,
                                  double upper, bool whole) {
  // One that starts at zero is as large as the first that is tried.
  double scale = start;
  for (size_t i = 0; i < grid.size() && scale == 0.0; ++i) scale = grid[i];
  AddParameter(name, unit, scale, lower, upper);
  parameters_.back().null_value = start;
  parameters_.back().grid = grid;
  parameters_.back().whole = whole;
}

std::vector<std::string> Effect::ParameterNames() const {
  std::vector<std::string> names;
  for (const EffectParameter& parameter : parameters_) {
    names.push_back(parameter.name);
  }
  names.insert(names.end(), adjusts_nominal_.begin(), adjusts_nominal_.end());
  return names;
}

std::vector<ProbeSet> Effect::ProbeSets() const {
  std::vector<std::vector<double>> points{{}};
  for (const EffectParameter& parameter : parameters_) {
    points = Times(points, parameter.grid.empty()
                               ? std::vector<double>{parameter.null_value}
                               : parameter.grid);
  }
  std::vector<ProbeSet> sets;
  for (const std::vector<double>& point : points) {
    ProbeSet probes;
    for (size_t i = 0; i < parameters_.size(); ++i) {
      if (!parameters_[i].grid.empty()) continue;
      probes.push_back({point, static_cast<int>(i), 0.0});
    }
    if (!probes.empty()) sets.push_back(probes);
  }
  return sets;
}

std::vector<double> Effect::FromProbes(
    const ProbeSet& probes, const std::vector<double>& weights) const {
  std::vector<double> values = probes.front().at;
  for (size_t i = 0; i < probes.size(); ++i) {
    values[probes[i].along] += weights[i];
  }
  return values;
}

}  // namespace sysid
