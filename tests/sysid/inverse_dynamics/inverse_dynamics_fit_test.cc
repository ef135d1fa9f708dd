#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "models/error.h"
#include "sysid/inverse_dynamics/coordinates.h"
#include "sysid/inverse_dynamics/equation_rows.h"
#include "tests/sysid/inverse_dynamics/two_links.h"

namespace sysid {
namespace {

// All inertial parameters and frictions, from a URDF whose bodies are wrong.
ShootingProblem WrongArm(const Model& truth, const Run& run,
                         const EstimationOptions& options = {}) {
  Model wrong = truth;
  Set({{"link1.mass", 2.0},
       {"link2.mass", 0.5},
       {"joint1.friction", 0.0},
       {"joint2.friction", 0.0},
       {"joint1.damping", 0.0},
       {"joint2.damping", 0.0}},
      &wrong);
  std::vector<std::string> names = AllOf({"link1", "link2"});
  for (const char* joint : {"joint1", "joint2"}) {
    names.push_back(std::string(joint) + ".damping");
    names.push_back(std::string(joint) + ".friction");
  }
  return ShootingProblem(wrong, FreeNominal(wrong, names), {run}, options);
}

// The values of the same combinations at the truth.
double AtTruth(const BaseParameter& base,
               const EquationCoordinates& coordinates, const Model& truth) {
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

// Without dry friction, whose kinks no filter follows.
TEST(InverseDynamicsFit, FindsTheBaseParametersOfAnArmWithinTheirErrors) {
  const Model truth = FrictionArm(0.0);
  const ShootingProblem problem = WrongArm(truth, Shaken(truth, 1e-4, 1));
  const Fit fit = FitInverseDynamics(problem);
  ASSERT_TRUE(fit.converged) << fit.termination;
  EXPECT_EQ(fit.solver, "inverse_dynamics");
  // A planar arm under gravity shows 2 + 2 first moments, 2 moments, one of
  // them regrouped (Khalil and Dombre 2002, section 9.4), and four frictions.
  const EquationCoordinates coordinates(problem.model(),
                                        problem.map().parameters());
  EXPECT_EQ(fit.base.size(), 6u + 4u);
  for (const BaseParameter& base : fit.base) {
    SCOPED_TRACE(base.terms[0].name);
    const double error = base.value - AtTruth(base, coordinates, truth);
    EXPECT_LT(std::abs(error), 4.0 * base.std_error);
  }
  ASSERT_EQ(fit.effort.size(), 2u);
  EXPECT_EQ(fit.effort[0].joint, "joint1");
  EXPECT_LT(fit.effort[0].percent, 5.0);
  // What it found is a model that predicts, from states of the filter.
  EXPECT_LT(fit.train.total.rms, 0.005);
}

// Of a run that is long enough for several ranges of times.
TEST(InverseDynamicsFit, IsTheSameByAnyNumberOfThreads) {
  const Model truth = FrictionArm(0.1);
  const sysid::Run run = Shaken(truth, 1e-4, 1);
  const Fit alone = FitInverseDynamics(WrongArm(truth, run));
  // The cut-off of the cut-off is the width of g.
  ASSERT_GT(run.t.back(), 2.0 * kTimesOfRange * CutOff(alone.cut_off_hz));
  EstimationOptions options;
  options.threads = 3;
  const Fit by_three = FitInverseDynamics(WrongArm(truth, run, options));
  EXPECT_EQ(by_three.cut_off_hz, alone.cut_off_hz);
  // Sums may round differently where memory lies differently.
  constexpr double kRounding = 1e-6;
  ASSERT_EQ(by_three.base.size(), alone.base.size());
  for (size_t i = 0; i < alone.base.size(); ++i) {
    const double s = alone.base[i].std_error;
    EXPECT_NEAR(by_three.base[i].value, alone.base[i].value, kRounding * s);
    EXPECT_NEAR(by_three.base[i].std_error, s, kRounding * s);
  }
}

TEST(InverseDynamicsFit, FindsDryFriction) {
  const Model truth = FrictionArm(0.1);
  const Fit fit = FitInverseDynamics(WrongArm(truth, Shaken(truth, 1e-4, 1)));
  ASSERT_TRUE(fit.converged) << fit.termination;
  for (const Value& value :
       {Value{"joint1.friction", 0.1}, Value{"joint2.friction", 0.05},
        Value{"joint1.damping", 0.05}, Value{"joint2.damping", 0.03}}) {
    EXPECT_LT(std::abs(Deviation(fit, value)), 5.0) << value.name;
  }
}

TEST(InverseDynamicsFit, OneFreeParameterNeedsNoRegrouping) {
  const Model truth = FrictionArm(0.0);
  Model wrong = truth;
  Set({{"link2.mass", 3.0}}, &wrong);
  const ShootingProblem problem(wrong, FreeNominal(wrong, {"link2.mass"}),
                                {Shaken(truth, 1e-4, 2)}, {});
  const Fit fit = FitInverseDynamics(problem);
  ASSERT_TRUE(fit.converged);
  const ParameterEstimate& mass = EstimateOf(fit, "link2.mass");
  EXPECT_TRUE(mass.identifiable);
  EXPECT_LT(std::abs(Deviation(
                fit, {"link2.mass",
                      FindParameters(truth, {"link2.mass"}, "")[0].nominal})),
            4.0);
  EXPECT_TRUE(fit.not_identifiable.empty());
}

// A length moves the next joint: the equations are not linear in it.
TEST(InverseDynamicsFit, IteratesWhatTheEquationsAreNotLinearIn) {
  const Model truth = FrictionArm(0.0);
  const double length = FindParameters(truth, {"link1.length"}, "")[0].nominal;
  Model wrong = truth;
  Set({{"link1.length", 1.5 * length}}, &wrong);
  const ShootingProblem problem(wrong, FreeNominal(wrong, {"link1.length"}),
                                {Shaken(truth, 1e-4, 3)}, {});
  const Fit fit = FitInverseDynamics(problem);
  ASSERT_TRUE(fit.converged);
  EXPECT_NEAR(EstimateOf(fit, "link1.length").value, length, 0.01 * length);
}

TEST(InverseDynamicsFit, AJointThatIsNotMeasuredIsSaid) {
  const Model truth = FrictionArm(0.0);
  sysid::Run run = Shaken(truth, 1e-4, 1, 2.0);
  run.channels.pop_back();
  const ShootingProblem problem(truth, FreeNominal(truth, {"link2.mass"}),
                                {run}, {});
  try {
    FitInverseDynamics(problem);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("joint2"), std::string::npos)
        << error.what();
  }
}

TEST(InverseDynamicsFit, AnEffectThatRemembersIsSaid) {
  Model truth = FrictionArm(0.0);
  truth.AddEffect(Catalogue().Make("presliding_friction@joint2",
                                   truth.mechanism(), "test"));
  const ShootingProblem problem(truth, FreeNominal(truth, {"link2.mass"}),
                                {Shaken(truth, 1e-4, 1, 2.0)}, {});
  try {
    FitInverseDynamics(problem);
    FAIL();
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("presliding_friction@joint2"), std::string::npos)
        << text;
    EXPECT_NE(text.find("--solver lm"), std::string::npos) << text;
  }
  // A fit of the motion starts where it was told.
  EXPECT_EQ(StartByInverseDynamics(problem).InitialTheta(),
            problem.InitialTheta());
}

TEST(InverseDynamicsFit, RunsThatAreTooShortAreSaid) {
  const Model truth = FrictionArm(0.0);
  sysid::Run run = Shaken(truth, 1e-4, 1, 0.04);  // 9 samples
  const ShootingProblem problem(truth, FreeNominal(truth, {"link2.mass"}),
                                {run}, {});
  try {
    FitInverseDynamics(problem);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("too short"), std::string::npos)
        << error.what();
  }
  // A fit of the motion starts where it was told.
  EXPECT_EQ(StartByInverseDynamics(problem).InitialTheta(),
            problem.InitialTheta());
}

// The equations of a free swing would be met exactly by a mechanism of moments
// alone, which no lengths give: what is left of them would be rounding.
TEST(InverseDynamicsFit, FindsLengthsFromAFreeSwing) {
  for (const char* name : {"pendulum2_planar", "pendulum3_planar"}) {
    const Model truth = Shipped(name);
    Model wrong = truth;
    Set({{"link1.length", 0.3}, {"link2.length", 0.8}}, &wrong);
    const sysid::Run run =
        Simulate(truth, RandomState(truth, 0.5, 1),
                 {.duration = 10.0, .rate = 100.0, .noise = 1e-4});
    const ShootingProblem problem(
        wrong, FreeNominal(wrong, {"link1.length", "link2.length"}), {run}, {});
    const Fit fit = FitInverseDynamics(problem);
    EXPECT_TRUE(fit.converged) << name << ": " << fit.termination;
    for (const char* length : {"link1.length", "link2.length"}) {
      const double expected = FindParameters(truth, {length}, "")[0].nominal;
      EXPECT_NEAR(EstimateOf(fit, length).value, expected, 0.05 * expected)
          << name << " " << length;
    }
  }
}

// A free swing says nothing of scales: all that comes out is in the URDF's.
TEST(InverseDynamicsFit, WithoutEffortsOnlyRatiosShow) {
  const Model truth = Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                              {{"joint1.damping", 0.02}});
  sysid::Run run = Simulate(truth, RandomState(truth, 1.0, 1),
                            {.duration = 10.0, .rate = 200.0, .noise = 1e-4});
  Model wrong = truth;
  const double mass = FindParameters(truth, {"link2.mass"}, "")[0].nominal;
  Set({{"link2.mass", 1.6 * mass}, {"joint1.damping", 0.0}}, &wrong);
  std::vector<std::string> names = AllOf({"link1", "link2"});
  names.push_back("joint1.damping");
  const ShootingProblem problem(wrong, FreeNominal(wrong, names), {run}, {});
  const Fit fit = FitInverseDynamics(problem);
  ASSERT_TRUE(fit.converged) << fit.termination;
  EXPECT_NE(fit.termination.find("only their ratios"), std::string::npos);
  const EquationCoordinates coordinates(problem.model(),
                                        problem.map().parameters());
  // All that is known to some per cent has one scale.
  int known = 0;
  double first = 0.0;
  for (const BaseParameter& base : fit.base) {
    if (base.std_error > 0.01 * std::abs(base.value)) continue;
    const double scale = base.value / AtTruth(base, coordinates, truth);
    if (known++ == 0) first = scale;
    EXPECT_NEAR(scale / first, 1.0, 0.02) << base.terms[0].name;
  }
  EXPECT_GE(known, 4);
}

// A cart and its pole: no mass or moment shows alone, four combinations do.
TEST(InverseDynamicsFit, ParametersMayShowInCombinationsAlone) {
  const Model truth = Shipped("cartpole");
  SimulationOptions options;
  options.duration = 20.0;
  options.rate = 200.0;
  options.noise = 1e-4;
  options.excitation = Excitation::kMultisine;
  const sysid::Run run = Simulate(truth, RandomState(truth, 0.5, 1), options);
  const Fit fit = FitInverseDynamics(ShootingProblem(
      truth, FreeNominal(truth, AllOf({"cart", "pole"})), {run}, {}));
  EXPECT_TRUE(fit.converged) << fit.termination;
  for (const ParameterEstimate& p : fit.parameters) {
    EXPECT_FALSE(p.identifiable) << p.name;
  }
  EXPECT_EQ(fit.base.size(), 4u);
}

// A cart with a drive of another motor constant and with friction: a pole that
// no effort moves.
Model DrivenCart() {
  return Shipped("cartpole", {"effort_gain@slider", "viscous_damping@slider"},
                 {{"slider.effort_gain", 0.7}, {"slider.damping", 3.0}});
}

// The length of a point mass that swings as the pole does, m.
double SwingLength(const Model& model) {
  const Mechanism& mechanism = model.mechanism();
  const int pole = FindParameters(model, {"pole.mass"}, "test")[0].index;
  const Inertial<double>& body = model.nominal().links[pole];
  const Joint& hinge = mechanism.joints[mechanism.FindJoint("hinge")];
  const double moment = hinge.axis.dot(body.inertia * hinge.axis);
  return body.com.norm() + moment / (body.mass * body.com.norm());
}

// By its slider alone.
sysid::Run DriveCart(const Model& model) {
  SimulationOptions options;
  options.duration = 20.0;
  options.rate = 200.0;
  options.noise = 1e-4;
  options.step = 1e-3;
  return SimulateDriven(model, RandomState(model, 0.5, 1), options,
                        [](int, double t, const Eigen::VectorXd&,
                           Eigen::Ref<Eigen::VectorXd> effort) {
                          effort[0] = 2.0 * std::sin(3.0 * t) +
                                      1.5 * std::sin(7.0 * t + 1.0);
                        });
}

// Its equation is right for a pole without mass, whatever the motion; and what
// the slider lacks must not pull at the pole.
TEST(InverseDynamicsFit, KeepsABodyThatNoEffortMoves) {
  const Model truth = DrivenCart();
  const sysid::Run run = DriveCart(truth);
  const Model plain = Shipped("cartpole");
  // Four times what the filter of the motion costs; without (11.10) 2 %.
  constexpr double kNear = 2e-3;
  std::vector<Value> starts = {{"pole.mass", 0.5}, {"pole.com_z", -0.2}};
  for (const double inertia : {0.0, 1.0}) {
    if (inertia > 0.0) starts.push_back({"pole.inertia_scale", inertia});
    const Fit without = FitInverseDynamics(
        ShootingProblem(plain, FreeFrom(plain, starts), {run}, {}));
    EXPECT_NEAR(SwingLength(without.model) / SwingLength(truth), 1.0, kNear);
  }
  // Nor is the effort taken away, with all that it moves: 1 + g = 0.
  Model with = truth;
  Set({{"slider.effort_gain", 0.0}, {"slider.damping", 0.0}}, &with);
  const Fit gain = FitInverseDynamics(
      ShootingProblem(with,
                      FreeFrom(with, {{"pole.mass", 0.5},
                                      {"pole.com_z", -0.2},
                                      {"pole.inertia_scale", 1},
                                      {"slider.effort_gain", 0},
                                      {"slider.damping", 0}}),
                      {run}, {}));
  EXPECT_NEAR(SwingLength(gain.model) / SwingLength(truth), 1.0, kNear);
  EXPECT_NEAR(EstimateOf(gain, "slider.damping").value /
                  (1.0 + EstimateOf(gain, "slider.effort_gain").value),
              3.0 / 1.7, 0.02 * 3.0 / 1.7);
}

// A cart without drives says nothing of the mass on it but what is believed.
TEST(InverseDynamicsFit, ABeliefDecidesWhatAFreeSwingLeavesOpen) {
  const Model truth = Shipped("cartpole");
  sysid::Run run = Simulate(truth, RandomState(truth, 0.5, 1),
                            {.duration = 10.0, .rate = 200.0, .noise = 1e-4});
  std::vector<FreeParameter> free = FreeFrom(
      truth,
      {{"cart.mass", 0.5}, {"pole.mass", 0.1}, {"pole.inertia_scale", 1.0}});
  free[1].prior = FreeParameter::Prior{0.3, 1e-3};
  const Fit fit = FitInverseDynamics(ShootingProblem(truth, free, {run}, {}));
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_NEAR(EstimateOf(fit, "pole.mass").value, 0.3, 1e-3);
  // The motion tells of their ratio.
  const auto mass = [&](const char* name) {
    return FindParameters(truth, {name}, "test")[0].nominal;
  };
  EXPECT_NEAR(EstimateOf(fit, "cart.mass").value / 0.3,
              mass("cart.mass") / mass("pole.mass"),
              0.05 * mass("cart.mass") / mass("pole.mass"));
}

// From however near.
TEST(InverseDynamicsFit, GoesOntoABound) {
  const Model truth = FrictionArm(0.0);
  sysid::Run run = Shaken(truth, 1e-5, 1);
  const Eigen::MatrixXd q = run.channels[0].values;
  // As if friction drove joint1.
  for (int k = 1; k + 1 < run.size(); ++k) {
    run.effort(k, 0) -=
        0.2 * (q(k + 1, 0) - q(k - 1, 0)) / (run.t[k + 1] - run.t[k - 1]);
  }
  for (const double start : {0.1, 1e-3, 1e-7}) {
    const Fit fit = FitInverseDynamics(ShootingProblem(
        truth,
        FreeFrom(truth, {{"joint1.damping", start}, {"joint2.damping", 0.01}}),
        {run}, {}));
    EXPECT_EQ(EstimateOf(fit, "joint1.damping").value, 0.0) << start;
    EXPECT_TRUE(EstimateOf(fit, "joint1.damping").at_bound) << start;
    EXPECT_FALSE(EstimateOf(fit, "joint2.damping").at_bound) << start;
  }
}

// A gain of efforts of which none was measured changes nothing.
TEST(InverseDynamicsFit, SaysWhereNoParameterHasAnyInfluence) {
  const Model truth = FrictionArm(0.0);
  sysid::Run run = Shaken(truth, 1e-4, 1);
  run.effort.setZero();
  Model model = truth;
  const Catalogue catalogue;
  model.AddEffect(
      catalogue.Make("effort_gain@joint1", model.mechanism(), "test"));
  const Fit fit = FitInverseDynamics(ShootingProblem(
      model, FreeNominal(model, {"joint1.effort_gain"}), {run}, {}));
  EXPECT_FALSE(fit.converged);
  EXPECT_NE(fit.termination.find("no free parameter has any influence"),
            std::string::npos)
      << fit.termination;
}

}  // namespace
}  // namespace sysid
