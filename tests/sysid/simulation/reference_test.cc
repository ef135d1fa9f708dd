#include "sysid/simulation/reference.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "tests/support/error_text.h"
#include "tests/sysid/simulation/arm_with_limits.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

sysid::Run Positions(const std::vector<double>& t, int joint,
                     const std::vector<double>& q) {
  sysid::Run run;
  run.name = "reference.csv";
  run.t = t;
  Channel channel;
  channel.target = joint;
  channel.values = Eigen::VectorXd::Map(q.data(), q.size());
  run.channels = {channel};
  return run;
}

TEST(JointReference, GoesThroughItsSamplesWithTheirParabolasSlopes) {
  const Model model = ArmWithLimits();
  // q = t^2 at uneven times: parabolas are exact, and so are the cubics.
  const std::vector<double> t = {1.0, 1.1, 1.3, 1.4, 1.8};
  std::vector<double> q;
  for (const double at : t) q.push_back((at - 1.0) * (at - 1.0));
  const JointReference reference(model, Positions(t, 0, q));
  EXPECT_THAT(reference.bodies(), ElementsAre(0));
  EXPECT_NEAR(reference.duration(), 0.8, 1e-15);
  // Its first sample is time 0.
  for (double at = 0.0; at <= 0.8; at += 0.01) {
    EXPECT_NEAR(reference.At(0, at).q, at * at, 1e-14);
    EXPECT_NEAR(reference.At(0, at).qd, 2 * at, 1e-13);
  }
  EXPECT_EQ(reference.At(0, 5.0).q, q.back());
  EXPECT_EQ(reference.At(0, 5.0).qd, 0.0);
}

TEST(JointReference, IsTheDerivativeOfASmoothMotion) {
  const Model model = ArmWithLimits();
  std::vector<double> t, q;
  for (int k = 0; k <= 200; ++k) {
    t.push_back(0.01 * k);
    q.push_back(0.5 * std::sin(5.0 * t.back()));
  }
  const JointReference reference(model, Positions(t, 0, q));
  for (double at = 0.0; at < 2.0; at += 0.0037) {
    EXPECT_NEAR(reference.At(0, at).q, 0.5 * std::sin(5 * at), 2e-5);
    EXPECT_NEAR(reference.At(0, at).qd, 2.5 * std::cos(5 * at), 4e-3);
  }
}

TEST(JointReference, SkipsMissingSamples) {
  const Model model = ArmWithLimits();
  const JointReference reference(
      model, Positions({0.0, 1.0, 2.0, 3.0}, 0, {kNaN, 0.1, kNaN, 0.3}));
  EXPECT_EQ(reference.At(0, 0.0).q, 0.1);
  EXPECT_EQ(reference.At(0, 0.0).qd, 0.0);
  EXPECT_NEAR(reference.At(0, 2.0).q, 0.2, 1e-15);
  EXPECT_NEAR(reference.At(0, 2.0).qd, 0.1, 1e-15);
}

TEST(JointReference, StartsJointsAndHoldsTheOthers) {
  const Model model = ArmWithLimits();
  JointReference reference(model,
                           Positions({0.0, 1.0, 2.0}, 1, {0.5, 0.7, 0.9}));
  EXPECT_THAT(reference.Missing(model), ElementsAre("shoulder"));
  const Eigen::Vector4d x0(-0.3, 0.1, 0.0, 0.0);
  reference.HoldOthers(model, x0);
  EXPECT_TRUE(
      reference.Start(model, x0).isApprox(Eigen::Vector4d(-0.3, 0.5, 0, 0.2)));
  EXPECT_EQ(reference.At(0, 1.0).q, -0.3);
  EXPECT_EQ(reference.At(0, 1.0).qd, 0.0);
}

TEST(JointReference, RefusesWhatNoJointCanDo) {
  const Model model = ArmWithLimits();
  EXPECT_EQ(
      ErrorText([&] {
        JointReference(model, Positions({3.0, 3.5, 4.0}, 1, {0.5, 2.5, 0.5}));
      }),
      "reference.csv: elbow.q is 2.5 at t = 3.5 s, outside of the limits "
      "0.1 to 2.2 of the URDF\n"
      "  hint: keep the reference within them; angles are in radians");
  sysid::Run frames = Positions({0.0, 1.0}, 0, {0.0, 0.0});
  frames.channels[0].kind = ChannelKind::kVelocity;
  EXPECT_EQ(ErrorText([&] { JointReference(model, frames); }),
            "reference.csv: has no position of a joint to follow\n"
            "  hint: its columns are t and any of shoulder.q, elbow.q");
}

}  // namespace
}  // namespace sysid
