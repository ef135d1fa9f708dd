#include "sysid/checks/find_idle_effort.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sysid/checks/simulated_recording.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kDuration = 2.0;

SimulatedRecording DrivenPendulum(std::uint64_t seed) {
  return SimulatedRecording("rod_and_bob", seed, kDuration);
}

std::vector<Finding> IdleEfforts(const SimulatedRecording& recording) {
  const CheckInput input = recording.Input();
  const AsRead as_read(input);
  std::vector<Finding> findings;
  const bool found = FindIdleEffort(as_read, &findings);
  EXPECT_EQ(found, !findings.empty());
  return findings;
}

TEST(FindIdleEffortTest, AnEffortOfAnotherExperimentIsNamed) {
  SimulatedRecording recording = DrivenPendulum(1);
  recording.run().effort = DrivenPendulum(11).run().effort;
  const std::vector<Finding> findings = IdleEfforts(recording);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].fault, "effort_idle");
  EXPECT_EQ(findings[0].subject, "joint1.tau");
  EXPECT_EQ(findings[0].file, "rod_and_bob.csv");
  EXPECT_THAT(findings[0].evidence,
              HasSubstr("the motion follows it by a factor of "));
  EXPECT_EQ(findings[0].consequence,
            "what was recorded there is not what moved the mechanism");
  EXPECT_THAT(findings[0].remedies,
              ElementsAre("--columns 'joint1.tau=joint1.tau*1e-9'"));
}

// Each by itself, and both.
TEST(FindIdleEffortTest, OfTwoEffortsTheIdleOnesAreNamed) {
  SimulatedRecording other("pendulum2_planar", 26, 3.0);
  for (const char* names :
       {"joint1.tau", "joint2.tau", "joint1.tau, joint2.tau"}) {
    SCOPED_TRACE(names);
    SimulatedRecording recording("pendulum2_planar", 6, 3.0);
    for (int j = 0; j < 2; ++j) {
      const std::string name = "joint" + std::to_string(j + 1) + ".tau";
      if (!testing::Value(names, HasSubstr(name))) continue;
      recording.run().effort.col(j) = other.run().effort.col(j);
    }
    const std::vector<Finding> findings = IdleEfforts(recording);
    ASSERT_EQ(findings.size(), 1u);
    EXPECT_EQ(findings[0].subject, names);
  }
}

TEST(FindIdleEffortTest, OneThatIsTheMotionsIsNot) {
  EXPECT_THAT(IdleEfforts(DrivenPendulum(1)), IsEmpty());
}

// Which makes the motion another in which the effort hardly counts.
TEST(FindIdleEffortTest, OneBesideAStrongSpringIsNot) {
  SimulatedRecording recording = DrivenPendulum(1);
  constexpr double kStiffness = 20.0;  // N m/rad
  sysid::Run& run = recording.run();
  // What a spring does, the recorded effort does not say.
  run.effort.col(0) += kStiffness * run.channels[0].values.col(0);
  EXPECT_THAT(IdleEfforts(recording), IsEmpty());
}

// The model does better without it, but best with a part of it.
TEST(FindIdleEffortTest, OneThatIsTooLargeIsNot) {
  for (const double factor : {2.5, 5.0, 100.0}) {
    SCOPED_TRACE(factor);
    SimulatedRecording recording = DrivenPendulum(1);
    recording.run().effort *= factor;
    EXPECT_THAT(IdleEfforts(recording), IsEmpty());
  }
}

// What is wrong with another effort is not this one's.
TEST(FindIdleEffortTest, OneBesideOneOfAnotherUnitIsNot) {
  SimulatedRecording recording("pendulum2_planar", 4, 3.0);
  recording.run().effort.col(0) *= 0.1;
  EXPECT_THAT(IdleEfforts(recording), IsEmpty());
}

// Of bodies that are too light the same; too heavy ones hardly feel it.
TEST(FindIdleEffortTest, OneOfBodiesThatAreWrongIsNot) {
  for (const double factor : {0.4, 5.0, 1000.0}) {
    SCOPED_TRACE(factor);
    SimulatedRecording recording = DrivenPendulum(1);
    MechanismParameters<double> values = recording.model().nominal();
    for (Inertial<double>& body : values.links) {
      body.mass *= factor;
      body.inertia *= factor;
    }
    recording.model().SetNominal(values);
    EXPECT_THAT(IdleEfforts(recording), IsEmpty());
  }
}

}  // namespace
}  // namespace sysid
