#include "sysid/io/degrees.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

namespace sysid {
namespace {

using ::testing::HasSubstr;

constexpr double kPi = 3.14159265358979323846;
constexpr double kToDegrees = 180.0 / kPi;

struct Signal {
  std::vector<double> t, q, qd;
};

// q(t) sampled at `rate_hz` for 10 s; qd by central differences.
Signal Sample(const std::function<double(double)>& q, double rate_hz = 100.0) {
  Signal signal;
  for (int i = 0; i < 10.0 * rate_hz; ++i) {
    const double t = i / rate_hz;
    signal.t.push_back(t);
    signal.q.push_back(q(t));
    signal.qd.push_back((q(t + 1e-5) - q(t - 1e-5)) / 2e-5);
  }
  return signal;
}

std::vector<double> Scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

Joint Hinge() {
  Joint joint;
  joint.type = JointType::kRevolute;
  return joint;
}

DegreesReport Look(const Signal& signal, bool with_velocity = false) {
  return LookForDegrees(Hinge(), signal.t, signal.q,
                        with_velocity ? signal.qd : std::vector<double>());
}

// A decaying swing of a pendulum: amplitude in rad, frequency in Hz.
Signal Swing(double amplitude, double frequency_hz) {
  return Sample([=](double t) {
    return amplitude * std::exp(-0.1 * t) *
           std::cos(2.0 * kPi * frequency_hz * t);
  });
}

TEST(DegreesTest, FindsASwingInDegrees) {
  for (const double amplitude : {0.25, 0.3, 0.6, 1.0, 2.5}) {
    Signal signal = Swing(amplitude, 0.9);
    EXPECT_EQ(Look(signal).verdict, DegreesVerdict::kNo) << amplitude;
    signal.q = Scaled(signal.q, kToDegrees);
    EXPECT_EQ(Look(signal).verdict, DegreesVerdict::kPosition) << amplitude;
  }
}

TEST(DegreesTest, SaysWhatItSaw) {
  Signal signal =
      Sample([](double t) { return 60.0 * std::cos(2.0 * kPi * t); });
  EXPECT_EQ(
      Look(signal).reason,
      "it swings to and fro over 120 at up to 245 a second: in radians that "
      "is 19 turns, 39 turns a second");
}

TEST(DegreesTest, AVelocityColumnTellsSmallSwingsApart) {
  Signal signal = Swing(0.03, 0.5);
  EXPECT_EQ(Look(signal, true).verdict, DegreesVerdict::kNo);
  const std::vector<double> radians = signal.q;
  signal.q = Scaled(radians, kToDegrees);
  EXPECT_EQ(Look(signal, true).verdict, DegreesVerdict::kPosition);
  EXPECT_EQ(Look(signal, true).reason,
            "its changes are 57.3 times what its velocity column says (180/pi "
            "is 57.3)");
  signal.q = radians;
  signal.qd = Scaled(signal.qd, kToDegrees);
  EXPECT_EQ(Look(signal, true).verdict, DegreesVerdict::kVelocity);
  EXPECT_EQ(Look(signal, true).reason,
            "it is 57.3 times what the position's changes say (180/pi is "
            "57.3)");
}

TEST(DegreesTest, NoiseInTheVelocityIsNoEvidence) {
  std::mt19937 engine(1);
  std::normal_distribution<double> noise;
  Signal still = Sample([](double) { return 0.0; }, 1000.0);
  for (double& q : still.q) q = 1e-3 * noise(engine);
  for (double& qd : still.qd) qd = 1e-2 * noise(engine);
  EXPECT_EQ(Look(still, true).verdict, DegreesVerdict::kNo);
}

TEST(DegreesTest, JointsThatTurnOnAndOnAreNotDegrees) {
  EXPECT_EQ(Look(Sample([](double t) { return 300.0 * t; })).verdict,
            DegreesVerdict::kNo);
  // A wheel: 30 turns there and back, at most 19 rad/s.
  EXPECT_EQ(
      Look(Sample([](double t) { return 188.0 * std::sin(0.1 * t); })).verdict,
      DegreesVerdict::kNo);
  // A drive that runs there and back often: only perhaps.
  const DegreesReport drive =
      Look(Sample([](double t) { return 20.0 * std::sin(kPi * 0.5 * t); }));
  EXPECT_EQ(drive.verdict, DegreesVerdict::kPerhaps);
  EXPECT_EQ(drive.reason,
            "it swings to and fro over 40.0: in radians 6.4 turns");
  // The second link of a double pendulum that goes over the top: a few turns
  // to either side, within what gravity gives.
  EXPECT_NE(Look(Sample([](double t) {
              return 9.0 * std::sin(1.2 * t) + 2.0 * std::sin(7.0 * t);
            })).verdict,
            DegreesVerdict::kPosition);
}

TEST(DegreesTest, RadiansThatWrapAreNotDegrees) {
  EXPECT_EQ(Look(Sample([](double t) {
              return std::remainder(8.0 * t, 2.0 * kPi);
            })).verdict,
            DegreesVerdict::kNo);
}

TEST(DegreesTest, FindsDegreesThatWrap) {
  const DegreesReport report =
      Look(Sample([](double t) { return std::remainder(100.0 * t, 360.0); }));
  EXPECT_EQ(report.verdict, DegreesVerdict::kPosition);
  EXPECT_EQ(report.reason,
            "it jumps by 357.0 from one sample to the next, as a sensor does "
            "that wraps at 360 degrees");
}

// They are evidence: CheckLimits (sysid/checks) says so.
TEST(DegreesTest, LimitsOfTheUrdfAreNoReasonToRefuse) {
  Joint joint = Hinge();
  joint.has_limits = true;
  joint.lower = -1.6;
  joint.upper = 1.6;
  const Signal slow = Sample([](double t) { return 1.2 * std::sin(0.2 * t); });
  EXPECT_EQ(LookForDegrees(joint, slow.t, slow.q, {}).verdict,
            DegreesVerdict::kNo);
  for (const double factor : {3.0, 14.0, kToDegrees}) {
    EXPECT_EQ(LookForDegrees(joint, slow.t, Scaled(slow.q, factor), {}).verdict,
              DegreesVerdict::kNo);
  }
}

TEST(DegreesTest, OneOutlierIsNotASwing) {
  Signal signal = Swing(0.3, 0.9);
  signal.q[100] = 80.0;
  signal.q[300] = -70.0;
  signal.q[500] = 90.0;
  EXPECT_EQ(Look(signal).verdict, DegreesVerdict::kNo);
}

TEST(DegreesTest, MissingSamplesAreNoJumps) {
  Signal signal = Swing(0.3, 0.9);
  signal.q = Scaled(signal.q, kToDegrees);
  for (size_t i = 0; i < signal.q.size(); i += 3) {
    signal.q[i] = std::numeric_limits<double>::quiet_NaN();
  }
  EXPECT_EQ(Look(signal).verdict, DegreesVerdict::kPosition);
}

TEST(DegreesTest, SlidesHaveNoAngles) {
  Signal signal = Swing(0.3, 0.9);
  Joint joint;
  joint.type = JointType::kPrismatic;
  EXPECT_EQ(LookForDegrees(joint, signal.t, Scaled(signal.q, 57.3), {}).verdict,
            DegreesVerdict::kNo);
}

}  // namespace
}  // namespace sysid
