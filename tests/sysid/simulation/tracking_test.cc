#include "sysid/simulation/tracking.h"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/error_text.h"
#include "tests/sysid/simulation/arm_with_limits.h"

namespace sysid {
namespace {

using Eigen::VectorXd;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// Both joints of the arm, slowly to and fro.
sysid::Run Slow(double seconds = 4.0) {
  sysid::Run run;
  run.name = "reference.csv";
  Channel shoulder, elbow;
  shoulder.target = 0;
  elbow.target = 1;
  const int samples = static_cast<int>(50 * seconds) + 1;
  shoulder.values.resize(samples, 1);
  elbow.values.resize(samples, 1);
  for (int k = 0; k < samples; ++k) {
    run.t.push_back(0.02 * k);
    shoulder.values(k, 0) = 0.5 * std::sin(2.0 * run.t[k]);
    elbow.values(k, 0) = 1.0 + 0.6 * std::cos(3.0 * run.t[k]);
  }
  run.channels = {shoulder, elbow};
  return run;
}

class TrackingTest : public ::testing::Test {
 protected:
  sysid::Run Simulated(const std::string& gains, double rate) {
    SimulationOptions options;
    options.duration = reference_.duration();
    options.rate = rate;
    const VectorXd x0 = reference_.Start(model_, NearestToNeutral(model_));
    return SimulateTracking(model_, x0, options, reference_,
                            ParseGains(gains, model_, "--gains"),
                            "--gains 'less'", &notices_);
  }

  Model model_ = ArmWithLimits();
  JointReference reference_{model_, Slow()};
  std::vector<std::string> notices_;
};

TEST_F(TrackingTest, HasTheControllersEffortsAtTheSamples) {
  const sysid::Run run = Simulated("400,8", 500);
  EXPECT_THAT(notices_, IsEmpty());
  ASSERT_EQ(run.size(), 2001);
  const double h = 1.0 / 500;
  for (int k = 1; k + 1 < run.size(); k += 50) {
    for (int j = 0; j < 2; ++j) {
      const auto& q = run.channels[j].values;
      const double qd = (q(k + 1, 0) - q(k - 1, 0)) / (2 * h);
      const JointReference::Point to = reference_.At(j, run.t[k]);
      EXPECT_NEAR(run.effort(k, j), 400 * (to.q - q(k, 0)) + 8 * (to.qd - qd),
                  0.2);
    }
  }
  // What the weight takes is missed, and little else.
  for (int j = 0; j < 2; ++j) {
    for (int k = 0; k < run.size(); ++k) {
      EXPECT_NEAR(run.channels[j].values(k, 0), reference_.At(j, run.t[k]).q,
                  0.05);
    }
  }
}

TEST_F(TrackingTest, RepeatsAsAnOpenLoop) {
  // Zero-order hold: the efforts of the file make the same motion.
  const sysid::Run closed = Simulated("400,8", 500);
  SimulationOptions options;
  options.duration = reference_.duration();
  options.rate = 500;
  const VectorXd x0 = reference_.Start(model_, NearestToNeutral(model_));
  const sysid::Run open = SimulateDriven(model_, x0, options, Replay(closed));
  EXPECT_TRUE(open.effort.isApprox(closed.effort, 1e-15));
  EXPECT_LT((open.channels[1].values - closed.channels[1].values)
                .cwiseAbs()
                .maxCoeff(),
            1e-6);
}

TEST_F(TrackingTest, KeepsTheEffortLimitAndSaysSo) {
  const sysid::Run run = Simulated("2000,20", 1000);
  EXPECT_LE(run.effort.col(0).cwiseAbs().maxCoeff(), 15.0);
  model_ = MakeModel(
      [] {
        Mechanism weak = LoadUrdfText(kArmWithLimits, "arm.urdf");
        weak.joints[0].effort_limit = 2.0;
        return weak;
      }(),
      Catalogue());
  notices_.clear();
  const sysid::Run weak = Simulated("400,8", 500);
  EXPECT_EQ(weak.effort.col(0).cwiseAbs().maxCoeff(), 2.0);
  ASSERT_FALSE(notices_.empty());
  EXPECT_THAT(notices_[0],
              AllOf(StartsWith("joint 'shoulder' is at its effort limit, 2, "
                               "in "),
                    HasSubstr(" % of the samples")));
}

TEST_F(TrackingTest, SeesThroughTheSensorsOffset) {
  model_.AddEffect(
      Catalogue().Make("sensor_offset@elbow", model_.mechanism(), "test"));
  model_.SetEffectParameter("elbow.sensor_offset", 0.2);
  const sysid::Run run = Simulated("400,8", 500);
  // The loop moves the joint until the sensor says what it should.
  EXPECT_NEAR(run.channels[1].values(1000, 0), reference_.At(1, 2.0).q, 0.05);
}

TEST_F(TrackingTest, KnowsWhichLoopsAreStable) {
  const VectorXd x0 = NearestToNeutral(model_);
  const auto growth = [&](const std::string& gains, double rate) {
    return LoopGrowth(model_, reference_, x0,
                      ParseGains(gains, model_, "--gains"), 1.0 / rate);
  };
  EXPECT_TRUE(IsStable(growth("300,20", 2000)));
  EXPECT_FALSE(IsStable(growth("300,20", 100)));
  // Without damping it always grows between samples.
  EXPECT_FALSE(IsStable(growth("300,0", 1000)));
  const double rate =
      StableRate(model_, reference_, x0, ParseGains("300,20", model_, ""), 100);
  EXPECT_TRUE(IsStable(growth("300,20", rate)));
  EXPECT_FALSE(IsStable(growth("300,20", rate / 2)));
  const std::string suggested = SuggestGains(model_, reference_, x0, 0.01);
  EXPECT_TRUE(IsStable(growth(suggested, 100))) << suggested;
}

TEST_F(TrackingTest, EndsInAnErrorWhereTheLoopIsLost) {
  // Nothing bounds the efforts.
  model_ = MakeModel(
      [] {
        Mechanism strong = LoadUrdfText(kArmWithLimits, "arm.urdf");
        for (Joint& joint : strong.joints) joint.effort_limit = HUGE_VAL;
        return strong;
      }(),
      Catalogue());
  const std::string text = ErrorText([&] { Simulated("3000,300", 100); });
  EXPECT_THAT(text, StartsWith("--gains: make a loop of 100 samples a second "
                               "unstable: from one to the next it grows by a "
                               "factor of "));
  EXPECT_THAT(text, HasSubstr("hint: give --rate "));
  EXPECT_THAT(text, HasSubstr(", or lower gains: --gains 'less'"));
}

TEST_F(TrackingTest, WarnsWhereLimitsBoundIt) {
  const sysid::Run run = Simulated("300,20", 400);
  ASSERT_TRUE(run.effort.allFinite());
  ASSERT_FALSE(notices_.empty());
  EXPECT_THAT(notices_[0], StartsWith("--gains: make a loop of 400 samples a "
                                      "second unstable: "));
}

TEST_F(TrackingTest, ReadsGains) {
  const auto pairs = [&](const std::string& text) {
    std::vector<double> all;
    for (const Gains& gains : ParseGains(text, model_, "--gains")) {
      all.push_back(gains.kp);
      all.push_back(gains.kd);
    }
    return all;
  };
  EXPECT_THAT(pairs("200,20"), ElementsAre(200, 20, 200, 20));
  EXPECT_THAT(pairs(" 200 , 0"), ElementsAre(200, 0, 200, 0));
  EXPECT_THAT(pairs("elbow=50:5,shoulder=200:20"), ElementsAre(200, 20, 50, 5));
  EXPECT_THAT(pairs("*=50:5,shoulder=200:20"), ElementsAre(200, 20, 50, 5));
}

TEST_F(TrackingTest, RefusesGainsThatAreNone) {
  const auto error = [&](const std::string& text) {
    return ErrorText([&] { ParseGains(text, model_, "--gains"); });
  };
  const std::string hint =
      "\n  hint: write kp,kd for all joints, such as 200,20, or "
      "joint1=200:20,joint2=50:5, in N m/rad and N m s/rad (slides: N/m, N "
      "s/m)";
  EXPECT_EQ(error("200"), "--gains: '200' is no pair of gains" + hint);
  EXPECT_EQ(error("200,20,3"),
            "--gains: '200,20,3' is no pair of gains" + hint);
  EXPECT_EQ(error("nan,20"), "--gains: 'nan,20' is no pair of gains" + hint);
  EXPECT_EQ(error("-1,20"),
            "--gains: '-1,20': kp must be positive, kd not negative" + hint);
  EXPECT_EQ(error("elbow=20"), "--gains: '20' is no pair of gains" + hint);
  EXPECT_EQ(error("elbow=20:1,5"), "--gains: '5' has no joint" + hint);
  EXPECT_EQ(error("elbow=20:1,elbow=20:1"),
            "--gains: 'elbow' is named twice\n  hint: name it once");
  EXPECT_EQ(error("elbw=20:1,*=2:1"),
            "--gains: no joint of one degree of freedom is named 'elbw'\n"
            "  hint: did you mean 'elbow'?");
  EXPECT_EQ(error("elb*w*s=20:1"),
            "--gains: 'elb*w*s' meets no joint of one degree of freedom of "
            "this model\n  hint: near names: elbow");
  EXPECT_EQ(error("elbow=20:1"),
            "--gains: has no gains of shoulder\n"
            "  hint: give them, or '*=kp:kd' for all that are not named");
}

TEST(Replay, HoldsEachRowUntilTheNext) {
  sysid::Run efforts;
  efforts.t = {5.0, 5.1, 5.4};
  efforts.effort.resize(3, 1);
  efforts.effort << 1, 2, 3;
  const DriveLaw drive = Replay(efforts);
  const auto at = [&](double t) {
    VectorXd effort(1);
    drive(0, t, {}, effort);
    return effort[0];
  };
  EXPECT_EQ(at(0.0), 1);
  EXPECT_EQ(at(0.09), 1);
  EXPECT_EQ(at(0.1), 2);
  EXPECT_EQ(at(0.39), 2);
  EXPECT_EQ(at(0.4), 3);
  EXPECT_EQ(at(9.0), 3);
}

TEST(LimitNotices, NameTheJointThatLeavesItsLimits) {
  const Model model = ArmWithLimits();
  sysid::Run run = Slow();
  run.effort.setZero(run.size(), 2);
  EXPECT_THAT(LimitNotices(model, run), IsEmpty());
  run.channels[1].values(50, 0) = 3.0;
  EXPECT_THAT(LimitNotices(model, run),
              ElementsAre("joint 'elbow' leaves its limits 0.1 to 2.2 at t = 1 "
                          "s: the dynamics have no stops"));
}

}  // namespace
}  // namespace sysid
