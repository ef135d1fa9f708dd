#include "sysid/checks/find_skew.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sysid/checks/readings/edit_run.h"
#include "tests/sysid/checks/simulated_recording.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Of a machine that cogs as no model here does: by a tenth to a fifth of its
// efforts, so that every prediction misses it.
SimulatedRecording Cogging(std::uint64_t seed) {
  constexpr double kTorque = 0.2, kTeeth = 7.0;  // N m, a turn
  SimulatedRecording recording("pendulum2_planar", seed, 6.0);
  sysid::Run& run = recording.run();
  for (int j = 0; j < 2; ++j) {
    const Channel* q = ChannelOf(&run, ChannelKind::kPosition, j);
    const int v = recording.model().mechanism().joints[j].v_index;
    for (int k = 0; k < run.size(); ++k) {
      run.effort(k, v) += kTorque * std::sin(kTeeth * q->values(k, 0));
    }
  }
  return recording;
}

// What of a run is late, by how much, s.
void Delay(const std::vector<std::string>& columns, double late,
           SimulatedRecording* recording) {
  ChannelEdits edits;
  for (const std::string& column : columns) {
    edits.shifts.push_back({column, -late, ""});
  }
  ApplyEdits(edits, recording->model().mechanism(), &recording->run(), nullptr);
}

std::vector<Finding> Skews(const SimulatedRecording& recording) {
  const CheckInput input = recording.Input();
  const AsRead as_read(input);
  EXPECT_GT(as_read.fit().error,
            kExplained);  // or there would be no need of it
  std::vector<Finding> findings;
  const bool found = FindSkew(as_read, &findings);
  EXPECT_EQ(found, !findings.empty());
  return findings;
}

// By which it is to be read earlier, s, of a remedy.
double ShiftOf(const std::string& remedy, const std::string& column) {
  const std::string flag = "--shift " + column + "=";
  return remedy.starts_with(flag) ? std::stod(remedy.substr(flag.size())) : NAN;
}

// Or the other by as much the other way: both late, they stay together.
TEST(FindSkewTest, AColumnThatIsLateIsNamed) {
  constexpr double kWithin = 0.004;  // s: less than half a sample
  for (const double late : {0.01, -0.01, 0.02, -0.02}) {
    for (const bool first : {true, false}) {
      const std::string column = first ? "joint1.q" : "joint2.q";
      const std::string other = first ? "joint2.q" : "joint1.q";
      SCOPED_TRACE(column + " by " + std::to_string(late));
      SimulatedRecording recording = Cogging(1);
      Delay({column}, late, &recording);
      const std::vector<Finding> findings = Skews(recording);
      ASSERT_EQ(findings.size(), 1u);
      EXPECT_EQ(findings[0].fault, "channel_late");
      EXPECT_EQ(findings[0].file, "pendulum2_planar.csv");
      EXPECT_THAT(findings[0].evidence, HasSubstr("efforts"));
      EXPECT_GT(findings[0].weight, 1.03);
      for (const std::string& remedy : findings[0].remedies) {
        EXPECT_TRUE(std::abs(ShiftOf(remedy, column) - late) < kWithin ||
                    std::abs(ShiftOf(remedy, other) + late) < kWithin)
            << FullText(findings[0]);
      }
    }
  }
}

// A spring that the model lacks, so strong that no delay shows beside it.
TEST(FindSkewTest, AColumnThatIsLateIsNamedBesideAStrongSpring) {
  constexpr double kStiffness = 30.0;  // N m/rad
  for (const double late : {0.0, 0.02}) {
    SCOPED_TRACE(late);
    SimulatedRecording recording = Cogging(1);
    sysid::Run& run = recording.run();
    for (int j = 0; j < 2; ++j) {
      const Channel* q = ChannelOf(&run, ChannelKind::kPosition, j);
      run.effort.col(j) += kStiffness * q->values.col(0);
    }
    if (late != 0.0) Delay({"joint2.q"}, late, &recording);
    EXPECT_EQ(Skews(recording).size(), late == 0.0 ? 0u : 1u);
  }
}

TEST(FindSkewTest, ColumnsInStepAreNot) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    EXPECT_THAT(Skews(Cogging(seed)), IsEmpty());
  }
}

// Which is the machine's as often as the recording's.
TEST(FindSkewTest, EffortsThatActLateAreNot) {
  for (const auto& columns : std::vector<std::vector<std::string>>{
           {"joint1.tau"}, {"joint2.tau"}, {"joint1.tau", "joint2.tau"}}) {
    SCOPED_TRACE(columns.front() + " and " + std::to_string(columns.size()));
    SimulatedRecording recording = Cogging(1);
    Delay(columns, -0.02, &recording);
    EXPECT_THAT(Skews(recording), IsEmpty());
  }
}

// Without efforts bodies of no mass satisfy the equations of any motion.
TEST(FindSkewTest, OfASwingWithoutEffortsNothingIsSaid) {
  SimulatedRecording recording = Cogging(1);
  recording.run().effort.setZero();
  Delay({"joint2.q"}, 0.02, &recording);
  EXPECT_THAT(Skews(recording), IsEmpty());
}

// One column alone is late beside its effort only, whose own delay is the
// machine's.
TEST(FindSkewTest, OfOneJointNothingIsSaid) {
  SimulatedRecording recording("rod_and_bob", 1, 4.0);
  Delay({"joint1.q"}, 0.02, &recording);
  EXPECT_THAT(Skews(recording), IsEmpty());
}

// The equations of motion need all of it.
TEST(FindSkewTest, WhereAJointIsNotMeasuredNothingIsSaid) {
  SimulatedRecording recording = Cogging(1);
  Delay({"joint2.q"}, 0.02, &recording);
  ASSERT_EQ(Skews(recording).size(), 1u);
  std::erase_if(recording.run().channels,
                [](const Channel& channel) { return channel.target == 0; });
  EXPECT_THAT(Skews(recording), IsEmpty());
}

TEST(FindSkewTest, OfBallJointsNothingIsSaid) {
  SimulatedRecording recording("pendulum3", 1, 2.0);
  const CheckInput input = recording.Input();
  const AsRead as_read(input);
  std::vector<Finding> findings;
  EXPECT_FALSE(FindSkew(as_read, &findings));
  EXPECT_THAT(findings, IsEmpty());
}

}  // namespace
}  // namespace sysid
