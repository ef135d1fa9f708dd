#include "sysid/stochastic/stochastic_fit.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stop_token>

#include "tests/sysid/stochastic/stochastic_setup.h"

namespace sysid {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

AdamFitOptions FromRest() {
  AdamFitOptions options;
  options.from_rest = true;
  return options;
}

MixtureOptions MixtureFromRest() {
  MixtureOptions options;
  options.from_rest = true;
  return options;
}

TEST(FitAdam, FindsLengthsAndFillsTheFit) {
  const auto problem = TwoLengths();
  const Fit fit = FitAdam(*problem, FromRest());
  EXPECT_TRUE(fit.converged) << fit.termination;
  EXPECT_EQ(fit.solver, "adam");
  EXPECT_EQ(fit.iterations, 150);
  EXPECT_EQ(fit.evaluations, 151);
  EXPECT_NEAR(EstimateOf(fit, "link1.length").value, 0.4, 0.01 * 0.4);
  EXPECT_NEAR(EstimateOf(fit, "link2.length").value, 0.3, 0.01 * 0.3);
  EXPECT_NEAR(fit.train.total.normalized_rms, 1.0, 0.3);
  ASSERT_EQ(fit.history.size(), 151u);
  EXPECT_LT(fit.history.back().cost, 1e-2 * fit.history.front().cost);
  EXPECT_EQ(fit.history.front().theta, Eigen::Vector2d(0.5, 0.5));
  EXPECT_GT(EstimateOf(fit, "link1.length").std_error, 0.0);
  EXPECT_EQ(fit.open.size(), 1u);
  EXPECT_THAT(fit.not_identifiable, IsEmpty());
}

// Asks to stop when epoch `at` is reported.
void StopAt(int at, std::stop_source* source, ShootingProblem* problem) {
  *problem = Changed(*problem, [&](EstimationOptions* options) {
    options->stop = source->get_token();
    options->keep_best = true;
    options->progress = [at, source](const Progress& p) {
      if (p.iteration == at) source->request_stop();
    };
  });
}

TEST(FitAdam, KeepsTheBestEpochWhereItIsInterrupted) {
  // At 0 nothing has moved yet: one step is taken.
  for (const int at : {0, 1, 7}) {
    SCOPED_TRACE(at);
    const auto problem = TwoLengths();
    std::stop_source source;
    StopAt(at, &source, problem.get());
    const Fit fit = FitAdam(*problem, FromRest());
    const int epochs = std::max(1, at);
    EXPECT_FALSE(fit.converged);
    EXPECT_EQ(fit.termination, "interrupted after " + std::to_string(epochs) +
                                   " epochs: this is the best point so far, "
                                   "and no minimum");
    EXPECT_EQ(fit.iterations, epochs);
    EXPECT_EQ(fit.history.size(), epochs + 1u);
    EXPECT_LT(EstimateOf(fit, "link1.length").value, 0.5);  // towards 0.4
  }
}

TEST(FitGaussianMixture, KeepsItsLastEpochWhereItIsInterrupted) {
  const auto problem = TwoLengths();
  std::stop_source source;
  StopAt(5, &source, problem.get());
  const MixtureFit mixture = FitGaussianMixture(*problem, MixtureFromRest());
  EXPECT_FALSE(mixture.fit.converged);
  EXPECT_THAT(mixture.fit.termination, HasSubstr("interrupted after 5 epochs"));
  EXPECT_EQ(mixture.epochs.back().epoch, 5);
  EXPECT_EQ(mixture.mixture.weights.size(), 3);
}

TEST(FitAdam, IsTheSameEveryTime) {
  AdamFitOptions options = FromRest();
  options.adam.epochs = 20;
  const auto a = TwoLengths(), b = TwoLengths();
  const Eigen::VectorXd first = FitAdam(*a, options).point.theta;
  EXPECT_EQ(first, FitAdam(*b, options).point.theta);
}

// Only where a run begins is it known to rest, not where a rollout is cut out
// of its middle. Those first velocities are the data's: rough, but no zeros.
TEST(FitAdam, LetsARolloutOutOfTheMiddleMoveFromTheStart) {
  const auto problem = TwoLengths(1e-5, 2);
  *problem = Changed(*problem, [&](EstimationOptions* o) { o->segment = 0.3; });
  const Fit fit = FitAdam(*problem, FromRest());
  for (const Solution::Nodes& nodes : fit.point.runs) {
    ASSERT_EQ(nodes.segments(), 2);
    EXPECT_EQ(nodes.states.row(0).tail(6).norm(), 0.0);
    EXPECT_GT(nodes.states.row(1).tail(6).norm(), 0.1);
  }
  EXPECT_NEAR(EstimateOf(fit, "link1.length").value, 0.4, 0.05 * 0.4);
  EXPECT_NEAR(EstimateOf(fit, "link2.length").value, 0.3, 0.05 * 0.3);
}

TEST(FitAdam, StopsAtItsBounds) {
  const auto whole = TwoLengths();
  std::vector<FreeParameter> free = whole->free();
  free[0].lower = 0.45;  // the truth is 0.4
  free[0].upper = 0.6;
  const auto problem = Freeing(*whole, free);
  const Fit fit = FitAdam(*problem, FromRest());
  EXPECT_GE(EstimateOf(fit, "link1.length").value, 0.45);
  EXPECT_LT(EstimateOf(fit, "link1.length").value, 0.46);
  for (const HistoryEntry& entry : fit.history) {
    EXPECT_GE(entry.theta[0], 0.45);
    EXPECT_LE(entry.theta[0], 0.6);
  }
}

TEST(FitAdam, FollowsAStiffDampingWithShorterSteps) {
  const auto problem =
      TwoDampings({{"joint1.damping", 0.0}, {"joint2.damping", 0.0}}, 1.0);
  AdamFitOptions adam = FromRest();
  adam.adam.epochs = 300;
  const Fit fit = FitAdam(*problem, adam);
  EXPECT_TRUE(fit.converged) << fit.termination;
  // Null is its bound: that start was not used.
  EXPECT_GT(EstimateOf(fit, "joint1.damping").initial, 0.0);
  EXPECT_EQ(EstimateOf(fit, "joint1.damping").initial,
            fit.history.front().theta[0]);
  EXPECT_NEAR(EstimateOf(fit, "joint1.damping").value, 0.05, 0.01);
  EXPECT_NEAR(EstimateOf(fit, "joint2.damping").value, 0.02, 0.004);
  EXPECT_LT(fit.step_s, 0.005);
}

TEST(FitAdam, SaysWhatIsMissingWhereItHasNotSettled) {
  const auto problem = TwoLengths();
  AdamFitOptions options = FromRest();
  options.adam.epochs = 2;
  const Fit fit = FitAdam(*problem, options);
  EXPECT_FALSE(fit.converged);
  EXPECT_THAT(fit.termination,
              AllOf(HasSubstr("after 2 epochs"), HasSubstr("link"),
                    HasSubstr("more --epochs")));
}

TEST(FitAdam, SaysWhereTheRolloutsFail) {
  const auto problem = StiffDamping(1e30, 0.04, 2.0);
  const Fit fit = FitAdam(*problem, FromRest());
  EXPECT_FALSE(fit.converged);
  EXPECT_THAT(fit.termination, HasSubstr("the rollouts fail"));
}

TEST(FitAdam, IsPulledByAPrior) {
  const auto whole = TwoLengths();
  std::vector<FreeParameter> free = whole->free();
  free[1].prior = FreeParameter::Prior{0.45, 1e-5};
  const auto problem = Freeing(*whole, free);
  const Fit fit = FitAdam(*problem, FromRest());
  EXPECT_NEAR(EstimateOf(fit, "link2.length").value, 0.45, 1e-3);
}

// EstimationOptions::threads, --threads of the programs, changes no bit.
TEST(FitGaussianMixture, IsTheSameByOneThreadAndByTwo) {
  MixtureOptions options = MixtureFromRest();
  options.adam.epochs = 20;
  std::vector<MixtureFit> fits;
  for (const int threads : {1, 2}) {
    const auto problem = TwoLengths(1e-3, 3);
    *problem =
        Changed(*problem, [&](EstimationOptions* o) { o->threads = threads; });
    fits.push_back(FitGaussianMixture(*problem, options));
  }
  EXPECT_EQ(fits[0].kernels.Pack(), fits[1].kernels.Pack());
  ASSERT_EQ(fits[0].epochs.size(), fits[1].epochs.size());
  for (size_t i = 0; i < fits[0].epochs.size(); ++i) {
    EXPECT_EQ(fits[0].epochs[i].loss, fits[1].epochs[i].loss);
  }
}

TEST(FitGaussianMixture, FindsLengthsAndRecordsEveryEpoch) {
  const auto problem = TwoLengths();
  const MixtureFit result = FitGaussianMixture(*problem, MixtureFromRest());
  EXPECT_TRUE(result.fit.converged) << result.fit.termination;
  EXPECT_EQ(result.fit.solver, "gmm");
  EXPECT_NEAR(result.mixture.Mean()[0], 0.4, 0.02 * 0.4);
  EXPECT_NEAR(result.mixture.Mean()[1], 0.3, 0.02 * 0.3);
  EXPECT_EQ(result.draws, 16 * 150);
  EXPECT_EQ(result.fit.evaluations, 16 * 150);
  ASSERT_EQ(result.epochs.size(), 151u);
  for (size_t i = 0; i < result.epochs.size(); ++i) {
    const MixtureEpoch& epoch = result.epochs[i];
    EXPECT_EQ(epoch.epoch, static_cast<int>(i));
    EXPECT_EQ(epoch.rollouts, i == 0 ? 0 : 1);
    EXPECT_NEAR(epoch.kernels.weights.sum(), 1.0, 1e-12);
    EXPECT_EQ(epoch.kernels.means.rows(), 3);
    EXPECT_GT(epoch.kernels.stds.minCoeff(), 0.0);
  }
  const Eigen::VectorXd first = result.epochs.front().kernels.Std();
  EXPECT_LT(result.mixture.Std()[0], first[0] / 5);
  EXPECT_LT(result.mixture.Std()[1], first[1] / 5);
  EXPECT_THAT(result.disagreeing, IsEmpty());
  EXPECT_THAT(result.remarks, IsEmpty());
}

// As long as the kernels are wide, T makes more of their upper halves.
TEST(FitGaussianMixture, EstimatesTheWeightedSumOfItsKernels) {
  const auto problem = TwoLengths();
  MixtureOptions options = MixtureFromRest();
  options.adam.epochs = 5;
  const MixtureFit result = FitGaussianMixture(*problem, options);
  const ParameterMixture& last = result.mixture;
  EXPECT_GT(last.Std().minCoeff(), 0.05);
  const Eigen::VectorXd sum = last.means.transpose() * last.weights;
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(result.fit.parameters[i].value, sum[i], 1e-12);
    EXPECT_NEAR(result.fit.history.back().theta[i], sum[i], 1e-12);
  }
}

TEST(FitGaussianMixture, IsTheSameForASeedAndOneThreadOrTwo) {
  MixtureOptions options = MixtureFromRest();
  options.adam.epochs = 10;
  const auto run = [&](std::uint64_t seed, int threads) {
    options.seed = seed;
    const auto problem = TwoLengths(1e-3, 10);
    *problem =
        Changed(*problem, [&](EstimationOptions* o) { o->threads = threads; });
    return FitGaussianMixture(*problem, options).kernels.Pack();
  };
  const Eigen::VectorXd one = run(1, 1);
  EXPECT_EQ(one, run(1, 1));
  EXPECT_EQ(one, run(1, 2));
  EXPECT_NE(one, run(2, 1));
}

TEST(FitGaussianMixture, OnlineTakesTheRunsAsTheyArrive) {
  MixtureOptions options = MixtureFromRest();
  options.online = true;
  const auto problem = TwoLengths(1e-3, 10);
  const MixtureFit result = FitGaussianMixture(*problem, options);
  ASSERT_EQ(result.epochs.size(), 151u);
  for (int epoch = 1; epoch <= 150; ++epoch) {
    EXPECT_EQ(result.epochs[epoch].rollouts, (epoch - 1) / 15 + 1);
  }
  // What arrives later makes no difference to what was before.
  auto changed = TwoLengths(1e-3, 10);
  std::vector<sysid::Run> runs;
  for (const auto& run : changed->runs()) runs.push_back(run->run);
  for (int i = 3; i < 10; ++i) runs[i] = runs[2];
  ShootingProblem other(changed->model(), changed->free(), runs,
                        changed->options());
  const MixtureFit second = FitGaussianMixture(other, options);
  EXPECT_EQ(result.epochs[45].kernels.means, second.epochs[45].kernels.means);
  EXPECT_NE(result.epochs[46].kernels.means, second.epochs[46].kernels.means);
}

TEST(FitGaussianMixture, OnlineCutsOneLongRunIntoTen) {
  const Model model = Shipped("pendulum2");
  EstimationOptions given;
  given.noise = 1e-3;
  given.rollout.step = 0.04;
  ShootingProblem problem(model, FreeFrom(model, {{"link1.length", 0.45}}),
                          ReleasedRuns(model, 1, 10.0, 1e-3, 1), given);
  MixtureOptions options;
  options.online = true;
  options.draws = 2;
  const MixtureFit result = FitGaussianMixture(problem, options);
  EXPECT_EQ(result.epochs.back().rollouts, 10);
  EXPECT_NEAR(result.fit.segment_s, 1.0, 0.05);
  EXPECT_THAT(result.remarks,
              Contains(HasSubstr(
                  "--online cut the runs into 10 rollouts of about 1 s")));
}

TEST(FitGaussianMixture, SaysWhereKernelsCollapse) {
  const auto problem = TwoLengths(1e-3, 1);
  MixtureOptions options = MixtureFromRest();
  options.adam.schedule = Schedule::kConstant;
  options.adam.learning_rate = 0.3;
  options.adam.epochs = 600;
  const MixtureFit result = FitGaussianMixture(*problem, options);
  EXPECT_THAT(result.remarks,
              Contains(testing::AnyOf(HasSubstr("has lost its weight"),
                                      HasSubstr("has collapsed"))));
}

TEST(FitGaussianMixture, KeepsLengthsPositiveAndSaysSo) {
  const auto problem = TwoLengths();
  MixtureOptions options = MixtureFromRest();
  options.spread = 1.0;  // a third of Gaussian lengths would be negative
  const MixtureFit result = FitGaussianMixture(*problem, options);
  EXPECT_GT(result.beyond_bounds, 0);
  EXPECT_THAT(result.remarks, Contains(HasSubstr("a negative length")));
  for (const MixtureEpoch& epoch : result.epochs) {
    EXPECT_GT(epoch.kernels.means.minCoeff(), 0.0);
  }
}

// A wide belief about a damping holds values that the step cannot follow.
TEST(FitGaussianMixture, LeavesFailedDrawsOutAndCountsThem) {
  const auto problem = StiffDamping(0.05, 0.002, 1.0);
  MixtureOptions options = MixtureFromRest();
  options.spread = 2.0;
  options.adam.epochs = 30;
  const MixtureFit result = FitGaussianMixture(*problem, options);
  EXPECT_GT(result.failed_draws, 0);
  EXPECT_LT(result.failed_draws, result.draws);
  EXPECT_THAT(result.remarks, Contains(HasSubstr("their rollouts failed")));
  EXPECT_TRUE(result.mixture.means.allFinite());
}

// One gradient of 1e30 would be the last that Adam hears of.
TEST(FitGaussianMixture, IsNotStoppedByDrawsThatAllButFail) {
  const auto problem = TwoDampings({{"link1.length", 0.6},
                                    {"joint1.damping", 0.01},
                                    {"joint2.damping", 0.01}},
                                   0.4);
  MixtureOptions options = MixtureFromRest();
  options.spread = 0.5;
  options.adam.epochs = 100;
  const MixtureFit result = FitGaussianMixture(*problem, options);
  EXPECT_GT(result.clipped_epochs, 0);
  EXPECT_THAT(result.remarks, Contains(HasSubstr("was cut")));
  const auto length_at = [&](int epoch) {
    return result.epochs[epoch].kernels.Mean()[0];
  };
  EXPECT_GT(std::abs(length_at(80) - length_at(40)), 1e-3);
}

TEST(FitGaussianMixture, SaysWhereItDiverges) {
  const auto problem = StiffDamping(1e30, 0.04, 2.0);
  const MixtureFit result = FitGaussianMixture(*problem, MixtureFromRest());
  EXPECT_FALSE(result.fit.converged);
  EXPECT_THAT(result.fit.termination, HasSubstr("fail"));
}

TEST(SampleParameters, AreDrawsOfTheMixtureWithinTheBounds) {
  const auto problem = TwoLengths();
  MixtureOptions options = MixtureFromRest();
  options.adam.epochs = 30;
  const MixtureFit result = FitGaussianMixture(*problem, options);
  constexpr int kDraws = 4000;
  const Eigen::MatrixXd draws =
      SampleParameters(*problem, result.kernels, kDraws, 7);
  EXPECT_EQ(draws, SampleParameters(*problem, result.kernels, kDraws, 7));
  EXPECT_GT(draws.minCoeff(), 0.0);
  for (int i = 0; i < 2; ++i) {
    const double mean = draws.col(i).mean();
    const double std = std::sqrt((draws.col(i).array() - mean).square().mean());
    EXPECT_NEAR(mean, result.mixture.Mean()[i],
                5 * result.mixture.Std()[i] / std::sqrt(kDraws));
    EXPECT_NEAR(std, result.mixture.Std()[i], 0.1 * result.mixture.Std()[i]);
  }
}

// The Jacobian at either does not know of the other.
TEST(FitGaussianMixture, CallsUnidentifiableWhatItsKernelsDisagreeIn) {
  const auto lm = TwoCentresOfMass(), gmm = TwoCentresOfMass();
  EXPECT_THAT(FitLevenbergMarquardt(*lm).not_identifiable, IsEmpty());
  MixtureOptions options = MixtureFromRest();
  options.adam.epochs = 5;  // before one of the two has all the kernels
  options.seed = 5;
  const MixtureFit result = FitGaussianMixture(*gmm, options);
  EXPECT_THAT(result.disagreeing, ElementsAre("bob.com_z"));
  EXPECT_THAT(result.fit.not_identifiable,
              ElementsAre(ElementsAre("bob.com_z")));
  const ParameterEstimate& estimate = EstimateOf(result.fit, "bob.com_z");
  EXPECT_FALSE(estimate.identifiable);
  EXPECT_TRUE(std::isnan(estimate.std_error));
}

// Item 4 of what this has to show: neither is fooled.
TEST(CoupledParameters, AreSaidToBeIndistinguishableByAllSolvers) {
  for (int seed = 1; seed <= 5; ++seed) {
    const auto lm = RodAndBob(), adam = RodAndBob(), gmm = RodAndBob();
    const auto both =
        ElementsAre(UnorderedElementsAre("rod.length", "bob.com_z"));
    EXPECT_THAT(FitLevenbergMarquardt(*lm).not_identifiable, both);
    EXPECT_THAT(FitAdam(*adam, FromRest()).not_identifiable, both);
    MixtureOptions options = MixtureFromRest();
    options.seed = seed;
    const MixtureFit mixture = FitGaussianMixture(*gmm, options);
    EXPECT_THAT(mixture.fit.not_identifiable, both);
    // By its own kernels, too.
    EXPECT_THAT(mixture.disagreeing,
                UnorderedElementsAre("rod.length", "bob.com_z"))
        << "seed " << seed;
    const double distance =
        mixture.mixture.Mean()[0] - mixture.mixture.Mean()[1];
    EXPECT_NEAR(distance, 0.75, 0.02 * 0.75);
  }
}

}  // namespace
}  // namespace sysid
