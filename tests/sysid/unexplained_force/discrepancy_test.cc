#include "sysid/unexplained_force/discrepancy.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/random_force.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

ShootingProblem ForcedProblem(const RandomForceCase& c, double segment = 0.0) {
  EstimationOptions options;
  options.noise = 1e-3;
  options.segment = segment;
  const Model model = ForcedPendulum();
  return ShootingProblem(model, FreeFrom(model, TruthOfForcedPendulum()),
                         {RecordUnderRandomForce(c)}, options);
}

TEST(Discrepancy, FindsTheSizeOfARandomForce) {
  const ShootingProblem problem = ForcedProblem({});
  Fit fit = FitLevenbergMarquardt(problem);
  ASSERT_TRUE(fit.converged);
  const std::vector<ParameterEstimate> before = fit.parameters;
  AddDiscrepancy(problem, &fit);
  ASSERT_EQ(fit.discrepancy.size(), 2u);
  EXPECT_EQ(fit.discrepancy[0].joint, "joint1");
  // One path of a force tells its size roughly.
  EXPECT_GT(fit.discrepancy[0].force_std, 0.1 / 3);
  EXPECT_LT(fit.discrepancy[0].force_std, 0.1 * 3);
  EXPECT_LT(fit.discrepancy[1].force_std, fit.discrepancy[0].force_std);
  EXPECT_GT(fit.discrepancy[0].correlation_time_s, 0.05);
  EXPECT_LT(fit.discrepancy[0].correlation_time_s, 1.0);
  // The values stay, the intervals do not.
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(fit.parameters[i].value, before[i].value);
    EXPECT_GT(fit.parameters[i].std_error, before[i].std_error);
  }
}

TEST(Discrepancy, DoesNotHangOnHowTheRunIsCut) {
  const ShootingProblem a = ForcedProblem({}, 1.25), b = ForcedProblem({}, 5.0);
  Fit fit_a = FitLevenbergMarquardt(a), fit_b = FitLevenbergMarquardt(b);
  AddDiscrepancy(a, &fit_a);
  AddDiscrepancy(b, &fit_b);
  for (size_t i = 0; i < fit_a.parameters.size(); ++i) {
    EXPECT_NEAR(fit_a.parameters[i].std_error / fit_b.parameters[i].std_error,
                1.0, 0.3)
        << fit_a.parameters[i].name;
  }
}

TEST(Discrepancy, LeavesAFitAtTheNoiseAsItIs) {
  const ShootingProblem problem = ForcedProblem({.std = 0.0});
  Fit fit = FitLevenbergMarquardt(problem);
  const double before = fit.parameters[0].std_error;
  AddDiscrepancy(problem, &fit);
  EXPECT_TRUE(fit.discrepancy.empty());
  EXPECT_EQ(fit.parameters[0].std_error, before);
}

TEST(Discrepancy, WidensIndependentSegmentsToo) {
  const ShootingProblem problem = ForcedProblem({}, 1.25);
  Fit fit = FitIndependentSegments(problem);
  const std::vector<ParameterEstimate> before = fit.parameters;
  AddDiscrepancy(problem, &fit);
  ASSERT_FALSE(fit.discrepancy.empty());
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_TRUE(std::isfinite(fit.parameters[i].std_error));
    EXPECT_GT(fit.parameters[i].std_error, 0.3 * before[i].std_error);
  }
}

TEST(Discrepancy, TestsEffectsBesideIt) {
  const ShootingProblem problem = ForcedProblem({});
  Fit fit = FitLevenbergMarquardt(problem);
  AddDiscrepancy(problem, &fit);
  const Catalogue catalogue;
  const Model none = Shipped("pendulum2_planar");
  const auto damping =
      catalogue.Make("viscous_damping@joint1", none.mechanism(), "test");
  EXPECT_LT(PValueOf(*damping, none, fit), 0.01);
}

// A fit of a mass m and the damping d of a joint.
class PValueOfTest : public ::testing::Test {
 protected:
  PValueOfTest() : none_(Shipped("pendulum2_planar")), fit_(none_) {
    const auto add = [&](const std::string& name, double value, double lower) {
      ParameterEstimate p;
      p.name = name;
      p.value = value;
      p.lower = lower;
      p.upper = std::numeric_limits<double>::infinity();
      fit_.parameters.push_back(p);
    };
    add("link1.mass", 2.0, 1e-6);
    add("joint1.damping", 0.1, 0.0);
    fit_.covariance = Eigen::Vector2d(1e-4, 1e-4).asDiagonal();
    fit_.undetermined.resize(2, 0);
  }

  double PValue() const {
    return PValueOf(
        *Catalogue().Make("viscous_damping@joint1", none_.mechanism(), "test"),
        none_, fit_);
  }

  Model none_;
  Fit fit_;
};

TEST_F(PValueOfTest, OfWhatIsDetermined) {
  EXPECT_LT(PValue(), 1e-20);  // ten standard errors
  fit_.parameters[1].value = 0.01;
  EXPECT_NEAR(PValue(), 0.1587, 1e-4);  // none is at the bound: one side
  fit_.parameters[1].lower = -1.0;
  EXPECT_NEAR(PValue(), 0.3173, 1e-4);
}

// Of a nominal value that is wrong, none is that value: link1 has 1 kg.
TEST_F(PValueOfTest, OfANominalValue) {
  const auto mass = Catalogue().Make("mass@link1", none_.mechanism(), "test");
  EXPECT_LT(PValueOf(*mass, none_, fit_), 1e-20);
  fit_.parameters[0].value = none_.nominal().links[1].mass + 0.01;
  EXPECT_NEAR(PValueOf(*mass, none_, fit_), 0.3173, 1e-4);
}

TEST_F(PValueOfTest, WhatTheDataSaysNothingOfMayBeNone) {
  fit_.undetermined = Eigen::Vector2d(0, 1e5);
  EXPECT_GT(PValue(), 0.49);
}

TEST_F(PValueOfTest, WhatAnotherParameterCanDoInsteadMayBeNone) {
  fit_.undetermined = Eigen::Vector2d(-1e5, 1e5);
  EXPECT_GT(PValue(), 0.49);
}

// The damping ends with the mass.
TEST_F(PValueOfTest, WhatOnlyScalesWithAMassIsSomething) {
  for (const double sign : {-1.0, 1.0}) {
    fit_.undetermined = sign * Eigen::Vector2d(2e5, 1.02e4);  // about
    EXPECT_LT(PValue(), 1e-20);
  }
}

// What other parameters leave open does not concern it.
TEST_F(PValueOfTest, RoundingInADirectionIsNoMove) {
  fit_.undetermined = Eigen::Vector2d(1e5, 1e-12);
  EXPECT_LT(PValue(), 1e-20);
}

}  // namespace
}  // namespace sysid
