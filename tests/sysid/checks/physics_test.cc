#include "sysid/checks/physics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/sysid/checks/simulated_recording.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Orders of magnitude beyond any unit: no reading mends it, and silence would
// be a lie.
TEST(CheckPhysicsTest, AMotionThatNothingFollowsIsNamed) {
  SimulatedRecording recording("pendulum2_planar", 1, 2.0);
  recording.run().effort *= 1e7;
  const CheckInput input = recording.Input();
  std::vector<Finding> findings;
  EXPECT_TRUE(std::isinf(CheckPhysics(input, &findings)));
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].fault, "diverges");
  EXPECT_EQ(findings[0].file, "pendulum2_planar.csv");
  EXPECT_THAT(findings[0].consequence, HasSubstr("orders of magnitude"));
}

TEST(CheckPhysicsTest, ACleanMotionIsExplained) {
  const SimulatedRecording recording("pendulum2_planar", 1, 2.0);
  const CheckInput input = recording.Input();
  std::vector<Finding> findings;
  EXPECT_LT(CheckPhysics(input, &findings), kExplained);
  EXPECT_THAT(findings, IsEmpty());
}

}  // namespace
}  // namespace sysid
