#include "sysid/unexplained_force/where.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

using testing::SizeIs;

Where WhereOf(const EvaluatedModel& evaluated) {
  return FindWhere(*evaluated.problem, evaluated.fit);
}

std::vector<sysid::Run> RunsOf(const Model& truth, int seed, double amplitude,
                               double duration = 4.0) {
  Recording recording;
  recording.duration = duration;
  recording.amplitude = amplitude;
  std::vector<sysid::Run> runs;
  for (int i = 0; i < 3; ++i) {
    runs.push_back(Record(truth, seed + i, recording));
  }
  return runs;
}

TEST(FindWhere, TellsErrorsByChannelAndSegment) {
  const Model model = Shipped("pendulum2_planar");
  const EvaluatedModel evaluated =
      EvaluateGiven(MakeProblem(model, {}, RunsOf(model, 3, 0.7)));
  const Where where = WhereOf(evaluated);
  ASSERT_THAT(where.channels, SizeIs(2));
  EXPECT_EQ(where.channels[0].name, "joint1");
  ASSERT_EQ(where.segments.size(), evaluated.fit.train.segments.size());
  EXPECT_EQ(where.segments.front().trajectory, "run4.csv");
  ASSERT_GE(where.horizon.size(), 5u);
  EXPECT_NEAR(where.horizon.front().rms, 1e-3, 3e-4);
  EXPECT_THAT(where.whiteness, SizeIs(2));
  EXPECT_TRUE(where.inputs.empty());  // no effort was measured
  EXPECT_THAT(where.joints, SizeIs(2));
  EXPECT_THAT(where.force, SizeIs(4));  // of two joints in two runs
  EXPECT_TRUE(where.regression.empty());
}

// A sensor that is five times noisier on one side.
TEST(FindWhere, TellsErrorsByPositionAndVelocity) {
  const Model model = Shipped("pendulum2_planar");
  std::vector<sysid::Run> runs = RunsOf(model, 3, 0.7);
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0.0, 5e-3);
  for (sysid::Run& run : runs) {
    for (double& q : run.channels[0].values.reshaped()) {
      if (q > 0.0) q += noise(random);
    }
  }
  const Where where = WhereOf(EvaluateGiven(MakeProblem(model, {}, runs)));
  int noisy = 0, quiet = 0, total = 0;
  double fast = 0.0, slow = 0.0;
  for (const MotionBin& bin : where.bins) {
    EXPECT_LT(bin.from, bin.to);
    if (bin.joint == "joint1" && bin.over == "position") {
      EXPECT_EQ(bin.unit, "rad");
      total += bin.samples;
      if (bin.from > 0.01) {
        ++noisy;
        EXPECT_NEAR(bin.normalized_rms, 5.1, 1.0) << bin.from;
      } else if (bin.to < -0.01) {
        ++quiet;
        EXPECT_LT(bin.normalized_rms, 1.5) << bin.from;
      }
    } else if (bin.joint == "joint2") {
      EXPECT_LT(bin.normalized_rms, 1.6) << bin.over << bin.from;
    } else {
      EXPECT_EQ(bin.over, "velocity");
      EXPECT_EQ(bin.unit, "rad/s");
      (bin.from > 0 ? fast : slow) += bin.samples;
    }
  }
  EXPECT_GE(noisy, 2);
  EXPECT_GE(quiet, 3);
  EXPECT_GT(total, 780);  // of 802 samples
  EXPECT_GT(fast, 200);
  EXPECT_GT(slow, 200);
}

TEST(FindWhere, TellsErrorsOfASphericalJointByTiltAndSpeed) {
  const Model model = Shipped("pendulum1");
  const Where where =
      WhereOf(EvaluateGiven(MakeProblem(model, {}, RunsOf(model, 3, 0.7))));
  int tilt = 0, speed = 0;
  for (const MotionBin& bin : where.bins) {
    EXPECT_GE(bin.from, 0.0);
    EXPECT_NEAR(bin.normalized_rms, 1.0, 0.4) << bin.over;
    if (bin.over == "tilt") {
      ++tilt;
      EXPECT_LT(bin.to, 0.75);  // released at most so far
      EXPECT_EQ(bin.unit, "rad");
    } else {
      ++speed;
      EXPECT_EQ(bin.over, "speed");
      EXPECT_EQ(bin.unit, "rad/s");
    }
  }
  EXPECT_GE(tilt, 5);
  EXPECT_GE(speed, 5);
}

// Friction that all but locks a joint: no fit of the model without it is worth
// linearising.
TEST(FindWhere, FindsTheJointOfAHugeMisfit) {
  const Model model = Shipped("pendulum2_planar");
  const Model truth = Shipped("pendulum2_planar", {"coulomb_friction@joint2"},
                              {{"joint2.friction", 0.5}});
  const EvaluatedModel evaluated = EvaluateGiven(
      MakeProblem(model, {{"link1.length", 0.52}, {"link2.length", 0.48}},
                  RunsOf(truth, 3, 0.7)));
  ASSERT_GT(evaluated.train_error(), 50.0);
  const Where where = WhereOf(evaluated);
  ASSERT_THAT(where.joints, SizeIs(2));
  EXPECT_FALSE(where.joints[0].significant);
  EXPECT_TRUE(where.joints[1].significant);
  EXPECT_GT(where.joints[1].rms, 0.1);
  EXPECT_LT(where.joints[1].rms, 0.6);
  for (const ForceCurve& curve : where.force) {
    for (size_t k = 0; k < curve.t.size(); ++k) {
      EXPECT_TRUE(std::isfinite(curve.value[k]) && std::isfinite(curve.std[k]));
    }
  }
}

// Rods so thin that a friction soon stops their spin: over a whole segment of
// the fit that is not linear.
TEST(FindWhere, CutsSegmentsUntilForcesExplainTheErrors) {
  const Model model = Shipped("pendulum2");
  const Model truth = Shipped("pendulum2", {"viscous_damping@joint2"},
                              {{"joint2.damping", 0.02}});
  const EvaluatedModel evaluated =
      EvaluateGiven(MakeProblem(model, {}, RunsOf(truth, 1, 0.7, 8.0)));
  const LinearizedFit fit(*evaluated.problem, evaluated.fit.point);
  EXPECT_GT(EstimateForce(fit).variance, 1.5);
  const Where where = WhereOf(evaluated);
  ASSERT_THAT(where.joints, SizeIs(2));
  EXPECT_TRUE(where.joints[1].significant);
  for (const ForceRegression& law : where.regression) {
    if (law.joint == "joint1") {
      EXPECT_LT(law.r2, 0.2) << law.label;
    } else {
      EXPECT_EQ(law.label, "-velocity");
      EXPECT_GT(law.r2, 0.3);
      break;
    }
  }
}

}  // namespace
}  // namespace sysid
