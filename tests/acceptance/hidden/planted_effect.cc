#include "tests/acceptance/hidden/planted_effect.h"

#include <map>

#include "glog/logging.h"
#include "models/parameters.h"

namespace sysid {
namespace {

double Nominal(const Model& model, const std::string& name) {
  return FindParameters(model, {name}, "test").front().nominal;
}

}  // namespace

std::string PlantedEffect::kind() const {
  return name.substr(0, name.find('@'));
}

std::string PlantedEffect::target() const {
  return name.substr(name.find('@') + 1);
}

double PlantedEffect::Get(const std::string& ending) const {
  for (const auto& [parameter, value] : values) {
    if (parameter == ending || parameter.ends_with("." + ending)) return value;
  }
  LOG(FATAL) << name << " has no " << ending;
}

PlantedEffect PlantEffect(const Model& truth, const std::string& name,
                          double magnitude) {
  PlantedEffect effect{name, {}};
  const std::string kind = effect.kind(), target = effect.target();
  const int joint = truth.mechanism().FindJoint(target);
  const bool slides = joint >= 0 && truth.mechanism().joints[joint].type ==
                                        JointType::kPrismatic;
  const auto put = [&](const std::string& parameter, double value) {
    effect.values.emplace_back(parameter, value);
  };
  const auto change = [&](const std::string& parameter, double by) {
    put(parameter, Nominal(truth, parameter) + by);
  };
  if (kind == "stribeck_friction") {
    put(target + ".friction", magnitude);
    put(target + ".static_friction", 2.5 * magnitude);
    put(target + ".stribeck_velocity", slides ? 0.04 : 0.4);
  } else if (kind == "spring") {
    put(target + ".stiffness", magnitude);
    const bool ball =
        truth.mechanism().joints[joint].type == JointType::kSpherical;
    if (!ball) put(target + ".spring_reference", slides ? 0.1 : 0.35);
  } else if (kind == "cogging") {
    put(target + ".cogging_sin", magnitude);
    put(target + ".cogging_cos", 0.6 * magnitude);
    put(target + ".cogging_order", 6.0);
  } else if (kind == "asymmetric_friction") {
    put(target + ".friction", magnitude);
    put(target + ".damping", 0.5 * magnitude);
    put(target + ".friction_asymmetry", 0.4 * magnitude);
    put(target + ".damping_asymmetry", -0.15 * magnitude);
  } else if (kind == "effort_limit") {
    put(target + ".effort_limit", 1.0 / magnitude);
    put(target + ".inverse_no_load_speed", slides ? 0.05 : 0.1);
  } else if (kind == "transmission_error") {
    put(target + ".transmission_sin", magnitude);
    put(target + ".transmission_cos", 0.6 * magnitude);
    put(target + ".transmission_order", 5.0);
  } else if (kind == "gear_coupling") {
    const std::string second = target.substr(target.find(',') + 1);
    put(second + ".coupling_friction", magnitude);
    put(second + ".coupling_damping", 0.5 * magnitude);
    put(second + ".coupling_sign", -1.0);
  } else if (kind == "presliding_friction") {
    put(target + ".presliding_friction", magnitude);
    put(target + ".presliding_length", slides ? 0.005 : 0.05);
  } else if (kind == "joint_elasticity") {
    put(target + ".drive_stiffness", 1.0 / magnitude);
    put(target + ".drive_damping", 0.1);
    put(target + ".motor_inertia", 0.005);
  } else if (kind == "backlash") {
    put(target + ".backlash", magnitude);
    put(target + ".drive_stiffness", 100.0);
    put(target + ".drive_damping", 0.2);
    put(target + ".motor_inertia", 0.005);
  } else if (kind == "gravity_tilt") {
    put("gravity_tilt_x", 0.4 * magnitude);
    put("gravity_tilt_y", magnitude);
  } else if (kind == "effort_delay") {
    put("effort_delay", magnitude);
  } else if (kind == "mass") {
    change(target + ".mass", magnitude * Nominal(truth, target + ".mass"));
  } else if (kind == "com") {
    change(target + ".com_x", magnitude);
    change(target + ".com_y", 0.5 * magnitude);
  } else if (kind == "inertia") {
    for (const char* entry : {".ixx", ".iyy", ".izz"}) {
      change(target + entry, magnitude);
    }
  } else {
    // Those of one parameter.
    const auto made = Catalogue().Make(name, truth.mechanism(), "test");
    CHECK_EQ(made->parameters().size(), 1u) << name;
    put(made->parameters().front().name, magnitude);
  }
  return effect;
}

MagnitudeRange RangeOf(const std::string& kind) {
  static const std::map<std::string, MagnitudeRange> ranges = {
      {"viscous_damping", {0.02, 5.0}},
      {"coulomb_friction", {0.02, 20.0}},
      {"stribeck_friction", {0.02, 5.0}},
      {"quadratic_drag", {0.02, 5.0}},
      {"spring", {0.2, 20.0}},
      {"armature", {0.01, 1.0}},
      {"effort_bias", {0.05, 10.0}},
      {"effort_gain", {0.05, 0.5}},
      {"effort_delay", {0.01, 0.06}},
      {"cogging", {0.05, 5.0}},
      {"gravity_tilt", {0.01, 0.3}},
      {"sensor_offset", {0.02, 0.3}},
      {"aerodynamic_drag", {0.02, 5.0}},
      {"mass", {0.1, 1.0}},
      {"com", {0.01, 0.08}},
      {"inertia", {0.01, 0.5}},
      {"asymmetric_friction", {0.02, 5.0}},
      {"cubic_damping", {0.01, 5.0}},
      {"load_friction", {0.05, 0.5}},
      {"actuator_lag", {0.01, 0.3}},
      {"effort_limit", {1.0, 10.0}},
      {"transmission_error", {0.005, 0.1}},
      {"sensor_gain", {0.02, 0.3}},
      {"sensor_delay", {0.01, 0.1}},
      {"gear_coupling", {0.02, 5.0}},
      {"presliding_friction", {0.02, 5.0}},
      {"joint_elasticity", {0.005, 0.1}},
      {"backlash", {0.01, 0.2}},
  };
  const auto found = ranges.find(kind);
  CHECK(found != ranges.end()) << kind;
  return found->second;
}

Model WithEffects(const Model& truth,
                  const std::vector<PlantedEffect>& planted) {
  const Catalogue catalogue;
  Model model = truth;
  std::vector<std::string> names;
  std::vector<double> values;
  for (const PlantedEffect& effect : planted) {
    const auto made = catalogue.Make(effect.name, model.mechanism(), "test");
    if (!made->parameters().empty()) model.AddEffect(made);
    for (const auto& [name, value] : effect.values) {
      names.push_back(name);
      values.push_back(value);
    }
  }
  SetParameters(FindParameters(model, names, "test"), values, &model);
  return model;
}

}  // namespace sysid
