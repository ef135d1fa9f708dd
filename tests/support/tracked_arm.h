#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "models/hold_joints.h"
#include "sysid/inverse_dynamics/coordinates.h"
#include "sysid/simulation/tracking.h"
#include "tests/support/fit_setup.h"

namespace sysid {

// arm7 under a position controller, and what is asked of the recording: all
// inertial parameters of its moving links, viscous and Coulomb friction and
// the rotor inertia of its axes. Its bodies are those of the URDF with masses,
// centres and moments changed by up to a fifth; a fit starts from the URDF,
// without friction.

struct TrackedArm {
  Model truth, start;
  std::vector<FreeParameter> free;
  Run run;
};

struct TrackedArmOptions {
  int seed = 1;
  int joints = 7;  // from the base; the others are held
  double duration = 20.0;
  double rate = 500.0;  // Hz
  double noise = 1e-4;  // rad
};

inline std::string JointName(int i) { return "joint" + std::to_string(i + 1); }
inline std::string LinkName(int i) { return "link" + std::to_string(i + 1); }

inline Model ArmWithFriction(int joints) {
  const Catalogue catalogue;
  Mechanism mechanism = LoadUrdf(FindModel("arm7"));
  std::map<int, double> held;
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Joint& joint = mechanism.joints[i];
    if (joint.type == JointType::kFixed ||
        joint.name <= JointName(joints - 1)) {
      continue;
    }
    held[static_cast<int>(i)] = 0.5 * (joint.lower + joint.upper);
  }
  mechanism = HoldJoints(mechanism, held);
  Model model = MakeModel(mechanism, catalogue);
  for (int i = 0; i < joints; ++i) {
    for (const char* effect :
         {"viscous_damping", "coulomb_friction", "armature"}) {
      model.AddEffect(
          catalogue.Make(effect + ("@" + JointName(i)), mechanism, "test"));
    }
  }
  return model;
}

// Of a joint, by rank: viscous, Coulomb, rotor.
inline std::vector<Value> DriveValues(int i, double factor) {
  const bool wrist = i >= 4;
  return {{JointName(i) + ".damping", factor * (wrist ? 0.1 : 0.8)},
          {JointName(i) + ".friction", factor * (wrist ? 0.2 : 1.0)},
          {JointName(i) + ".armature", factor * (wrist ? 0.01 : 0.1)}};
}

inline const std::vector<std::string>& TenOfALink() {
  static const auto& names =
      *new std::vector<std::string>{"mass", "com_x", "com_y", "com_z", "ixx",
                                    "iyy",  "izz",   "ixy",   "ixz",   "iyz"};
  return names;
}

// Five sines of equal speed a joint, as docs/simulation.md (1), over as much
// of its limits as its speed allows.
inline Run ArmReference(const Model& model, double duration,
                        std::mt19937* random) {
  constexpr double kPi = std::numbers::pi, kLowest = 0.1, kHighest = 1.0;
  constexpr double kRate = 100.0, kOfRange = 0.45, kOfSpeed = 0.9;
  constexpr int kSines = 5;
  Run run;
  run.name = "reference";
  const int n = static_cast<int>(std::lround(duration * kRate)) + 1;
  for (int k = 0; k < n; ++k) run.t.push_back(k / kRate);
  run.effort = RowMatrixXd::Zero(n, model.nv());
  std::uniform_real_distribution<double> phase(0.0, 2.0 * kPi);
  for (const Body& body : model.bodies()) {
    const Joint& joint = model.mechanism().joints[body.joint];
    Eigen::VectorXd q = Eigen::VectorXd::Zero(n), qd = q;
    for (int i = 0; i < kSines; ++i) {
      const double w = 2.0 * kPi * kLowest *
                       std::pow(kHighest / kLowest, i / (kSines - 1.0));
      const double start = phase(*random);
      for (int k = 0; k < n; ++k) {
        q[k] += std::sin(w * run.t[k] + start) / w;
        qd[k] += std::cos(w * run.t[k] + start);
      }
    }
    const double height = std::min(
        kOfRange * (joint.upper - joint.lower) / q.cwiseAbs().maxCoeff(),
        kOfSpeed * joint.velocity_limit / qd.cwiseAbs().maxCoeff());
    Channel channel;
    channel.kind = ChannelKind::kPosition;
    channel.target = body.joint;
    channel.name = joint.name;
    channel.values = (height * q).array() + 0.5 * (joint.lower + joint.upper);
    run.channels.push_back(channel);
  }
  return run;
}

inline TrackedArm MakeTrackedArm(const TrackedArmOptions& o) {
  const Model urdf = ArmWithFriction(o.joints);
  TrackedArm arm{urdf, urdf, {}, {}};
  std::mt19937 random(o.seed);
  std::uniform_real_distribution<double> change(0.8, 1.2);
  std::vector<Value> truth, start;
  for (int i = 0; i < o.joints; ++i) {
    const double heavier = change(random), wider = change(random);
    std::vector<std::string> names;
    for (const std::string& name : TenOfALink()) {
      names.push_back(LinkName(i) + "." + name);
    }
    for (const Parameter& p : FindParameters(urdf, names, "test")) {
      const double factor = p.kind == ParameterKind::kMass  ? heavier
                            : p.kind == ParameterKind::kCom ? wider
                                                            : heavier * wider;
      truth.push_back({p.name, factor * p.nominal});
      start.push_back({p.name, p.nominal});
    }
  }
  for (int i = 0; i < o.joints; ++i) {
    const double factor = change(random);
    for (const Value& value : DriveValues(i, factor)) truth.push_back(value);
    for (const Value& value : DriveValues(i, 0.0)) start.push_back(value);
  }
  Set(truth, &arm.truth);
  Set(start, &arm.start);
  arm.free = FreeFrom(arm.start, start);
  const JointReference reference(arm.truth,
                                 ArmReference(arm.truth, o.duration, &random));
  SimulationOptions simulation;
  simulation.duration = o.duration;
  simulation.rate = o.rate;
  simulation.noise = o.noise;
  simulation.seed = o.seed;
  std::string gains = "*=5:0.1";
  for (int i = 0; i < std::min(4, o.joints); ++i) {
    gains += "," + JointName(i) + "=400:15";
  }
  std::vector<std::string> notices;
  arm.run = SimulateTracking(
      arm.truth, reference.Start(arm.truth, NearestToNeutral(arm.truth)),
      simulation, reference, ParseGains(gains, arm.truth, "test"), "",
      &notices);
  return arm;
}

// What a combination of coordinates is at the truth.
inline double CombinationAt(const BaseParameter& base,
                            const EquationCoordinates& coordinates,
                            const Model& truth) {
  Eigen::VectorXd xi(coordinates.size());
  coordinates.Read<double>(truth.nominal(), xi.data());
  double value = 0.0;
  for (const BaseParameter::Term& term : base.terms) {
    for (int i = 0; i < coordinates.size(); ++i) {
      if (coordinates.Name(i) == term.name) value += term.factor * xi[i];
    }
  }
  return value;
}

}  // namespace sysid
