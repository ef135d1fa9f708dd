// Where inverse dynamics lets a fit over segments begin.

#include <gtest/gtest.h>

#include <cmath>

#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "sysid/inverse_dynamics/regression.h"
#include "tests/support/ridders.h"
#include "tests/sysid/inverse_dynamics/two_links.h"

namespace sysid {
namespace {

ShootingProblem OfLength(double truth, double start) {
  const Model model = Shipped("pendulum1", {}, {{"link1.length", truth}});
  const sysid::Run run =
      Simulate(model, RandomState(model, 0.6, 1),
               {.duration = 20.0, .rate = 100.0, .noise = 1e-3});
  const Model shipped = Shipped("pendulum1");
  return ShootingProblem(shipped, FreeFrom(shipped, {{"link1.length", start}}),
                         {run}, {});
}

// No efforts: (11.10), which must not find that no pendulum fits best.
TEST(StartByInverseDynamics, FindsALengthFromATwentyFifthOfIt) {
  const ShootingProblem problem = OfLength(7.5, 0.3);
  const ShootingProblem started = StartByInverseDynamics(problem);
  EXPECT_NEAR(started.InitialTheta()[0], 7.5, 0.01);
  // The question stays as it was asked.
  EXPECT_EQ(started.free()[0].initial, 0.3);
  EXPECT_EQ(&started.data(), &problem.data());
}

TEST(StartByInverseDynamics, FindsALengthFromTenTimesIt) {
  const ShootingProblem started = StartByInverseDynamics(OfLength(0.8, 8.0));
  EXPECT_NEAR(started.InitialTheta()[0], 0.8, 0.01);
}

// What is more than memory holds is begun by a part of the runs, whose start
// is as good.
TEST(StartByInverseDynamics, OfAPartOfTheRunsIsAboutThatOfAll) {
  const Model truth = FrictionArm(0.0);
  Model wrong = truth;
  Set({{"link1.mass", 2.0}, {"link2.mass", 0.5}}, &wrong);
  std::vector<sysid::Run> runs;
  for (int i = 0; i < 4; ++i) runs.push_back(Shaken(truth, 1e-4, i + 1, 8.0));
  const ShootingProblem all(
      wrong, FreeNominal(wrong, {"link1.mass", "link2.mass"}), runs, {});
  EXPECT_EQ(&WithRowsInMemory(all).data(), &all.data());
  // At least link2's ten columns of two joints.
  const ShootingProblem part =
      WithRowsInMemory(all, 0.5 * all.data().samples() * 2 * 11);
  ASSERT_LT(part.data().run_count(), 4);
  const Eigen::VectorXd by_all = StartByInverseDynamics(all).InitialTheta();
  const Eigen::VectorXd by_part = StartByInverseDynamics(part).InitialTheta();
  ASSERT_NE(by_all, all.InitialTheta());
  EXPECT_LT((by_part - by_all).norm(), 0.02 * by_all.norm());
}

// (11.4) of theta: it begins at their minimum, and they have the derivatives of
// their residuals.
TEST(StartByInverseDynamics, GivesTheEquationsOfMotionAtTheirMinimum) {
  const Model truth = FrictionArm(0.3);
  Model wrong = truth;
  Set({{"link1.mass", 2.0}, {"link2.mass", 0.5}, {"joint1.friction", 0.0}},
      &wrong);
  const ShootingProblem started = StartByInverseDynamics(
      ShootingProblem(wrong,
                      FreeNominal(wrong, {"link1.mass", "link2.mass",
                                          "link2.com_x", "joint1.friction"}),
                      {Shaken(truth, 1e-4, 4)}, {}));
  ASSERT_NE(started.equations(), nullptr);
  const ThetaEquations& equations = *started.equations();
  const Eigen::VectorXd theta = started.InitialTheta();
  Eigen::VectorXd r(equations.rows());
  RowMatrixXd J;
  equations.Evaluate(theta.data(), r.data(), &J);
  ASSERT_EQ(J.rows(), equations.rows());
  ASSERT_EQ(J.cols(), theta.size());
  for (int i = 0; i < theta.size(); ++i) {
    const auto difference = RiddersDifference(
        [&](double h) {
          Eigen::VectorXd moved = theta;
          moved[i] += h;
          Eigen::VectorXd at(equations.rows());
          equations.Evaluate(moved.data(), at.data(), nullptr);
          return at;
        },
        0.01);
    EXPECT_LT((J.col(i) - difference.value).norm(), 1e-8 * J.col(i).norm());
    // Within a thousandth of a standard error, which is where it ends.
    EXPECT_LT(std::abs(J.col(i).dot(r)), 1e-3 * J.col(i).norm()) << i;
  }
}

// Whose scale they leave open.
TEST(StartByInverseDynamics, GivesNoEquationsOfFreeSwings) {
  EXPECT_EQ(StartByInverseDynamics(OfLength(7.5, 0.3)).equations(), nullptr);
}

double ShortError(const ShootingProblem& problem, double theta) {
  Solution point = CutPoint(problem, Eigen::VectorXd::Constant(1, theta),
                            AllStatesFromData(problem), kFirstLength);
  point.rollout.step = problem.data().MedianSamplePeriod();
  return EvaluateErrors(problem, point, 0.0).total.normalized_rms;
}

// A model that lacks a law bends what the equations give: by how well short
// segments are predicted the better of both is chosen.
TEST(StartByInverseDynamics, ChoosesByPrediction) {
  const Model truth = FrictionArm(0.3);
  Model wrong = truth;
  Set({{"joint1.friction", 0.0}, {"joint2.friction", 0.0}}, &wrong);
  const double mass = FindParameters(truth, {"link2.mass"}, "")[0].nominal;
  int moved = 0;
  for (const double factor : {0.2, 0.9, 1.0, 1.1, 5.0}) {
    const ShootingProblem problem(
        wrong, FreeFrom(wrong, {{"link2.mass", factor * mass}}),
        {Shaken(truth, 1e-4, 4)}, {});
    const double found =
        EstimateOf(FitInverseDynamics(problem), "link2.mass").value;
    const double begun = StartByInverseDynamics(problem).InitialTheta()[0];
    const bool better =
        ShortError(problem, found) < ShortError(problem, factor * mass);
    EXPECT_NEAR(begun, better ? found : factor * mass, 1e-6 * mass) << factor;
    moved += better ? 1 : 0;
  }
  EXPECT_GE(moved, 2);
}

TEST(StartByInverseDynamics, LeavesAProblemWithAJointThatIsNotMeasured) {
  const Model truth = FrictionArm(0.0);
  sysid::Run run = Shaken(truth, 1e-4, 1, 2.0);
  run.channels.pop_back();
  const ShootingProblem problem(truth, FreeFrom(truth, {{"link2.mass", 0.1}}),
                                {run}, {});
  EXPECT_EQ(StartByInverseDynamics(problem).InitialTheta(),
            problem.InitialTheta());
}

}  // namespace
}  // namespace sysid
