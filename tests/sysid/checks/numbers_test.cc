// What the checks of the numbers say of columns that are made up here: each
// branch by a column that has the fault, and one that only looks so.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/checks/series.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Signal = std::function<double(double t)>;

std::vector<double> EvenTimes(int n, double period) {
  std::vector<double> t;
  for (int k = 0; k < n; ++k) t.push_back(k * period);
  return t;
}

// A run of a shipped model, of columns that are functions of time.
class Recording {
 public:
  Recording(const std::string& model, std::vector<double> t)
      : model_(LoadUrdf(FindModel(model))) {
    run_.name = "run.csv";
    run_.t = std::move(t);
    run_.effort = RowMatrixXd::Zero(run_.size(), model_.mechanism().nv);
  }

  Channel& Add(ChannelKind kind, int joint, int columns) {
    Channel channel;
    channel.kind = kind;
    channel.target = joint;
    channel.name = model_.mechanism().joints[joint].name;
    channel.values.resize(run_.size(), columns);
    run_.channels.push_back(channel);
    return run_.channels.back();
  }

  void Add(ChannelKind kind, int joint, double noise, const Signal& signal) {
    Channel& channel = Add(kind, joint, 1);
    std::normal_distribution<double> normal;
    for (int k = 0; k < run_.size(); ++k) {
      channel.values(k, 0) = signal(run_.t[k]) + noise * normal(engine_);
    }
  }

  // A ball joint turned by an angle about a horizontal axis, with its sign as
  // it likes.
  void AddBall(int joint, double noise, const Signal& angle) {
    Channel& channel = Add(ChannelKind::kOrientation, joint, 4);
    std::normal_distribution<double> normal;
    for (int k = 0; k < run_.size(); ++k) {
      const double half = 0.5 * angle(run_.t[k]);
      Eigen::RowVector4d q(0.6 * std::sin(half), 0.8 * std::sin(half), 0,
                           std::cos(half));
      for (double& v : q.reshaped()) v += 0.5 * noise * normal(engine_);
      channel.values.row(k) = (k % 7 < 3 ? -1.0 : 1.0) * q.normalized();
    }
  }

  Run& run() { return run_; }

  CheckInput Input() {
    CheckInput input;
    input.model = &model_;
    input.free = &free_;
    input.runs = {&run_};
    return input;
  }

  std::vector<Finding> Find(NumbersCheck check) {
    std::vector<Finding> findings;
    check(Input(), &findings);
    return findings;
  }

  // Their names.
  std::vector<std::string> Faults(NumbersCheck check) {
    std::vector<std::string> faults;
    for (const Finding& finding : Find(check)) faults.push_back(finding.fault);
    return faults;
  }

 private:
  Model model_;
  std::vector<FreeParameter> free_;
  Run run_;
  std::mt19937_64 engine_{7};
};

constexpr ChannelKind kQ = ChannelKind::kPosition;
constexpr ChannelKind kQd = ChannelKind::kVelocity;

double Swing(double t) { return std::sin(2 * M_PI * t); }
double Rest(double) { return 0.3; }

// All joints of the arm in slow swings; the first as `first` says.
Recording SlowArm(const Signal& first) {
  Recording recording("arm7", EvenTimes(1000, 0.01));
  recording.Add(kQ, 0, 0.0, first);
  for (int j = 1; j < 7; ++j) {
    recording.Add(kQ, j, 0.0, [j](double t) {
      return (j == 5 ? 0.8 : -0.8) + 0.3 * std::sin(0.7 * t + j);
    });
  }
  return recording;
}

TEST(LimitsTest, WhatIsBeyondThemIsNamedByTheUnitThatFits) {
  const Signal angle = [](double t) { return std::sin(0.7 * t); };
  EXPECT_THAT(SlowArm(angle).Faults(CheckLimits), IsEmpty());
  const auto ticks = SlowArm([&](double t) {
                       return std::round(2048 + angle(t) * 4096 / (2 * M_PI));
                     }).Find(CheckLimits);
  ASSERT_EQ(ticks.size(), 1u);
  EXPECT_EQ(ticks[0].fault, "ticks");
  EXPECT_THAT(ticks[0].remedies,
              ElementsAre("--columns 'joint1.q=(joint1.q-2048)*2*pi/4096'"));
  const auto degrees =
      SlowArm([&](double t) { return 57.29578 * angle(t); }).Find(CheckLimits);
  ASSERT_EQ(degrees.size(), 1u);
  EXPECT_EQ(degrees[0].fault, "beyond_limits");
  EXPECT_EQ(degrees[0].severity, Severity::kNote);
  EXPECT_EQ(degrees[0].remedies.size(), 1u);
  // No factor that we know of.
  const auto other =
      SlowArm([&](double t) { return 1234.5 * angle(t); }).Find(CheckLimits);
  ASSERT_EQ(other.size(), 1u);
  EXPECT_THAT(other[0].remedies, IsEmpty());
}

TEST(MissingEffortsTest, AreThoseOfMotorsThatLift) {
  Recording lifted = SlowArm(Rest);
  const std::vector<Finding> findings = lifted.Find(CheckMissingEfforts);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].fault, "effort_not_measured");
  lifted.run().effort.setConstant(-1e-310);  // what memory held
  EXPECT_EQ(lifted.Faults(CheckMissingEfforts).size(), 1u);
  lifted.run().effort(500, 2) = 3.0;
  EXPECT_THAT(lifted.Faults(CheckMissingEfforts), IsEmpty());
  // Left to itself, from a height to rest.
  Recording falls("arm7", EvenTimes(1000, 0.01));
  for (int j = 0; j < 7; ++j) falls.Add(kQ, j, 0.0, Rest);
  EXPECT_THAT(falls.Faults(CheckMissingEfforts), IsEmpty());
  // Without a motor by the URDF.
  Recording free("pendulum2_planar", EvenTimes(1000, 0.01));
  free.Add(kQ, 0, 0.0, Swing);
  free.Add(kQ, 1, 0.0, Swing);
  EXPECT_THAT(free.Faults(CheckMissingEfforts), IsEmpty());
}

TEST(MotionSeriesTest, TheSignOfAQuaternionIsMadeContinuous) {
  Recording recording("pendulum3", EvenTimes(400, 0.01));
  recording.AddBall(0, 0.0, Swing);
  const CheckInput input = recording.Input();
  EXPECT_THAT(AllSeries(input), IsEmpty());
  const std::vector<Series> motion = MotionSeries(input);
  ASSERT_EQ(motion.size(), 4u);
  for (const Series& series : motion) {
    EXPECT_LT(series.step, 0.05);
    EXPECT_NEAR(series.range, 1.6 * std::sin(0.5), 1e-3);  // of the largest
    EXPECT_EQ(series.column, "joint1.q");
  }
}

TEST(StillTest, IsSeenInQuaternions) {
  const auto until = [](double rest) {
    return [rest](double t) { return t < rest ? 0.0 : Swing(t - rest); };
  };
  Recording moves("pendulum3", EvenTimes(1000, 0.01));
  moves.AddBall(0, 1e-3, until(2.0));
  EXPECT_THAT(moves.Faults(CheckStill), IsEmpty());
  Recording rests("pendulum3", EvenTimes(1000, 0.01));
  rests.AddBall(0, 1e-3, until(8.0));
  const std::vector<Finding> findings = rests.Find(CheckStill);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].fault, "still");
  EXPECT_THAT(findings[0].remedies, ElementsAre("--ignore joint1.q@0:8.25"));
}

// Every joint, and every rest: then nothing is still any more.
TEST(StillTest, ItsRemedyMendsIt) {
  const Signal signal = [](double t) {
    return t > 8.0 && t < 10.0 ? Swing(t - 8.0)
                               : Swing(std::max(0.0, t - 18.0));
  };
  Recording rests("cartpole", EvenTimes(2000, 0.01));
  rests.Add(kQ, 0, 1e-4, signal);
  rests.Add(kQ, 1, 1e-4, signal);
  const std::vector<Finding> findings = rests.Find(CheckStill);
  ASSERT_EQ(findings.size(), 1u);
  ASSERT_EQ(findings[0].remedies.size(), 1u);
  EXPECT_EQ(findings[0].remedies[0],
            "--ignore slider.q@0:8.25,slider.q@9.75:18.25,hinge.q@0:8.25,"
            "hinge.q@9.75:18.25");
  for (Channel& channel : rests.run().channels) {
    channel.values.topRows(826).setConstant(NAN);
    channel.values.middleRows(975, 851).setConstant(NAN);
  }
  EXPECT_THAT(rests.Faults(CheckStill), IsEmpty());
}

TEST(StillTest, ItsRemedyIsOfVelocitiesToo) {
  Recording rests("cartpole", EvenTimes(2000, 0.01));
  rests.Add(kQ, 1, 1e-4,
            [](double t) { return Swing(std::max(0.0, t - 18.0)); });
  rests.Add(kQd, 1, 1e-3, [](double t) {
    return t < 18.0 ? 0.0 : 2 * M_PI * std::cos(2 * M_PI * (t - 18.0));
  });
  const std::vector<Finding> findings = rests.Find(CheckStill);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_THAT(findings[0].remedies,
              ElementsAre("--ignore hinge.q@0:18.25,hinge.qd@0:18.25"));
}

// At 3.3 Hz a quarter of a second holds one sample.
TEST(StillTest, OfSlowSamplesNothingIsSaidUnlessTheyAreSmooth) {
  Recording rough("cartpole", EvenTimes(60, 0.3));
  rough.Add(kQ, 1, 1e-3, [](double t) { return Swing(1.25 * t); });
  EXPECT_THAT(rough.Faults(CheckStill), IsEmpty());
  Recording smooth("cartpole", EvenTimes(60, 0.3));
  smooth.Add(kQ, 1, 1e-3, [](double t) { return Swing(0.1 * t); });
  EXPECT_THAT(smooth.Faults(CheckStill), IsEmpty());
  Recording rests("cartpole", EvenTimes(60, 0.3));
  rests.Add(kQ, 1, 1e-3,
            [](double t) { return t < 14 ? 0.0 : Swing(0.1 * (t - 14)); });
  EXPECT_THAT(rests.Faults(CheckStill), ElementsAre("still"));
}

double Round(double t) { return 2 * M_PI * t; }

// A swing of two and a half samples is too fast, and a hinge that goes round
// needs six samples too.
class RatesOfMotionTest : public ::testing::TestWithParam<Signal> {};

TEST_P(RatesOfMotionTest, TwoAndAHalfSamplesATurnAreTooFewAndTenAreNot) {
  Recording slow("cartpole", EvenTimes(40, 0.4));
  slow.Add(kQ, 1, 1e-3, GetParam());
  EXPECT_THAT(slow.Faults(CheckRates), ElementsAre("slow_sampling"));
  Recording even("cartpole", EvenTimes(160, 0.1));
  even.Add(kQ, 1, 1e-3, GetParam());
  EXPECT_THAT(even.Faults(CheckRates), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Motions, RatesOfMotionTest,
                         ::testing::Values(Swing, Round), [](const auto& info) {
                           return info.index == 0 ? "Swings" : "GoesRound";
                         });

TEST(RatesTest, AColumnAtRestInItsNoiseIsNot) {
  Recording recording("cartpole", EvenTimes(200, 0.01));
  recording.Add(kQ, 0, 1e-3, Rest);
  recording.Add(kQ, 1, 1e-2, Rest);
  EXPECT_THAT(recording.Faults(CheckRates), IsEmpty());
}

TEST(RatesTest, AnAngularVelocityInItsNoiseIsNot) {
  Recording recording("pendulum3", EvenTimes(200, 0.01));
  std::mt19937_64 engine(1);
  std::normal_distribution<double> noise(0.0, 0.2);
  Channel& w = recording.Add(ChannelKind::kAngularVelocity, 0, 3);
  for (double& v : w.values.reshaped()) v = noise(engine);
  EXPECT_THAT(recording.Faults(CheckRates), IsEmpty());
}

TEST(RatesTest, ABallJointIsNamedOnce) {
  Recording slow("pendulum3", EvenTimes(40, 0.4));
  slow.AddBall(0, 1e-3, [](double t) { return 2 * Swing(t + 0.1); });
  EXPECT_THAT(slow.Faults(CheckRates), ElementsAre("slow_sampling"));
}

// Stands still from `first` for so many samples.
void Hang(int first, int samples, Channel* channel) {
  channel->values.middleRows(first, samples)
      .setConstant(channel->values(first, 0));
}

// It turns at 2.25 s: comes back to where it hung, and hardly jumps.
TEST(FrozenTest, IsSeenAroundATurnWhereValuesNeverRepeat) {
  Recording recording("cartpole", EvenTimes(400, 0.01));
  recording.Add(kQ, 1, 1e-4, [](double t) { return 30 * t + Swing(t); });
  recording.Add(kQ, 0, 1e-4, Swing);
  Hang(215, 20, &recording.run().channels[1]);
  EXPECT_THAT(recording.Faults(CheckFrozen), ElementsAre("frozen"));
}

// Three steps of the motion elsewhere are more than what is lost here.
TEST(FrozenTest, IsSeenWhereTheMotionIsSlowerThanElsewhere) {
  Recording recording("cartpole", EvenTimes(400, 0.01));
  recording.Add(kQ, 1, 2e-3, [](double t) {
    return t < 2 ? 30 * t : 60 + Swing(0.25 * (t - 2));
  });
  Hang(220, 20, &recording.run().channels[0]);
  EXPECT_THAT(recording.Faults(CheckFrozen), ElementsAre("frozen"));
}

TEST(FrozenTest, IsSeenOfAPositionThatNeverChanges) {
  Recording recording("cartpole", EvenTimes(400, 0.01));
  recording.Add(kQ, 0, 0.0, [](double) { return 0.1; });
  EXPECT_THAT(recording.Faults(CheckFrozen), IsEmpty());  // nor does another
  recording.Add(kQ, 1, 1e-3, Swing);
  EXPECT_THAT(recording.Faults(CheckFrozen), ElementsAre("frozen"));
}

TEST(FrozenTest, DryFrictionIsNot) {
  Recording recording("cartpole", EvenTimes(400, 0.01));
  // Slows down evenly, sticks at 1 s, and sets off at 2 s.
  recording.Add(kQ, 0, 0.0, [](double t) {
    return t < 1.0 ? -(1 - t) * (1 - t) : t < 2.0 ? 0.0 : (t - 2) * (t - 2);
  });
  EXPECT_THAT(recording.Faults(CheckFrozen), IsEmpty());
}

// It swings and then hardly moves: its steps are rare and larger than the
// noise, of which coarse digits at rest show none.
TEST(FrozenTest, CoarseDigitsAreNot) {
  Recording recording("cartpole", EvenTimes(4000, 0.01));
  recording.Add(kQ, 0, 0.0, [](double t) {
    return t < 2.8 ? 0.3 * Swing(t) : -0.285 + 0.03 * Swing(0.05 * (t - 2.8));
  });
  Eigen::Ref<RowMatrixXd> q = recording.run().channels[0].values;
  q = 0.01 * (q / 0.01).array().round();
  EXPECT_THAT(recording.Faults(CheckFrozen), IsEmpty());
}

// A swing whose last step of the digits, nearly a whole one, lasts for fifteen
// samples, and the one before for three.
TEST(SaturationTest, IsNotTheTurnOfASwingInCoarseDigits) {
  constexpr double kQuantum = 0.02;
  Recording recording("cartpole", EvenTimes(800, 0.01));
  recording.Add(kQ, 1, 0.0, [](double t) { return 0.1895 * Swing(t); });
  Eigen::Ref<RowMatrixXd> q = recording.run().channels[0].values;
  q = kQuantum * (q / kQuantum).array().round();
  EXPECT_THAT(recording.Faults(CheckSaturation), IsEmpty());
  q = q.cwiseMin(0.12);
  const std::vector<Finding> findings = recording.Find(CheckSaturation);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].fault, "saturation");
  // Behind the digits, which are certain.
  std::vector<Finding> both = recording.Find(CheckQuantisation);
  ASSERT_EQ(both.size(), 1u);
  both.insert(both.begin(), findings[0]);
  Sort(&both);
  EXPECT_EQ(both[0].fault, "quantisation");
}

TEST(SaturationTest, NamesBothEnds) {
  Recording recording("cartpole", EvenTimes(800, 0.01));
  recording.Add(kQ, 1, 0.0, [](double t) { return Swing(t); });
  Eigen::Ref<RowMatrixXd> q = recording.run().channels[0].values;
  const double most = 0.5 * q.maxCoeff();
  q = q.cwiseMin(most).cwiseMax(-most);
  const std::vector<Finding> findings = recording.Find(CheckSaturation);
  ASSERT_EQ(findings.size(), 1u);
  for (int k = 0; k < 800; ++k) {
    if (std::abs(q(k, 0)) == most) q(k, 0) = NAN;
  }
  EXPECT_THAT(recording.Faults(CheckSaturation), IsEmpty());
  EXPECT_THAT(findings[0].evidence,
              ::testing::AllOf(::testing::HasSubstr(" and -"),
                               ::testing::HasSubstr("stays there")))
      << FullText(findings[0]);
}

// Two joints that move nearly alike, the first less by a half.
Recording Alike(const Signal& qd1, const Signal& qd2) {
  Recording recording("double_pendulum_dfki", EvenTimes(1000, 0.01));
  recording.Add(kQ, 0, 1e-4, [](double t) { return 0.5 * Swing(0.5 * t); });
  recording.Add(kQ, 1, 1e-4,
                [](double t) { return Swing(0.5 * t) + 0.1 * Swing(t); });
  recording.Add(kQd, 0, 1e-3, qd1);
  recording.Add(kQd, 1, 1e-3, qd2);
  return recording;
}

double Qd1(double t) { return 0.5 * M_PI * std::cos(M_PI * t); }
double Qd2(double t) {
  return M_PI * std::cos(M_PI * t) + 0.2 * M_PI * std::cos(2 * M_PI * t);
}

TEST(VelocitiesTest, SwappedOnesOfJointsThatMoveAlikeAreNotScaled) {
  EXPECT_THAT(Alike(Qd1, Qd2).Faults(CheckVelocities), IsEmpty());
  EXPECT_THAT(Alike(Qd2, Qd1).Faults(CheckVelocities),
              ElementsAre("velocities_swapped"));
}

// Each by its own factor, all in one flag; a fault of one run of two is mended
// in that run alone.
TEST(VelocitiesTest, WhatIsWrongInTheSameWayIsOneFinding) {
  const auto times = [](double factor, const Signal& signal) {
    return [=](double t) { return factor * signal(t); };
  };
  const Recording right = Alike(Qd1, Qd2);
  const Recording rpm = Alike(times(9.549, Qd1), times(9.549, Qd2));
  const Recording late_a = Alike(Qd1, [](double t) { return Qd2(t - 0.0237); });
  const auto find = [](Recording a, Recording b) {
    sysid::Run first = a.run(), second = b.run();
    first.name = "a.csv";
    second.name = "b.csv";
    CheckInput input = a.Input();
    input.runs = {&first, &second};
    std::vector<Finding> findings;
    CheckVelocities(input, &findings);
    return findings;
  };
  std::vector<Finding> findings = find(rpm, rpm);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].subject, "joint1.qd, joint2.qd");
  EXPECT_EQ(findings[0].file, "");
  EXPECT_THAT(
      findings[0].remedies,
      ElementsAre(::testing::StartsWith("--columns 'joint1.qd=joint1.qd*0.104"),
                  ::testing::StartsWith("--columns 'joint1.q=joint1.q*9.5"),
                  ::testing::StartsWith("--columns 't=t*0.104")));
  findings = find(right, rpm);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].file, "b.csv");
  EXPECT_THAT(
      findings[0].remedies[0],
      ::testing::AllOf(
          ::testing::StartsWith("--columns 'b.csv/joint1.qd=joint1.qd*0.104"),
          ::testing::HasSubstr(",b.csv/joint2.qd=joint2.qd*0.10")));
  findings = find(late_a, right);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].remedies[0], "--shift 'a.csv/joint2.qd=0.0237'");
}

TEST(VelocitiesTest, AScaledOneOfJointsThatMoveAlikeIsNotSwapped) {
  // 0.5 x 2 is nearly the other's.
  const Signal doubled = [](double t) { return 2.0 * Qd1(t); };
  EXPECT_THAT(Alike(doubled, Qd2).Faults(CheckVelocities),
              ElementsAre("velocity_scale"));
}

TEST(VelocitiesTest, OneSampleLateIsSeenAtTwentyHertz) {
  for (const double late : {0.0, 0.05}) {
    Recording recording("cartpole", EvenTimes(400, 0.05));
    recording.Add(kQ, 1, 1e-4, [](double t) { return Swing(0.5 * t); });
    recording.Add(kQd, 1, 1e-4, [late](double t) {
      return M_PI * std::cos(M_PI * (t - late));
    });
    const std::vector<Finding> findings = recording.Find(CheckVelocities);
    if (late == 0.0) {
      EXPECT_THAT(findings, IsEmpty());
      continue;
    }
    ASSERT_EQ(findings.size(), 1u);
    EXPECT_EQ(findings[0].fault, "velocity_late");
    EXPECT_EQ(findings[0].remedies[0], "--shift hinge.qd=0.05");
  }
}

std::vector<double> Uneven(int n, double period) {
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> off(-0.45, 0.45);
  std::vector<double> t = EvenTimes(n, period);
  for (double& at : t) at += period * off(engine);
  return t;
}

// Mostly at rest, and a column that never moves beside: what is seen of the
// stamps is seen where there is speed.
double Kick(double t) { return t < 8 ? 0.0 : 0.4 * std::sin(8 * (t - 8)); }

TEST(JitterTest, IsSeenWhereThereIsSpeed) {
  Recording recording("cartpole", EvenTimes(2000, 0.005));
  recording.Add(kQ, 0, 1e-3, Rest);
  recording.Add(kQ, 1, 1e-3, Kick);
  EXPECT_THAT(recording.Faults(CheckJitter), IsEmpty());
  recording.run().t = Uneven(2000, 0.005);
  EXPECT_THAT(recording.Faults(CheckJitter), ElementsAre("time_jitter"));
}

TEST(JitterTest, UnevenStepsThatAreTrueAreNone) {
  Recording recording("cartpole", Uneven(2000, 0.005));
  recording.Add(kQ, 0, 1e-3, Rest);
  recording.Add(kQ, 1, 1e-3, Kick);
  EXPECT_THAT(recording.Faults(CheckJitter), IsEmpty());
}

TEST(JitterTest, IsSeenInQuaternions) {
  Recording recording("pendulum3", EvenTimes(800, 0.01));
  recording.AddBall(0, 1e-3, [](double t) { return 2 * Swing(t); });
  recording.run().t = Uneven(800, 0.01);
  EXPECT_THAT(recording.Faults(CheckJitter), ElementsAre("time_jitter"));
}

TEST(SpikesTest, AreWhatNoCounterOfTurnsCounts) {
  Recording recording("pendulum2_planar", EvenTimes(400, 0.01));
  recording.Add(kQ, 0, 1e-3, Swing);
  double& value = recording.run().channels[0].values(200, 0);
  const double swing = value;
  for (const double turns : {1.0, -3.0, 65000.0}) {
    value = swing + turns * 2 * M_PI;
    EXPECT_THAT(recording.Faults(CheckSpikes), IsEmpty()) << turns;
  }
  for (const double turns : {0.4, -1e6, 1e14}) {
    value = swing + turns * 2 * M_PI;
    EXPECT_THAT(recording.Faults(CheckSpikes), ElementsAre("spikes")) << turns;
    EXPECT_THAT(recording.Faults(CheckFrozen), IsEmpty()) << turns;
  }
}

TEST(EffortSpikesTest, LeaveForOneSampleAndStepsStay) {
  Recording recording("cartpole", EvenTimes(400, 0.01));
  recording.Add(kQ, 0, 1e-3, Swing);
  for (int k = 0; k < 400; ++k) {
    recording.run().effort(k, 0) = k / 80 % 2 == 0 ? -3.0 : 3.0;
  }
  EXPECT_THAT(recording.Faults(CheckEffortSpikes), IsEmpty());
  recording.run().effort(100, 0) = -3.0;  // within what is commanded
  EXPECT_THAT(recording.Faults(CheckEffortSpikes), IsEmpty());
  recording.run().effort(200, 0) = 20.0;
  const std::vector<Finding> findings = recording.Find(CheckEffortSpikes);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].fault, "spikes");
  EXPECT_EQ(findings[0].subject, "slider.tau");
  EXPECT_EQ(findings[0].t_start, 2.0);
}

TEST(RangesTest, SpikesMakeNoSlideLong) {
  Recording recording("cartpole", EvenTimes(400, 0.01));
  recording.Add(kQ, 0, 1e-3, [](double t) { return 40 * Swing(t); });
  recording.run().channels[0].values(77, 0) = 150;
  EXPECT_THAT(recording.Faults(CheckRanges), IsEmpty());
  recording.run().channels[0].values *= 1000;
  EXPECT_THAT(recording.Faults(CheckRanges), ElementsAre("millimetres"));
}

}  // namespace
}  // namespace sysid
