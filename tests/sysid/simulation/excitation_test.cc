#include "sysid/simulation/excitation.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/simulation/simulate.h"
#include "tests/support/error_text.h"
#include "tests/sysid/simulation/arm_with_limits.h"

namespace sysid {
namespace {

using Eigen::VectorXd;

SimulationOptions WithinLimits(int seed) {
  SimulationOptions options;
  options.excitation = Excitation::kWithinLimits;
  options.noise = 1e-3;
  options.seed = seed;
  return options;
}

double Rms(const VectorXd& values) {
  return std::sqrt(values.squaredNorm() / values.size());
}

// The widest velocity between samples, of positions with little noise.
double Fastest(const VectorXd& q, double rate) {
  return rate *
         (q.tail(q.size() - 1) - q.head(q.size() - 1)).cwiseAbs().maxCoeff();
}

TEST(ExciteWithinLimits, KeepsAllOfThemWithAnySeed) {
  const Model model = ArmWithLimits();
  for (int seed = 1; seed <= 40; ++seed) {
    SimulationOptions options = WithinLimits(seed);
    options.noise = 1e-4;
    const sysid::Run run =
        Simulate(model, RandomState(model, 0.6, seed), options);
    for (const Body& body : model.bodies()) {
      const Joint& joint = model.mechanism().joints[body.joint];
      const VectorXd q = run.channels[body.v_index].values;
      EXPECT_GT(q.minCoeff(), joint.lower) << seed << " " << joint.name;
      EXPECT_LT(q.maxCoeff(), joint.upper) << seed << " " << joint.name;
      EXPECT_LE(run.effort.col(body.v_index).cwiseAbs().maxCoeff(),
                joint.effort_limit)
          << seed << " " << joint.name;
      // With the noise of two samples.
      EXPECT_LT(Fastest(q, options.rate), joint.velocity_limit + 0.1)
          << seed << " " << joint.name;
      // And does move.
      EXPECT_GT(q.maxCoeff() - q.minCoeff(), 0.15 * (joint.upper - joint.lower))
          << seed << " " << joint.name;
    }
  }
}

TEST(ExciteWithinLimits, BeginsAtTheStartAtRest) {
  const Model model = ArmWithLimits();
  VectorXd x0 = NearestToNeutral(model);
  x0.head(2) << -1.1, 2.1;
  SimulationOptions options = WithinLimits(1);
  options.noise = 0.0;
  const sysid::Run run = Simulate(model, x0, options);
  for (int j = 0; j < 2; ++j) {
    EXPECT_EQ(run.channels[j].values(0, 0), x0[j]);
    EXPECT_NEAR(run.channels[j].values(1, 0), x0[j], 1e-3);
  }
}

TEST(ExciteWithinLimits, MovesLessWithASmallerAmplitudeAboutTheStart) {
  const Model model = ArmWithLimits();
  VectorXd x0 = NearestToNeutral(model);
  x0.head(2) << 0.5, 0.8;
  SimulationOptions options = WithinLimits(3);
  options.excursion = 0.2;
  const sysid::Run run = Simulate(model, x0, options);
  for (int j = 0; j < 2; ++j) {
    const Joint& joint = model.mechanism().joints[j];
    const double half = 0.5 * (joint.upper - joint.lower);
    EXPECT_LT((run.channels[j].values.array() - x0[j]).abs().maxCoeff(),
              0.2 * half);
  }
}

TEST(ExciteWithinLimits, StaysInTheBand) {
  const Model model = ArmWithLimits();
  SimulationOptions options = WithinLimits(2);
  options.noise = 0.0;
  options.duration = 20.0;
  options.lowest_frequency = 0.5;
  options.highest_frequency = 1.0;
  const sysid::Run run = Simulate(model, RandomState(model, 0.3, 2), options);
  // Behind the blend, projected on sines outside and within.
  const VectorXd q = run.channels[0].values.bottomRows(1600);
  const VectorXd about = (q.array() - q.mean()).matrix();
  const auto part = [&](double low, double high) {
    double squares = 0.0;
    for (double f = low; f < high; f += 1.0 / 16.0) {
      double a = 0.0, b = 0.0;
      for (int k = 0; k < about.size(); ++k) {
        // Hann's window keeps neighbours apart.
        const double window = 1 - std::cos(2 * M_PI * k / about.size());
        a += window * about[k] * std::cos(2 * M_PI * f * k / 100.0);
        b += window * about[k] * std::sin(2 * M_PI * f * k / 100.0);
      }
      squares += a * a + b * b;
    }
    return squares;
  };
  EXPECT_GT(part(0.4, 1.1), 200 * (part(0.0, 0.3) + part(1.25, 4.0)));
}

TEST(ExciteWithinLimits, LeavesJointsWithoutLimitsAsTheyWere) {
  const Model model =
      MakeModel(LoadUrdf(FindModel("pendulum2_planar")), Catalogue());
  SimulationOptions options = WithinLimits(5);
  const VectorXd x0 = RandomState(model, 0.3, 5);
  const sysid::Run within = Simulate(model, x0, options);
  options.excitation = Excitation::kMultisine;
  const sysid::Run open = Simulate(model, x0, options);
  EXPECT_EQ(within.effort, open.effort);
  EXPECT_EQ(within.channels[1].values, open.channels[1].values);
}

// A cart on a rail with a pole that turns freely: the one follows, the other
// has the efforts of the open loop.
TEST(ExciteWithinLimits, DrivesBothKindsAtOnce) {
  const Model model = MakeModel(LoadUrdf(FindModel("cartpole")), Catalogue());
  for (int seed = 1; seed <= 10; ++seed) {
    SimulationOptions options = WithinLimits(seed);
    const VectorXd x0 = RandomState(model, 0.6, seed);
    const sysid::Run within = Simulate(model, x0, options);
    options.excitation = Excitation::kMultisine;
    const sysid::Run open = Simulate(model, x0, options);
    EXPECT_EQ(within.effort.col(1), open.effort.col(1));
    EXPECT_LT(within.channels[0].values.cwiseAbs().maxCoeff(), 2.0);
    EXPECT_GT(Rms(within.effort.col(0)), 0.1);
  }
}

TEST(ExciteWithinLimits, FollowsThroughFrictionAndDelay) {
  Model model = ArmWithLimits();
  const Catalogue catalogue;
  for (const char* effect :
       {"coulomb_friction@shoulder", "viscous_damping@elbow",
        "effort_delay@base", "effort_gain@shoulder"}) {
    model.AddEffect(catalogue.Make(effect, model.mechanism(), "test"));
  }
  model.SetEffectParameter("shoulder.friction", 0.5);
  model.SetEffectParameter("elbow.damping", 0.3);
  model.SetEffectParameter("effort_delay", 0.004);
  model.SetEffectParameter("shoulder.effort_gain", -0.1);
  const sysid::Run run =
      Simulate(model, RandomState(model, 0.6, 4), WithinLimits(4));
  for (int j = 0; j < 2; ++j) {
    const Joint& joint = model.mechanism().joints[j];
    EXPECT_GT(run.channels[j].values.minCoeff(), joint.lower);
    EXPECT_LT(run.channels[j].values.maxCoeff(), joint.upper);
  }
}

TEST(ExciteWithinLimits, SaysWhatNoExcursionKeeps) {
  Model model = ArmWithLimits();
  MechanismParameters<double> values = model.nominal();
  values.links[2].mass = 30.0;
  model.SetNominal(values);
  VectorXd x0 = NearestToNeutral(model);
  x0[1] = 1.5;
  EXPECT_THAT(
      ErrorText([&] { Simulate(model, x0, WithinLimits(1)); }),
      testing::AllOf(
          testing::StartsWith("--excite: no excursion, however small, keeps "
                              "the "),
          testing::HasSubstr("hint: start elsewhere (--initial), or give the "
                             "URDF other limits or masses")));
}

TEST(ExciteWithinLimits, RefusesToStartOutside) {
  const Model model = ArmWithLimits();
  VectorXd x0 = NearestToNeutral(model);
  x0[0] = 1.5;
  EXPECT_EQ(ErrorText([&] { Simulate(model, x0, WithinLimits(1)); }),
            "--initial: joint 'shoulder' starts at 1.5, outside of its limits "
            "-1.2 to 1\n  hint: start within them");
}

}  // namespace
}  // namespace sysid
