#include "sysid/stochastic/rollout_gradient.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <thread>

#include "sysid/estimation/segmentation.h"
#include "sysid/stochastic/gaussian_mixture.h"
#include "tests/support/all_joints.h"
#include "tests/support/fit_setup.h"
#include "tests/support/measured_run.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/tape_gradient.h"

namespace sysid {
namespace {

using Eigen::VectorXd;

// Every parameter of a model, those of its effects included, but for the whole
// numbers, free to move from where it is.
std::vector<FreeParameter> FreeAll(const Model& model) {
  std::vector<FreeParameter> free;
  for (const Parameter& parameter : AllParameters(model)) {
    if (parameter.kind == ParameterKind::kEffect &&
        model.effects().parameters()[parameter.index].whole) {
      continue;
    }
    // A scale and what it scales are one thing; massless frames have neither.
    if (parameter.kind == ParameterKind::kInertiaScale) continue;
    const bool of_link = parameter.kind == ParameterKind::kInertia ||
                         parameter.kind == ParameterKind::kMass;
    if (of_link && model.nominal().links[parameter.index].mass == 0) continue;
    FreeParameter f;
    f.parameter = parameter;
    f.initial = parameter.nominal;
    f.lower = parameter.lower;
    f.upper = parameter.upper;
    free.push_back(f);
  }
  return free;
}

// A problem about a random motion of a model, first states given, cut in two.
struct Motion {
  std::unique_ptr<ShootingProblem> problem;
  std::unique_ptr<Rollouts> rollouts;
  std::unique_ptr<Transformation> transformation;

  Motion(const Model& model, std::vector<FreeParameter> free, int seed,
         Integrator integrator = Integrator::kRungeKutta4) {
    constexpr int kSamples = 7;
    Random random(seed);
    const struct RandomState at(model.mechanism(), &random);
    VectorXd x0(model.state_size());
    x0 << at.q, at.qd;
    const sysid::Run run =
        MeasureEverything(model, x0, kSamples, 0.004, 0.05, &random);
    EstimationOptions options;
    options.rollout = {integrator, 0.002};
    options.noise = 0.05;
    problem = std::make_unique<ShootingProblem>(
        model, std::move(free), std::vector<sysid::Run>{run}, options);
    Solution point;
    point.theta = problem->InitialTheta();
    const RowMatrixXd states = StatesOf(model, run, x0, options.rollout);
    Solution::Nodes nodes;
    nodes.samples = {0, 3, kSamples - 1};
    nodes.states.resize(2, states.cols());
    nodes.states << states.row(0), states.row(3);
    point.runs.push_back(nodes);
    rollouts = std::make_unique<Rollouts>(problem.get(), point);
    transformation = std::make_unique<Transformation>(*problem);
  }

  bool Gradient(double huber, const VectorXd& v, double* loss,
                VectorXd* gradient) const {
    RolloutSums sums;
    Eigen::ArrayXXd row;
    int failed = 0;
    const bool ok =
        MeanLossGradient(*rollouts, rollouts->size(), *transformation, huber,
                         v.transpose(), &sums, loss, &failed, &row);
    if (ok) *gradient = row.row(0).matrix();
    return ok;
  }
  VectorXd Gradient(double huber, const VectorXd& v, double* loss) const {
    VectorXd gradient;
    EXPECT_TRUE(Gradient(huber, v, loss, &gradient));
    return gradient;
  }
  VectorXd TapeGradient(double huber, const VectorXd& v, double* loss) const {
    VectorXd gradient;
    EXPECT_TRUE(LossGradientByTape(*rollouts, *transformation, huber, v, loss,
                                   &gradient));
    return gradient;
  }
  // Of the mean loss of a mixture's draws, by GaussianMixture::Pack().
  VectorXd MixtureGradient(double huber, const SoftDraws& draws, double* loss,
                           int* failed, RolloutSums* sums) const {
    Eigen::ArrayXXd by_v;
    EXPECT_TRUE(MeanLossGradient(*rollouts, rollouts->size(), *transformation,
                                 huber, draws.v(), sums, loss, failed, &by_v));
    return draws.Gradient(by_v);
  }
  double Loss(const VectorXd& v, double huber) const {
    return rollouts->Loss(rollouts->size(), transformation->Theta(v), huber);
  }
  int Samples() const { return rollouts->Samples(rollouts->size()); }

  // (9.1) with squares differentiated by Jets alone.
  VectorXd GradientByJets(const VectorXd& v) const {
    const VectorXd theta = transformation->Theta(v);
    VectorXd gradient = VectorXd::Zero(v.size());
    for (int i = 0; i < rollouts->size(); ++i) {
      VectorXd r(rollouts->num_errors(i));
      RowMatrixXd J;
      EXPECT_TRUE(rollouts->Linearize(i, theta.data(), r.data(), &J));
      for (const Rollouts::Group& group : rollouts->groups(i)) {
        gradient += 2.0 * group.weight * group.weight *
                    J.middleRows(group.first, group.size).transpose() *
                    r.segment(group.first, group.size);
      }
    }
    return gradient.cwiseProduct(transformation->Slope(v)) / Samples();
  }
};

VectorXd SmallStep(int n, int seed) {
  Random random(seed);
  return 0.01 * random.NormalVector(n);
}

void ExpectStanAgreesWithJets(const Model& model, int seed) {
  for (const Integrator integrator :
       {Integrator::kRungeKutta4, Integrator::kSemiImplicitEuler}) {
    const Motion motion(model, FreeAll(model), seed, integrator);
    const VectorXd v = SmallStep(motion.transformation->size(), seed);
    double loss = 0.0, loss_tape = 0.0;
    const VectorXd jets = motion.GradientByJets(v);
    const double infinity = std::numeric_limits<double>::infinity();
    const VectorXd node = motion.Gradient(infinity, v, &loss);
    const VectorXd tape = motion.TapeGradient(infinity, v, &loss_tape);
    ASSERT_GT(jets.norm(), 0.0);
    EXPECT_LT((node - jets).norm(), 1e-9 * jets.norm()) << "seed " << seed;
    EXPECT_LT((tape - jets).norm(), 1e-9 * jets.norm()) << "seed " << seed;
    for (int i = 0; i < v.size(); ++i) {
      EXPECT_NEAR(tape[i], jets[i],
                  1e-9 * std::max(std::abs(jets[i]), 1e-3 * jets.norm()))
          << motion.problem->free()[i].parameter.name;
    }
    EXPECT_NEAR(loss, loss_tape, 1e-12 * loss);
    EXPECT_NEAR(loss, motion.Loss(v, infinity), 1e-12 * loss);
  }
}

Model WithEveryEffect(const Mechanism& mechanism, int seed) {
  Model model(mechanism);
  Random random(seed);
  AddEveryEffect(Catalogue(), &random, &model);
  return model;
}

TEST(RolloutGradient, EqualsJetsWithEveryEffectOfTheCatalogue) {
  const Model model = WithEveryEffect(AllJoints(), 1);
  std::set<std::string> there;
  for (int i = 0; i < model.effects().size(); ++i) {
    there.insert(model.effects().effect(i).kind());
  }
  for (const std::string& name : Catalogue().Candidates(model.mechanism())) {
    const std::string kind = name.substr(0, name.find('@'));
    // Coulomb friction lives in Stribeck friction, which takes its place.
    if (kind == "coulomb_friction") continue;
    EXPECT_EQ(there.count(kind), 1u) << kind;
  }
  ExpectStanAgreesWithJets(model, 1);
}

TEST(RolloutGradient, EqualsJetsWithCoulombFriction) {
  Model model(AllJoints());
  const Catalogue catalogue;
  for (const char* joint : {"slide", "ball", "hinge", "wheel"}) {
    const std::string name = joint;
    model.AddEffect(
        catalogue.Make("coulomb_friction@" + name, model.mechanism(), "test"));
    model.SetEffectParameter(name + ".friction", 0.1);
  }
  ExpectStanAgreesWithJets(model, 2);
}

TEST(RolloutGradient, EqualsJetsOnRandomTreesWithEveryEffect) {
  for (int number = 1; number <= 5; ++number) {
    Random random(number);
    const Mechanism tree = RandomTree(number, &random);
    ExpectStanAgreesWithJets(WithEveryEffect(tree, number), number);
  }
}

TEST(RolloutGradient, OfTheHuberLossIsTheSameBothWays) {
  const Model model = WithEveryEffect(AllJoints(), 3);
  const Motion motion(model, FreeAll(model), 3);
  const VectorXd v = SmallStep(motion.transformation->size(), 3);
  // About half of the measurements are beyond the threshold.
  constexpr double kHuber = 0.06;
  double loss = 0.0, other = 0.0;
  const VectorXd node = motion.Gradient(kHuber, v, &loss);
  const VectorXd tape = motion.TapeGradient(kHuber, v, &other);
  EXPECT_LT((node - tape).norm(), 1e-9 * tape.norm());
  EXPECT_NEAR(loss, other, 1e-12 * loss);
  EXPECT_NEAR(loss, motion.Loss(v, kHuber), 1e-12 * loss);
  EXPECT_LT(loss,
            0.95 * motion.Loss(v, std::numeric_limits<double>::infinity()));
}

// Two lengths, of which one has a prior.
struct Pendulum : Motion {
  static std::vector<FreeParameter> Free(const Model& model) {
    std::vector<FreeParameter> free =
        FreeFrom(model, {{"link1.length", 0.6}, {"link2.length", 0.4}});
    free[1].prior = FreeParameter::Prior{0.45, 0.1};
    return free;
  }
  Pendulum() : Motion(Shipped("pendulum2"), Free(Shipped("pendulum2")), 1) {}
};

TEST(RolloutGradient, IsTheSlopeOfTheLossWithAPrior) {
  const Pendulum pendulum;
  const VectorXd v = SmallStep(2, 1);
  double loss = 0.0;
  const VectorXd gradient = pendulum.Gradient(0.02, v, &loss);
  for (int i = 0; i < 2; ++i) {
    constexpr double kStep = 1e-6;
    VectorXd more = v, less = v;
    more[i] += kStep;
    less[i] -= kStep;
    double up = 0.0, down = 0.0;
    pendulum.Gradient(0.02, more, &up);
    pendulum.Gradient(0.02, less, &down);
    EXPECT_NEAR(gradient[i], (up - down) / (2 * kStep), 1e-6 * gradient.norm());
  }
  // By the definition: noise^2 (theta - mean)^2 / std^2, over N samples.
  const Eigen::VectorXd theta = pendulum.transformation->Theta(v);
  double errors_only = 0.0;
  Motion without(Shipped("pendulum2"),
                 FreeFrom(Shipped("pendulum2"),
                          {{"link1.length", 0.6}, {"link2.length", 0.4}}),
                 1);
  without.Gradient(0.02, v, &errors_only);
  EXPECT_NEAR(loss - errors_only,
              std::pow(0.05 * (theta[1] - 0.45) / 0.1, 2) / pendulum.Samples(),
              1e-12);
}

TEST(RolloutGradient, OfTheMixtureIsTheSlopeOfItsMeanLoss) {
  const Pendulum pendulum;
  std::mt19937_64 random(5);
  GaussianMixture mixture = StartingMixture(3, 2, 0.2, &random);
  mixture.logits << 0.3, -0.2, 0.1;
  MixtureNoise noise;
  DrawNoise(4, 3, 2, &random, &noise);
  const VectorXd at = mixture.Pack();
  constexpr double kHuber = 0.05;
  SoftDraws draws;
  const auto evaluate = [&](const VectorXd& packed, VectorXd* gradient) {
    GaussianMixture moved = mixture;
    moved.Unpack(packed);
    draws.Draw(moved, noise, 2.0 / 3.0);
    RolloutSums sums;
    double loss = 0.0;
    int failed = -1;
    *gradient = pendulum.MixtureGradient(kHuber, draws, &loss, &failed, &sums);
    EXPECT_EQ(failed, 0);
    return loss;
  };
  VectorXd gradient, unused;
  evaluate(at, &gradient);
  ASSERT_EQ(gradient.size(), 3 + 6 + 6);
  Eigen::ArrayXXd by_v(draws.count(), 2);
  for (int d = 0; d < draws.count(); ++d) {
    double loss = 0.0;
    const VectorXd v = draws.v().row(d).matrix();
    by_v.row(d) = pendulum.TapeGradient(kHuber, v, &loss).transpose().array();
  }
  const VectorXd tape = draws.Gradient(by_v / draws.count());
  EXPECT_LT((gradient - tape).norm(), 1e-9 * tape.norm());
  for (int i = 0; i < at.size(); ++i) {
    constexpr double kStep = 1e-5;
    VectorXd more = at, less = at;
    more[i] += kStep;
    less[i] -= kStep;
    const double slope =
        (evaluate(more, &unused) - evaluate(less, &unused)) / (2 * kStep);
    EXPECT_NEAR(gradient[i], slope, 1e-6 * gradient.norm()) << i;
  }
}

// As many steps as are worth a thread, so that there are two.
TEST(RolloutGradient, ByThreadsIsTheSameToTheLastBit) {
  const Pendulum pendulum;
  std::mt19937_64 random(6);
  const GaussianMixture mixture = StartingMixture(3, 2, 0.1, &random);
  RolloutSums kept;
  for (int round = 0; round < 5; ++round) {
    MixtureNoise noise;
    DrawNoise(7, 3, 2, &random, &noise);
    SoftDraws draws;
    draws.Draw(mixture, noise, 2.0 / 3.0);
    std::vector<double> losses;
    std::vector<VectorXd> gradients;
    for (const int threads : {1, 2, 3}) {
      *pendulum.problem = Changed(*pendulum.problem, [&](EstimationOptions* o) {
        o->rollout.step = 1e-5;
        o->threads = threads;
      });
      double loss = 0.0;
      int failed = 0;
      RolloutSums own;
      gradients.push_back(pendulum.MixtureGradient(
          0.05, draws, &loss, &failed, threads == 2 ? &kept : &own));
      losses.push_back(loss);
      gradients.push_back(
          pendulum.Gradient(0.05, draws.v().row(0).matrix(), &loss));
      losses.push_back(loss);
    }
    for (size_t i = 2; i < losses.size(); ++i) {
      EXPECT_EQ(losses[i], losses[i - 2]);
      EXPECT_EQ(gradients[i], gradients[i - 2]);
    }
  }
}

// Stan's tape belongs to a thread, and not every one is born with it.
TEST(RolloutGradient, IsTheSameOnAnotherThread) {
  const Pendulum pendulum;
  const VectorXd v = SmallStep(2, 3);
  double here = 0.0, there = 0.0;
  const VectorXd own = pendulum.Gradient(0.1, v, &here);
  VectorXd other;
  std::thread([&] { other = pendulum.Gradient(0.1, v, &there); }).join();
  EXPECT_EQ(own, other);
  EXPECT_EQ(here, there);
}

TEST(RolloutGradient, SaysWhereTheDynamicsFail) {
  Model model = Shipped("pendulum2", {"viscous_damping@joint1"});
  const Motion motion(model, FreeFrom(model, {{"joint1.damping", 0.01}}), 1);
  // Far too stiff for the step: the rollout overflows.
  const VectorXd v = VectorXd::Constant(1, 60.0);
  VectorXd gradient;
  double loss = 0.0;
  EXPECT_FALSE(motion.Gradient(0.1, v, &loss, &gradient));
}

// A draw that fails takes no part, and leaves no trace in the others'.
TEST(RolloutGradient, LeavesOutDrawsThatFail) {
  Model model = Shipped("pendulum2", {"viscous_damping@joint1"});
  const Motion motion(model, FreeFrom(model, {{"joint1.damping", 0.01}}), 1);
  GaussianMixture mixture;
  mixture.logits = Eigen::VectorXd::Zero(1);
  mixture.means = Eigen::MatrixXd::Zero(1, 1);
  mixture.log_deviations = Eigen::MatrixXd::Zero(1, 1);
  const auto evaluate = [&](const std::vector<double>& v, double* loss,
                            int* failed) {
    MixtureNoise noise;
    noise.gumbel = Eigen::ArrayXXd::Zero(v.size(), 1);
    noise.normal = Eigen::Map<const Eigen::ArrayXd>(v.data(), v.size());
    SoftDraws draws;
    draws.Draw(mixture, noise, 1.0);
    RolloutSums sums;
    return motion.MixtureGradient(std::numeric_limits<double>::infinity(),
                                  draws, loss, failed, &sums);
  };
  double loss = 0.0, without = 0.0;
  int failed = 0, none = 0;
  const VectorXd some = evaluate({0.1, 60.0, 0.3}, &loss, &failed);
  const VectorXd good = evaluate({0.1, 0.3}, &without, &none);
  EXPECT_EQ(failed, 1);
  EXPECT_EQ(none, 0);
  EXPECT_NEAR(loss, without, 1e-14 * without);
  EXPECT_LT((some - good).norm(), 1e-14 * good.norm());
}

// However many epochs follow, each has what the first had, and leaves nothing.
TEST(RolloutGradient, LeavesNothingOnTheTape) {
  const Pendulum pendulum;
  std::mt19937_64 random(1);
  const GaussianMixture mixture = StartingMixture(3, 2, 0.1, &random);
  const VectorXd v = VectorXd::Zero(2);
  MixtureNoise noise;
  SoftDraws draws;
  RolloutSums sums;
  const auto epoch = [&] {
    std::vector<std::size_t> used;
    double loss = 0.0;
    pendulum.Gradient(0.1, v, &loss);
    EXPECT_EQ(LastTapeUse().nodes_left, 0u);
    used.push_back(LastTapeUse().last_call);
    int failed = 0;
    DrawNoise(8, 3, 2, &random, &noise);
    draws.Draw(mixture, noise, 2.0 / 3.0);
    pendulum.MixtureGradient(0.1, draws, &loss, &failed, &sums);
    EXPECT_EQ(LastTapeUse().nodes_left, 0u);
    used.push_back(LastTapeUse().last_call);
    return used;
  };
  const std::vector<std::size_t> first = epoch();
  EXPECT_GT(first[0], 0u);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(epoch(), first);
}

}  // namespace
}  // namespace sysid
