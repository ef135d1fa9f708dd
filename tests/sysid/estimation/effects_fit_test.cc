// Every effect of the catalogue, planted by the simulator and found again by a
// fit that starts where it is off.

#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <ostream>
#include <set>

#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

struct Planted {
  std::string model;
  std::string effect;
  std::vector<Value> truth;
  // Where the law is not linear: the point of the effect's grid to start from.
  std::vector<Value> start = {};
  // What is held at the truth: a whole number.
  std::vector<Value> held = {};
};

void PrintTo(const Planted& planted, std::ostream* out) {
  *out << planted.effect << " in " << planted.model;
}

std::vector<Planted> Cases() {
  return {
      {"pendulum2_planar", "viscous_damping@joint1", {{"joint1.damping", 0.1}}},
      {"cartpole", "viscous_damping@slider", {{"slider.damping", 0.5}}},
      {"pendulum2", "viscous_damping@joint2", {{"joint2.damping", 0.02}}},
      {"pendulum2_planar",
       "coulomb_friction@joint1",
       {{"joint1.friction", 0.05}}},
      {"cartpole", "coulomb_friction@slider", {{"slider.friction", 0.2}}},
      {"pendulum2", "coulomb_friction@joint2", {{"joint2.friction", 0.01}}},
      {"pendulum2_planar",
       "stribeck_friction@joint1",
       {{"joint1.friction", 0.1},
        {"joint1.static_friction", 0.5},
        {"joint1.stribeck_velocity", 1.2}},
       {{"joint1.stribeck_velocity", 1.0}}},
      {"cartpole",
       "stribeck_friction@slider",
       {{"slider.friction", 0.3},
        {"slider.static_friction", 1.0},
        {"slider.stribeck_velocity", 0.15}},
       {{"slider.stribeck_velocity", 0.1}}},
      {"pendulum2_planar",
       "quadratic_drag@joint2",
       {{"joint2.quadratic_drag", 0.02}}},
      {"cartpole", "quadratic_drag@slider", {{"slider.quadratic_drag", 0.5}}},
      {"pendulum2", "quadratic_drag@joint1", {{"joint1.quadratic_drag", 0.02}}},
      {"pendulum2_planar",
       "spring@joint1",
       {{"joint1.stiffness", 0.8}, {"joint1.spring_reference", 0.3}}},
      {"cartpole",
       "spring@slider",
       {{"slider.stiffness", 2.0}, {"slider.spring_reference", -0.1}}},
      {"pendulum2", "spring@joint1", {{"joint1.stiffness", 0.8}}},
      {"pendulum2_planar", "armature@joint2", {{"joint2.armature", 0.05}}},
      {"cartpole", "armature@slider", {{"slider.armature", 0.3}}},
      {"pendulum2", "armature@joint1", {{"joint1.armature", 0.05}}},
      {"pendulum2_planar",
       "effort_bias@joint2",
       {{"joint2.effort_bias", -0.2}}},
      {"cartpole", "effort_bias@slider", {{"slider.effort_bias", 0.1}}},
      {"pendulum2_planar", "effort_gain@joint1", {{"joint1.effort_gain", 0.2}}},
      {"cartpole", "effort_gain@slider", {{"slider.effort_gain", -0.15}}},
      // Within a sample, and several of them.
      {"pendulum2_planar", "effort_delay@base", {{"effort_delay", 0.004}}},
      {"cartpole",
       "effort_delay@base",
       {{"effort_delay", 0.034}},
       {{"effort_delay", 0.02}}},
      {"pendulum2_planar",
       "cogging@joint1",
       {{"joint1.cogging_sin", 0.3}, {"joint1.cogging_cos", -0.2}},
       {},
       {{"joint1.cogging_order", 6.0}}},
      {"pendulum2_planar", "gravity_tilt@base", {{"gravity_tilt_y", 0.05}}},
      {"pendulum2",
       "gravity_tilt@base",
       {{"gravity_tilt_x", 0.03}, {"gravity_tilt_y", -0.02}}},
      {"pendulum2_planar",
       "sensor_offset@joint1",
       {{"joint1.sensor_offset", 0.1}}},
      {"cartpole", "sensor_offset@hinge", {{"hinge.sensor_offset", -0.05}}},
      {"pendulum2_planar", "aerodynamic_drag@link2", {{"link2.drag", 0.05}}},
      {"pendulum2", "aerodynamic_drag@link1", {{"link1.drag", 0.05}}},
      {"cartpole", "aerodynamic_drag@pole", {{"pole.drag", 0.05}}},
      {"pendulum2_planar", "mass@link2", {{"link2.mass", 0.7}}},
      {"cartpole", "mass@cart", {{"cart.mass", 1.2}}},
      {"pendulum2", "mass@link1", {{"link1.mass", 1.3}}},
      {"pendulum2_planar",
       "com@link2",
       {{"link2.com_x", 0.02}, {"link2.com_z", -0.45}}},
      {"pendulum2",
       "com@link2",
       {{"link2.com_x", 0.02}, {"link2.com_y", 0.0}, {"link2.com_z", -0.45}}},
      {"pendulum2_planar", "inertia@link2", {{"link2.inertia_scale", 30.0}}},
      {"cartpole", "inertia@pole", {{"pole.inertia_scale", 1.5}}},
  };
}

class EffectsFit : public testing::TestWithParam<Planted> {};

TEST_P(EffectsFit, FindsWhatWasPlanted) {
  const Planted& planted = GetParam();
  const Model model = Shipped(planted.model, {planted.effect}, planted.held);
  Model truth = model;
  Set(planted.truth, &truth);
  SimulationOptions simulation;
  simulation.noise = 1e-3;
  simulation.excitation = Excitation::kMultisine;
  const sysid::Run run =
      Simulate(truth, RandomState(truth, 1.0, 1), simulation);
  std::vector<Value> initial;
  for (const Value& value : planted.truth) {
    const auto start = std::find_if(
        planted.start.begin(), planted.start.end(),
        [&](const Value& other) { return other.name == value.name; });
    const double nominal =
        FindParameters(model, {value.name}, "test").front().nominal;
    initial.push_back(
        {value.name, start != planted.start.end() ? start->value : nominal});
  }
  EstimationOptions options;
  options.noise = 1e-3;
  const Fit fit = FitRuns(model, FreeFrom(model, initial), {run}, options);
  ASSERT_TRUE(fit.converged) << fit.termination;
  EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.1);
  for (const Value& value : planted.truth) {
    // Some seventy numbers, once each: none beyond four standard errors.
    EXPECT_LT(std::abs(Deviation(fit, value)), 4.0)
        << value.name << " = " << EstimateOf(fit, value.name).value << " +- "
        << EstimateOf(fit, value.name).std_error;
    if (value.value != 0.0) {
      EXPECT_NEAR(EstimateOf(fit, value.name).value, value.value,
                  0.1 * std::abs(value.value));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EffectsFit, testing::ValuesIn(Cases()),
                         [](const auto& info) {
                           std::string name =
                               info.param.model + "_" + info.param.effect;
                           std::replace_if(
                               name.begin(), name.end(),
                               [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

TEST(EffectsFitCases, AreOfEveryEffect) {
  std::set<std::string> kinds;
  for (const Planted& planted : Cases()) {
    kinds.insert(planted.effect.substr(0, planted.effect.find('@')));
  }
  EXPECT_THAT(Catalogue().kinds(), testing::UnorderedElementsAreArray(kinds));
}

}  // namespace
}  // namespace sysid
