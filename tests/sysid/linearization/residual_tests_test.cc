#include "sysid/linearization/residual_tests.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

struct Fitted {
  Fitted(const Model& model, const std::vector<Value>& free,
         const std::vector<sysid::Run>& runs)
      : evaluated(EvaluateGiven(MakeProblem(model, free, runs))),
        fit(*evaluated.problem, evaluated.fit.point) {}
  EvaluatedModel evaluated;
  LinearizedFit fit;
};

std::vector<sysid::Run> RunsOf(const Model& truth, int seed, double level,
                               double duration) {
  Recording recording;
  recording.duration = duration;
  recording.amplitude = 0.7;
  recording.level = level;
  std::vector<sysid::Run> runs;
  for (int i = 0; i < 3; ++i) {
    runs.push_back(Record(truth, seed + i, recording));
  }
  return runs;
}

// p-values that are uniform: of `p` below x there are about x.
void ExpectUniform(std::vector<double> p) {
  std::sort(p.begin(), p.end());
  const double n = static_cast<double>(p.size());
  double distance = 0.0;  // of Kolmogorov and Smirnov
  for (size_t i = 0; i < p.size(); ++i) {
    distance = std::max({distance, (i + 1) / n - p[i], p[i] - i / n});
  }
  // Beyond with a probability of 0.001.
  EXPECT_LT(distance, 1.95 / std::sqrt(n));
  EXPECT_GT(p.front(), 1e-2 / n);
}

TEST(TestWhiteness, IsUniformOfExactModels) {
  for (const char* robot : {"pendulum2_planar", "cartpole", "pendulum1"}) {
    SCOPED_TRACE(robot);
    const Model model = Shipped(robot);
    std::vector<double> p;
    for (int seed = 1; seed <= 20; ++seed) {
      const Fitted fitted(model, {}, RunsOf(model, 100 * seed, 0.0, 2.0));
      const std::vector<Whiteness> white = TestWhiteness(fitted.fit);
      ASSERT_EQ(white.size(), fitted.evaluated.fit.train.channels.size());
      for (const Whiteness& w : white) {
        EXPECT_GT(w.lags, 5);
        EXPECT_LT(std::abs(w.lag1), 0.25);
        EXPECT_LT(w.time, 2.0);
        p.push_back(w.p_value);
      }
    }
    ExpectUniform(p);
  }
}

// Short segments spend many of their numbers on states, which alone makes what
// is left correlated.
TEST(TestWhiteness, KnowsWhatTheStatesTakeUp) {
  const Model model = Shipped("pendulum2_planar");
  std::vector<double> p;
  for (int seed = 1; seed <= 30; ++seed) {
    DiagnosisProblem problem =
        MakeProblem(model, {}, RunsOf(model, 100 * seed, 0.0, 2.0));
    problem.options.segment = 0.1;
    const EvaluatedModel evaluated = EvaluateGiven(problem);
    ASSERT_LT(evaluated.fit.segment_s, 0.15);
    const LinearizedFit fit(*evaluated.problem, evaluated.fit.point);
    for (const Whiteness& w : TestWhiteness(fit)) p.push_back(w.p_value);
  }
  ExpectUniform(p);
}

TEST(TestWhiteness, SeesAMisfit) {
  const Model truth = Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                              {{"joint1.damping", 0.02}});
  const Fitted fitted(Shipped("pendulum2_planar"), {},
                      RunsOf(truth, 5, 0.0, 4.0));
  for (const Whiteness& w : TestWhiteness(fitted.fit)) {
    EXPECT_LT(w.p_value, 1e-10) << w.channel;
    EXPECT_GT(w.lag1, 0.3) << w.channel;
    EXPECT_GT(w.time, 3.0) << w.channel;
    EXPECT_GT(w.lags_out, 3) << w.channel;
  }
}

TEST(CorrelateInputs, SeesAWrongGainByItsJoint) {
  const Model truth = Shipped("cartpole", {"effort_gain@slider"},
                              {{"slider.effort_gain", 0.2}});
  const Fitted fitted(Shipped("cartpole"), {}, RunsOf(truth, 5, 0.2, 8.0));
  const std::vector<InputCorrelation> inputs = CorrelateInputs(fitted.fit);
  ASSERT_EQ(inputs.size(), 4u);
  const InputCorrelation& right = inputs[0];
  EXPECT_EQ(right.channel, "slider");
  EXPECT_EQ(right.input, "slider");
  EXPECT_TRUE(right.significant) << right.p_value;
  EXPECT_GT(std::abs(right.correlation), 0.3);
  EXPECT_LT(std::abs(right.lag_s), 0.15);
  // The hinge's effort is the same kind of signal.
  EXPECT_EQ(inputs[1].input, "hinge");
  EXPECT_LT(std::abs(inputs[1].correlation), std::abs(right.correlation));
}

// The slider's velocity, measured too much by `bias`.
void AddVelocity(double bias, sysid::Run* run) {
  const Channel& position = run->channels[0];
  Channel velocity;
  velocity.kind = ChannelKind::kVelocity;
  velocity.target = position.target;
  velocity.name = position.name + ".qd";
  velocity.values.resize(run->size(), 1);
  for (int k = 0; k < run->size(); ++k) {
    const int before = std::max(0, k - 5);
    const int after = std::min(run->size() - 1, k + 5);
    velocity.values(k, 0) =
        bias + (position.values(after, 0) - position.values(before, 0)) /
                   (run->t[after] - run->t[before]);
  }
  run->channels.push_back(velocity);
}

// The states settle between a position and a velocity that contradict it: the
// errors of either are then not free of what states take up, which of a slow
// effort is nearly all.
TEST(CorrelateInputs, LiesBetweenMinusOneAndOne) {
  for (const double length : {0.2, 0.5}) {
    std::vector<sysid::Run> runs = RunsOf(Shipped("cartpole"), 5, 0.0, 4.0);
    for (sysid::Run& run : runs) {
      for (int k = 0; k < run.size(); ++k) run.effort(k, 0) = 1e-3 * run.t[k];
      AddVelocity(0.1, &run);
    }
    DiagnosisProblem problem = MakeProblem(Shipped("cartpole"), {}, runs);
    problem.options.segment = length;
    const EvaluatedModel evaluated = EvaluateGiven(problem);
    const LinearizedFit fit(*evaluated.problem, evaluated.fit.point);
    const std::vector<InputCorrelation> inputs = CorrelateInputs(fit);
    ASSERT_EQ(inputs.size(), 3u);
    for (const InputCorrelation& input : inputs) {
      EXPECT_LE(std::abs(input.correlation), 1.0)
          << input.channel << " with " << input.input << ", " << length;
    }
  }
}

TEST(CorrelateInputs, SeesNothingInExactModels) {
  const Model model = Shipped("cartpole");
  int significant = 0;
  std::vector<double> p;
  for (int seed = 1; seed <= 20; ++seed) {
    const Fitted fitted(model, {}, RunsOf(model, 100 * seed, 0.2, 2.0));
    for (const InputCorrelation& input : CorrelateInputs(fitted.fit)) {
      if (input.significant) ++significant;
      EXPECT_LT(std::abs(input.correlation), 0.5);
    }
  }
  EXPECT_LE(significant, 1);
}

TEST(CorrelateInputs, LeavesOutEffortsThatDoNotMove) {
  const Model model = Shipped("cartpole");
  std::vector<sysid::Run> runs = RunsOf(model, 5, 0.0, 2.0);
  for (sysid::Run& run : runs) run.effort.col(0).setConstant(0.0);
  EXPECT_TRUE(CorrelateInputs(Fitted(model, {}, runs).fit).empty());
}

}  // namespace
}  // namespace sysid
