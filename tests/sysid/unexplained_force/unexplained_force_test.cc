#include "sysid/unexplained_force/unexplained_force.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "models/effects/coulomb_friction.h"
#include "models/state.h"
#include "sysid/unexplained_force/where.h"
#include "tests/support/measured_run.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// A fitted model and the force that it lacks.
struct Sought {
  Sought(const Model& model, const std::vector<Value>& free,
         const std::vector<sysid::Run>& runs, double noise = kSetupNoise)
      : evaluated(model) {
    DiagnosisProblem problem = MakeProblem(model, free, runs);
    problem.options.noise = noise;
    problem.SetRuns(RunsOf(*problem.train), RunsOf(*problem.holdout));
    evaluated = EvaluateGiven(problem);
    force = FindWhere(*evaluated.problem, evaluated.fit);
  }

  const JointForce& Of(const std::string& joint) const {
    for (const JointForce& f : force.joints) {
      if (f.joint == joint) return f;
    }
    ADD_FAILURE() << "no force of " << joint;
    return force.joints.front();
  }
  // The regressors of a joint, best first.
  std::vector<ForceRegression> LawsOf(const std::string& joint) const {
    std::vector<ForceRegression> laws;
    for (const ForceRegression& law : force.regression) {
      if (law.joint == joint) laws.push_back(law);
    }
    return laws;
  }

  EvaluatedModel evaluated;
  Where force;
};

// Two runs to fit after one to hold out, from these seeds.
std::vector<sysid::Run> RunsOf(const Model& truth, int seed,
                               const Recording& recording) {
  std::vector<sysid::Run> runs;
  for (int i = 0; i < 3; ++i) {
    runs.push_back(Record(truth, seed + i, recording));
  }
  return runs;
}

// The true state at a time, by its neighbours in a run of the truth.
VectorXd StateAt(const Model& truth, const sysid::Run& run,
                 const RowMatrixXd& states, double t) {
  const int k = std::clamp<int>(
      static_cast<int>(std::upper_bound(run.t.begin(), run.t.end(), t) -
                       run.t.begin()) -
          1,
      0, run.size() - 2);
  const double part = (t - run.t[k]) / (run.t[k + 1] - run.t[k]);
  const VectorXd x0 = states.row(k), x1 = states.row(k + 1);
  VectorXd dx(truth.tangent_size()), x(truth.state_size());
  BoxMinus<double>(truth, x1.data(), x0.data(), dx.data());
  dx *= part;
  BoxPlus<double>(truth, x0.data(), dx.data(), x.data());
  return x;
}

RowMatrixXd TrueStates(const Model& truth, const sysid::Run& run, int seed,
                       const Recording& recording) {
  return StatesOf(truth, run, RandomState(truth, recording.amplitude, seed),
                  {.step = 1e-3});
}

double Dry(double c, double, double qd);

struct Planted {
  std::string robot;
  std::vector<Value> free;
  std::string effect;
  Value value;
  std::string joint, first;  // where it acts, and the regressor to be named
  double sign;
  double level;  // of efforts
  double noise;
  double (*law)(double p, double q, double qd);  // on the joint
};

class Force : public testing::TestWithParam<Planted> {};

TEST_P(Force, IsThatOfThePlantedLaw) {
  const Planted& planted = GetParam();
  const Model model = Shipped(planted.robot);
  const Model truth = Shipped(planted.robot, {planted.effect}, {planted.value});
  Recording recording;
  recording.amplitude = 0.7;
  recording.level = planted.level;
  recording.noise = planted.noise;
  const int seed = 11;
  const std::vector<sysid::Run> runs = RunsOf(truth, seed, recording);
  const Sought sought(model, planted.free, runs, planted.noise);
  const Mechanism& mechanism = model.mechanism();
  const Joint& joint = mechanism.joints[mechanism.FindJoint(planted.joint)];
  // On that joint and no other.
  for (const JointForce& f : sought.force.joints) {
    EXPECT_EQ(f.significant, f.joint == planted.joint)
        << f.joint << ": " << f.rms << " +- " << f.std << ", p " << f.p_value
        << ", share " << f.share;
  }
  // Along the true motion, of the right size.
  double both = 0.0, found = 0.0, true2 = 0.0;
  int curves = 0;
  for (const ForceCurve& curve : sought.force.force) {
    if (curve.joint != planted.joint) continue;
    ++curves;
    EXPECT_EQ(curve.unit, joint.type == JointType::kPrismatic ? "N" : "N m");
    const int index = curve.trajectory == runs[1].name ? 1 : 2;
    ASSERT_EQ(curve.trajectory, runs[index].name);
    const RowMatrixXd states =
        TrueStates(truth, runs[index], seed + index, recording);
    EXPECT_DOUBLE_EQ(curve.t.front(), runs[index].t.front());
    EXPECT_NEAR(curve.t.back(), runs[index].t.back(), 1e-9);
    for (size_t k = 0; k < curve.t.size(); ++k) {
      const VectorXd x = StateAt(truth, runs[index], states, curve.t[k]);
      const double law = planted.law(planted.value.value, x[joint.q_index],
                                     x[mechanism.nq + joint.v_index]);
      both += law * curve.value[k];
      found += curve.value[k] * curve.value[k];
      true2 += law * law;
      EXPECT_GT(curve.std[k], 0.0);
    }
  }
  EXPECT_EQ(curves, 2);
  // A force that is linear between its knots rounds the corners of dry
  // friction, and is what the load needs where that holds the joint.
  const bool dry = planted.law == Dry;
  EXPECT_GT(both / std::sqrt(found * true2), dry ? 0.93 : 0.95);
  EXPECT_NEAR(both / true2, 1.0, dry ? 0.15 : 0.1);
  const std::vector<ForceRegression> laws = sought.LawsOf(planted.joint);
  ASSERT_GE(laws.size(), 7u);
  EXPECT_EQ(laws[0].regressor, planted.first);
  EXPECT_GT(laws[0].r2, dry ? 0.8 : 0.9);
  EXPECT_NEAR(laws[0].coefficients[0], planted.sign * planted.value.value,
              0.1 * planted.value.value);
  EXPECT_EQ(laws[0].label, planted.first == "constant" ? "a constant"
                           : planted.sign < 0          ? "-" + planted.first
                                                       : planted.first);
}

double Viscous(double d, double, double qd) { return -d * qd; }
double Quadratic(double b, double, double qd) { return -b * std::abs(qd) * qd; }
double Dry(double c, double, double qd) {
  return -c * qd / std::hypot(qd, FrictionSmoothingSpeed(false));
}
double Bias(double b, double, double) { return b; }

INSTANTIATE_TEST_SUITE_P(
    Laws, Force,
    testing::Values(Planted{"pendulum2_planar",
                            {{"link1.length", 0.52}, {"link2.length", 0.48}},
                            "viscous_damping@joint1",
                            {"joint1.damping", 0.05},
                            "joint1",
                            "velocity",
                            -1,
                            0,
                            1e-3,
                            Viscous},
                    Planted{"pendulum2_planar",
                            {{"link1.length", 0.52}, {"link2.length", 0.48}},
                            "coulomb_friction@joint2",
                            {"joint2.friction", 0.01},
                            "joint2",
                            "sign(velocity)",
                            -1,
                            0,
                            1e-4,
                            Dry},
                    Planted{"pendulum2_planar",
                            {},
                            "quadratic_drag@joint2",
                            {"joint2.quadratic_drag", 0.02},
                            "joint2",
                            "|velocity| velocity",
                            -1,
                            0,
                            1e-3,
                            Quadratic},
                    Planted{"pendulum2_planar",
                            {{"link2.length", 0.48}},
                            "effort_bias@joint1",
                            {"joint1.effort_bias", 0.1},
                            "joint1",
                            "constant",
                            1,
                            0,
                            1e-3,
                            Bias},
                    Planted{"cartpole",
                            {},
                            "coulomb_friction@hinge",
                            {"hinge.friction", 0.01},
                            "hinge",
                            "sign(velocity)",
                            -1,
                            0.2,  // else the pole soon rests
                            1e-3,
                            Dry},
                    Planted{"cartpole",
                            {},
                            "viscous_damping@slider",
                            {"slider.damping", 0.5},
                            "slider",
                            "velocity",
                            -1,
                            0.2,
                            1e-3,
                            Viscous},
                    Planted{"cartpole",
                            {},
                            "effort_bias@slider",
                            {"slider.effort_bias", 0.2},
                            "slider",
                            "constant",
                            1,
                            0,
                            1e-3,
                            Bias}),
    [](const auto& info) {
      std::string name = info.param.robot + "_" + info.param.effect;
      std::replace(name.begin(), name.end(), '@', '_');
      return name;
    });

TEST(UnexplainedForce, OfASphericalJointIsInTheChildsAxes) {
  const double damping = 0.03;
  const Model model = Shipped("pendulum1");
  const Model truth = Shipped("pendulum1", {"viscous_damping@joint1"},
                              {{"joint1.damping", damping}});
  Recording recording;
  recording.amplitude = 0.7;
  const std::vector<sysid::Run> runs = RunsOf(truth, 21, recording);
  const Sought sought(model, {}, runs);
  EXPECT_TRUE(sought.Of("joint1").significant);
  EXPECT_EQ(sought.force.force.size(), 6u);
  double both = 0.0, found = 0.0, true2 = 0.0;
  for (const ForceCurve& curve : sought.force.force) {
    // The spin of the rod is nothing that headings show.
    if (curve.component == "z") {
      for (const double value : curve.value) EXPECT_LT(std::abs(value), 1e-3);
      continue;
    }
    const int c = curve.component == "x" ? 0 : 1;
    const int index = curve.trajectory == runs[1].name ? 1 : 2;
    const RowMatrixXd states =
        TrueStates(truth, runs[index], 21 + index, recording);
    for (size_t k = 0; k < curve.t.size(); ++k) {
      const VectorXd x = StateAt(truth, runs[index], states, curve.t[k]);
      const double law = -damping * x[model.nq() + c];
      both += law * curve.value[k];
      found += curve.value[k] * curve.value[k];
      true2 += law * law;
    }
  }
  EXPECT_GT(both / std::sqrt(found * true2), 0.95);
  EXPECT_NEAR(both / true2, 1.0, 0.1);
  const std::vector<ForceRegression> laws = sought.LawsOf("joint1");
  ASSERT_FALSE(laws.empty());
  EXPECT_EQ(laws[0].label, "-velocity");
  EXPECT_NEAR(laws[0].coefficients[0], -damping, 0.1 * damping);
}

TEST(UnexplainedForce, OfAWrongGainFollowsTheEffort) {
  const Model truth = Shipped("cartpole", {"effort_gain@slider"},
                              {{"slider.effort_gain", 0.2}});
  Recording recording;
  recording.amplitude = 0.5;
  recording.level = 0.3;
  const Sought sought(Shipped("cartpole"), {}, RunsOf(truth, 31, recording));
  EXPECT_TRUE(sought.Of("slider").significant);
  EXPECT_FALSE(sought.Of("hinge").significant);
  const std::vector<ForceRegression> laws = sought.LawsOf("slider");
  ASSERT_FALSE(laws.empty());
  EXPECT_EQ(laws[0].label, "effort");
  EXPECT_NEAR(laws[0].coefficients[0], 0.2, 0.02);
}

TEST(UnexplainedForce, IsNoneOfAnExactModel) {
  int tests = 0, alarms = 0;
  double squares = 0.0, count = 0.0, largest = 0.0;
  for (int seed = 1; seed <= 15; ++seed) {
    for (const char* robot : {"pendulum2_planar", "cartpole", "pendulum1"}) {
      const Model model = Shipped(robot);
      Recording recording;
      recording.duration = 2.0;
      recording.amplitude = 0.7;
      recording.level = robot == std::string("cartpole") ? 0.2 : 0.0;
      std::vector<Value> free;
      if (robot == std::string("pendulum2_planar")) {
        free.push_back({"link2.length", 0.52});
      }
      const Sought sought(model, free, RunsOf(model, 100 * seed, recording));
      for (const JointForce& f : sought.force.joints) {
        ++tests;
        if (f.p_value < 0.01) ++alarms;
        EXPECT_FALSE(f.significant && f.p_value < 1e-4) << robot << " " << seed;
      }
      for (const ForceCurve& curve : sought.force.force) {
        for (size_t k = 0; k < curve.t.size(); ++k) {
          const double z = curve.value[k] / curve.std[k];
          squares += z * z;
          count += 1.0;
          largest = std::max(largest, std::abs(z));
        }
      }
    }
  }
  EXPECT_EQ(tests, 15 * 5);
  EXPECT_LE(alarms, 3);  // of 75 at 1 % each
  EXPECT_LT(std::sqrt(squares / count), 1.1);
  EXPECT_LT(largest, 5.0);
}

// A sensor that is dead has next to no noise, and its weight is all there is:
// what can be solved for is finite, what cannot is not shown.
TEST(UnexplainedForce, IsFiniteWhereWeightsAreUnlike) {
  const Model model = Shipped("pendulum2_planar");
  std::vector<sysid::Run> runs = RunsOf(model, 1, {});
  for (sysid::Run& run : runs) run.channels[1].values.setConstant(0.1);
  const Sought sought(model, {}, runs, 0.0);
  for (const JointForce& joint : sought.force.joints) {
    EXPECT_TRUE(std::isfinite(joint.rms)) << joint.joint;
  }
  for (const ForceCurve& curve : sought.force.force) {
    for (const double value : curve.value) ASSERT_TRUE(std::isfinite(value));
  }
}

// The values' errors beside their standard deviations.
TEST(UnexplainedForce, KnowsHowUncertainItIs) {
  const double damping = 0.02;
  double squares = 0.0, count = 0.0;
  for (int seed = 1; seed <= 5; ++seed) {
    const Model truth = Shipped("pendulum2_planar", {"viscous_damping@joint2"},
                                {{"joint2.damping", damping}});
    Recording recording;
    recording.amplitude = 0.7;
    const std::vector<sysid::Run> runs = RunsOf(truth, 100 * seed, recording);
    const Sought sought(Shipped("pendulum2_planar"), {}, runs);
    for (const ForceCurve& curve : sought.force.force) {
      if (curve.joint != "joint2") continue;
      const int index = curve.trajectory == runs[1].name ? 1 : 2;
      const RowMatrixXd states =
          TrueStates(truth, runs[index], 100 * seed + index, recording);
      for (size_t k = 0; k < curve.t.size(); ++k) {
        const VectorXd x = StateAt(truth, runs[index], states, curve.t[k]);
        squares +=
            std::pow((curve.value[k] + damping * x[3]) / curve.std[k], 2);
        count += 1.0;
      }
    }
  }
  EXPECT_GT(std::sqrt(squares / count), 0.5);
  EXPECT_LT(std::sqrt(squares / count), 1.5);
}

// Noise is no part of what a law is to explain, and what the prior smooths away
// is none of what it lacks.
TEST(UnexplainedForce, IsNotDilutedByNoise) {
  const double friction = 0.002;
  const Model truth = Shipped("pendulum2_planar", {"coulomb_friction@joint2"},
                              {{"joint2.friction", friction}});
  Recording recording;
  recording.amplitude = 0.7;
  recording.duration = 8.0;
  const Sought sought(Shipped("pendulum2_planar"), {},
                      RunsOf(truth, 51, recording));
  const JointForce& f = sought.Of("joint2");
  EXPECT_GT(f.std, 0.4 * f.rms);
  const std::vector<ForceRegression> laws = sought.LawsOf("joint2");
  ASSERT_FALSE(laws.empty());
  EXPECT_EQ(laws[0].label, "-sign(velocity)");
  EXPECT_GT(laws[0].r2, 0.95);
  EXPECT_NEAR(laws[0].coefficients[0], -friction, 0.05 * friction);
}

// What a free parameter can stand for is not missing: the same wrong length
// makes a force where it is held, and none where it is free.
TEST(UnexplainedForce, IsBesideTheFreeParameters) {
  const Model truth = Shipped("pendulum2_planar", {}, {{"link2.length", 0.55}});
  Recording recording;
  recording.amplitude = 0.7;
  const std::vector<sysid::Run> runs = RunsOf(truth, 41, recording);
  const Model model = Shipped("pendulum2_planar");
  const Sought held(model, {}, runs);
  EXPECT_TRUE(held.Of("joint1").significant || held.Of("joint2").significant);
  const Sought free(model, {{"link2.length", 0.5}}, runs);
  EXPECT_FALSE(free.Of("joint1").significant);
  EXPECT_FALSE(free.Of("joint2").significant);
}

}  // namespace
}  // namespace sysid
