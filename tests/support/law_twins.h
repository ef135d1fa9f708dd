#pragma once

#include <cmath>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "tests/support/fit_setup.h"

namespace sysid {

// Textbook laws that are in the catalogue, and the same as a user types them.

struct LawTwin {
  std::string robot;
  std::string shipped, typed;  // effects
  struct Parameter {
    std::string shipped, typed;  // names
    double truth, start;
  };
  std::vector<Parameter> parameters;
  std::vector<Value> held = {};  // of the shipped one
};

inline void PrintTo(const LawTwin& twin, std::ostream* out) {
  *out << twin.shipped << " and " << twin.typed;
}

// (The drag of the catalogue is smooth about rest.)
inline std::vector<LawTwin> LawTwins() {
  return {
      {"pendulum2_planar",
       "viscous_damping@joint1",
       "custom@joint1: -d*qd",
       {{"joint1.damping", "joint1.d", 0.1, 0.0}}},
      {"pendulum2_planar",
       "quadratic_drag@joint2",
       "custom@joint2: -c*sqrt(qd^2 + 1e-4)*qd",
       {{"joint2.quadratic_drag", "joint2.c", 0.02, 0.01}}},
      {"cartpole",
       "quadratic_drag@slider",
       "custom@slider: -c*sqrt(qd^2 + 1e-4)*qd",
       {{"slider.quadratic_drag", "slider.c", 0.5, 0.2}}},
      {"pendulum2_planar",
       "cubic_damping@joint1",
       "custom@joint1: -c*qd^3",
       {{"joint1.cubic_damping", "joint1.c", 0.05, 0.0}}},
      {"pendulum2_planar",
       "spring@joint1",
       "custom@joint1: -k*(q - r)",
       {{"joint1.stiffness", "joint1.k", 0.8, 0.5},
        {"joint1.spring_reference", "joint1.r", 0.3, 0.1}}},
      {"pendulum2_planar",
       "effort_bias@joint2",
       "custom@joint2: b",
       {{"joint2.effort_bias", "joint2.b", -0.2, 0.0}}},
      {"pendulum2_planar",
       "cogging@joint1",
       "custom@joint1: a*sin(6*q) + b*cos(6*q)",
       {{"joint1.cogging_sin", "joint1.a", 0.3, 0.0},
        {"joint1.cogging_cos", "joint1.b", -0.2, 0.0}},
       {{"joint1.cogging_order", 6.0}}},
      {"pendulum2_planar",
       "asymmetric_friction@joint1",
       "custom@joint1: -d*qd - a*abs(qd)",
       {{"joint1.damping", "joint1.d", 0.2, 0.1},
        {"joint1.damping_asymmetry", "joint1.a", -0.06, -0.01}}},
      {"pendulum2_planar",
       "thermal_friction@joint1",
       "custom@joint1: -d*qd*exp(-k*(joint1.temperature - 20))",
       {{"joint1.damping", "joint1.d", 0.2, 0.1},
        {"joint1.thermal_rate", "joint1.k", 0.03, 0.01}}},
      {"pendulum2_planar",
       "position_drive@joint1",
       "custom@joint1: kp*(joint1.cmd - q) - kd*qd",
       {{"joint1.kp", "joint1.kp", 40.0, 30.0},
        {"joint1.kd", "joint1.kd", 3.0, 2.0}}},
  };
}

// A command, and a joint that warms up.
inline std::shared_ptr<const Run> InputsOfTwins() {
  const auto inputs = std::make_shared<Run>();
  inputs->inputs = {{"joint1.cmd", true, {}},
                    {"joint1.temperature", false, {}}};
  for (int k = 0; k <= 1000; ++k) {
    const double t = 0.01 * k;
    inputs->t.push_back(t);
    inputs->inputs[0].values.push_back(0.6 * std::sin(2 * t) +
                                       0.3 * std::sin(7 * t));
    inputs->inputs[1].values.push_back(20 + 4 * t);
  }
  return inputs;
}

// The model with one of the two, at the truth.
inline Model TruthOf(const LawTwin& twin, bool typed) {
  Model model = typed ? Shipped(twin.robot, {twin.typed})
                      : Shipped(twin.robot, {twin.shipped}, twin.held);
  std::vector<Value> values;
  for (const LawTwin::Parameter& p : twin.parameters) {
    values.push_back({typed ? p.typed : p.shipped, p.truth});
  }
  Set(values, &model);
  return model;
}

// What both are fitted to: made by the shipped one.
inline Run RunOfTwins(const LawTwin& twin) {
  const Model truth = TruthOf(twin, false);
  SimulationOptions simulation;
  simulation.noise = 1e-3;
  simulation.inputs = InputsOfTwins();
  if (!twin.shipped.starts_with("position_drive")) {
    simulation.excitation = Excitation::kMultisine;
  }
  return Simulate(truth, RandomState(truth, 0.7, 1), simulation);
}

inline ShootingProblem ProblemOf(const LawTwin& twin, bool typed,
                                 const Run& run) {
  const Model model = typed ? Shipped(twin.robot, {twin.typed})
                            : Shipped(twin.robot, {twin.shipped}, twin.held);
  std::vector<Value> initial;
  for (const LawTwin::Parameter& p : twin.parameters) {
    initial.push_back({typed ? p.typed : p.shipped, p.start});
  }
  EstimationOptions options;
  options.noise = 1e-3;
  options.rollout.step = 0.0025;  // the same for both
  return ShootingProblem(model, FreeFrom(model, initial), {run}, options);
}

}  // namespace sysid
