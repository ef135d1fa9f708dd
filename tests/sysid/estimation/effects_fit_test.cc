// Every effect of the catalogue, planted by the simulator and found again by a
// fit that starts where it is off.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>
#include <set>

#include "tests/support/fit_setup.h"
#include "tests/support/test_name.h"

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
      {"pendulum2_planar",
       "force_table@joint1",
       {{"joint1.table_0_0", 0.3},
        {"joint1.table_1_0", -0.2},
        {"joint1.table_0_1", 0.2},
        {"joint1.table_2_1", 0.1}}},
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
      {"pendulum2_planar",
       "load_friction@joint1",
       {{"joint1.load_friction", 0.2}}},
      {"cartpole", "load_friction@slider", {{"slider.load_friction", 0.2}}},
      {"pendulum2_planar",
       "load_stribeck_friction@joint1",
       {{"joint1.load_friction", 0.1},
        {"joint1.static_load_friction", 0.4},
        {"joint1.load_stribeck_velocity", 1.0}},
       {{"joint1.load_friction", 0.15},
        {"joint1.static_load_friction", 0.3},
        {"joint1.load_stribeck_velocity", 0.8}}},
      {"pendulum2_planar",
       "gear_efficiency@joint1",
       {{"joint1.loss_driving", 0.2}, {"joint1.loss_driven", 0.1}}},
      {"pendulum2_planar",
       "asymmetric_friction@joint1",
       {{"joint1.friction", 0.2},
        {"joint1.damping", 0.2},
        {"joint1.friction_asymmetry", 0.06},
        {"joint1.damping_asymmetry", -0.04}},
       {{"joint1.friction", 0.1}, {"joint1.damping", 0.1}}},
      {"pendulum2_planar",
       "cubic_damping@joint1",
       {{"joint1.cubic_damping", 0.05}}},
      {"cartpole", "cubic_damping@slider", {{"slider.cubic_damping", 0.5}}},
      {"pendulum2_planar",
       "actuator_lag@joint1",
       {{"joint1.actuator_lag", 0.03}}},
      {"pendulum2_planar",
       "effort_limit@joint1",
       {{"joint1.effort_limit", 1.5}},
       {{"joint1.effort_limit", 2.0}},
       {{"joint1.inverse_no_load_speed", 0.0}}},
      {"pendulum2_planar",
       "sensor_gain@joint1",
       {{"joint1.sensor_gain", 0.05}}},
      {"cartpole", "sensor_gain@slider", {{"slider.sensor_gain", -0.1}}},
      {"pendulum2_planar",
       "sensor_delay@joint2",
       {{"joint2.sensor_delay", 0.01}}},
      {"pendulum2_planar",
       "transmission_error@joint1",
       {{"joint1.transmission_sin", 0.02}, {"joint1.transmission_cos", -0.03}},
       {},
       {{"joint1.transmission_order", 6.0}}},
      {"pendulum2_planar",
       "gear_coupling@joint1,joint2",
       {{"joint2.coupling_armature", 0.1},
        {"joint2.coupling_damping", 0.1},
        {"joint2.coupling_friction", 0.1}},
       {{"joint2.coupling_friction", 0.05}},
       {{"joint2.coupling_sign", 1.0}}},
      {"pendulum2_planar",
       "presliding_friction@joint1",
       {{"joint1.presliding_friction", 0.3}, {"joint1.presliding_length", 0.1}},
       {{"joint1.presliding_length", 0.05}}},
      {"cartpole",
       "presliding_friction@slider",
       {{"slider.presliding_friction", 0.3},
        {"slider.presliding_length", 0.02}},
       {{"slider.presliding_length", 0.01}}},
      {"pendulum2_planar",
       "joint_elasticity@joint1",
       {{"joint1.drive_stiffness", 60.0},
        {"joint1.drive_damping", 0.3},
        {"joint1.motor_inertia", 0.05}},
       {{"joint1.drive_stiffness", 40.0},
        {"joint1.drive_damping", 0.1},
        {"joint1.motor_inertia", 0.03}}},
      {"pendulum2_planar",
       "backlash@joint1",
       {{"joint1.drive_stiffness", 60.0},
        {"joint1.drive_damping", 0.3},
        {"joint1.motor_inertia", 0.05},
        {"joint1.backlash", 0.1}},
       {{"joint1.drive_stiffness", 40.0},
        {"joint1.drive_damping", 0.1},
        {"joint1.motor_inertia", 0.03},
        {"joint1.backlash", 0.05}}},
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
                           return TestName(info.param.model + "_" +
                                           info.param.effect);
                         });

TEST(EffectsFitCases, AreOfEveryEffect) {
  std::set<std::string> kinds;
  for (const Planted& planted : Cases()) {
    kinds.insert(planted.effect.substr(0, planted.effect.find('@')));
  }
  // Those that read inputs have them nowhere here (ReadsInputs below).
  for (const char* kind :
       {"position_drive", "base_motion", "thermal_friction", "custom"}) {
    kinds.insert(kind);
  }
  EXPECT_THAT(Catalogue().kinds(), testing::UnorderedElementsAreArray(kinds));
}

// A laboratory's inputs: commands, a shaken base, an arm that warms up.
TEST(EffectsFit, FindsWhatReadsInputs) {
  const auto inputs = std::make_shared<sysid::Run>();
  inputs->inputs = {{"joint1.cmd", true, {}}, {"joint2.cmd", true, {}},
                    {"base.ax", false, {}},   {"base.ay", false, {}},
                    {"base.az", false, {}},   {"joint1.temperature", false, {}},
                    {"wind", false, {}}};
  for (int k = 0; k <= 1000; ++k) {
    const double t = 0.01 * k;
    inputs->t.push_back(t);
    const double values[] = {0.6 * std::sin(2 * t) + 0.3 * std::sin(7 * t),
                             0.5 * std::cos(3 * t),
                             std::sin(5 * t),
                             0.0,
                             0.7 * std::cos(8 * t),
                             20 + 4 * t,
                             std::sin(4 * t)};
    for (int i = 0; i < 7; ++i) inputs->inputs[i].values.push_back(values[i]);
  }
  struct Case {
    std::string effect;
    std::vector<Value> truth, start;
  };
  for (const Case& c :
       std::vector<Case>{{"position_drive@joint1",
                          {{"joint1.kp", 40.0},
                           {"joint1.kd", 3.0},
                           {"joint1.drive_delay", 0.023}},
                          {{"joint1.kp", 30.0},
                           {"joint1.kd", 2.0},
                           {"joint1.drive_delay", 0.01}}},
                         {"base_motion@base", {{"base_motion_gain", 1.0}}, {}},
                         {"thermal_friction@joint1",
                          {{"joint1.friction", 0.3},
                           {"joint1.damping", 0.2},
                           {"joint1.thermal_rate", 0.03}},
                          {{"joint1.friction", 0.2}, {"joint1.damping", 0.1}}},
                         {"custom@joint1: -k*wind*abs(q) - b*joint2.qd",
                          {{"joint1.k", 0.5}, {"joint1.b", 0.1}},
                          {}}}) {
    SCOPED_TRACE(c.effect);
    Mechanism mechanism = LoadUrdf(FindModel("pendulum2_planar"));
    mechanism.inputs = {"wind"};
    Model model(mechanism);
    model.AddEffect(Catalogue().Make(c.effect, mechanism, "test"));
    Model truth = model;
    Set(c.truth, &truth);
    SimulationOptions simulation;
    simulation.noise = 1e-3;
    simulation.inputs = inputs;
    const sysid::Run run =
        Simulate(truth, RandomState(truth, 0.5, 1), simulation);
    std::vector<Value> initial;
    for (const Value& value : c.truth) {
      const auto start = std::find_if(
          c.start.begin(), c.start.end(),
          [&](const Value& other) { return other.name == value.name; });
      initial.push_back(
          {value.name, start != c.start.end() ? start->value : 0.0});
    }
    EstimationOptions options;
    options.noise = 1e-3;
    const Fit fit = FitRuns(model, FreeFrom(model, initial), {run}, options);
    ASSERT_TRUE(fit.converged) << fit.termination;
    EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.1);
    for (const Value& value : c.truth) {
      EXPECT_LT(std::abs(Deviation(fit, value)), 4.0) << value.name;
      EXPECT_NEAR(EstimateOf(fit, value.name).value, value.value,
                  0.1 * std::abs(value.value));
    }
  }
}

}  // namespace
}  // namespace sysid
