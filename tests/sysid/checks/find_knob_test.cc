// Where a knob begins: faults so large that the linearisation as they were read
// says nothing of them, and a glance at the family's own starts does.

#include "sysid/checks/find_knob.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sysid/checks/knobs.h"
#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/shipped_checks.h"
#include "tests/sysid/checks/simulated_recording.h"

namespace sysid {
namespace {

using ::testing::IsEmpty;
using ::testing::StartsWith;

// What the linearisation alone says of a family's knob.
double LinearisedValue(const AsRead& as_read, KnobFamily family,
                       const std::string& subject) {
  std::vector<Knob> knobs;
  family(as_read.input(), &knobs);
  std::erase_if(knobs, [&](const Knob& k) { return k.subject != subject; });
  EXPECT_EQ(knobs.size(), 1u);
  return ScoreKnobs(as_read.lean(), as_read.short_fit(), as_read.excerpt(),
                    knobs)
      .front()
      .value;
}

// One finding, whose first remedy begins so, and a number stands behind.
struct Expected {
  std::string fault, subject, remedy;
  double value, tolerance;
};
void ExpectFinding(AsRead* as_read, const Expected& expected) {
  std::vector<Finding> findings;
  EXPECT_TRUE(FindKnob(as_read, &findings));
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].fault, expected.fault);
  EXPECT_EQ(findings[0].subject, expected.subject);
  const std::string& remedy = findings[0].remedies.at(0);
  ASSERT_THAT(remedy, StartsWith(expected.remedy));
  EXPECT_NEAR(std::stod(remedy.substr(expected.remedy.size())), expected.value,
              expected.tolerance)
      << FullText(findings[0]);
}

// The same, where the linearisation sees next to nothing of it.
void ExpectSeenByStarts(const SimulatedRecording& recording, KnobFamily family,
                        const Expected& expected) {
  const CheckInput input = recording.Input();
  AsRead as_read(input);
  EXPECT_LT(std::abs(LinearisedValue(as_read, family, expected.subject)),
            0.2 * expected.value);
  ExpectFinding(&as_read, expected);
}

SimulatedRecording LateCartpole(std::uint64_t seed, const std::string& column,
                                double late) {
  SimulatedRecording recording("cartpole", seed, 3.0);
  ChannelEdits edits;
  edits.shifts = {{column, -late, ""}};
  ApplyEdits(edits, recording.model().mechanism(), &recording.run(), nullptr);
  return recording;
}

TEST(FindKnobTest, ADelayOfTwoAndAHalfSamplesIsSeen) {
  constexpr double kLate = 0.025;
  const SimulatedRecording recording = LateCartpole(1, "hinge.q", kLate);
  // A tenth of a sample: what interpolating the channel twice leaves.
  ExpectSeenByStarts(
      recording, FindDelays,
      {"channel_late", "hinge.q", "--shift hinge.q=", kLate, 1e-3});
}

// Of a slow motion short segments show nothing.
TEST(FindKnobTest, ADelayThatOnlyWholeWindowsShowIsSeen) {
  constexpr double kLate = 0.01;
  const SimulatedRecording recording = LateCartpole(4, "slider.q", kLate);
  const CheckInput input = recording.Input();
  AsRead as_read(input);
  EXPECT_LT(as_read.short_fit().error, 1.1);
  ExpectFinding(&as_read,
                {"channel_late", "slider.q", "--shift slider.q=", kLate, 1e-3});
}

TEST(FindKnobTest, ADriftByATurnIsSeen) {
  constexpr double kDuration = 3.0, kRate = 2 * M_PI / kDuration;
  SimulatedRecording recording("pendulum2_planar", 1, kDuration);
  sysid::Run& run = recording.run();
  Channel* q = ChannelOf(&run, ChannelKind::kPosition, 1);
  for (int k = 0; k < run.size(); ++k) q->values(k, 0) += kRate * run.t[k];
  ExpectSeenByStarts(
      recording, FindDrifts,
      {"drift", "joint2.q", "--columns 'joint2.q=joint2.q-t*", kRate, 1e-3});
}

TEST(FindKnobTest, AnEffortInAnotherUnitIsSeen) {
  for (const double factor : {1e-3, 5.0, 1e3}) {
    SCOPED_TRACE(factor);
    SimulatedRecording recording("cartpole", 1, 3.0);
    recording.run().effort.col(0) *= factor;  // the slider's
    const CheckInput input = recording.Input();
    AsRead as_read(input);
    ExpectFinding(&as_read, {"effort_scale", "slider.tau",
                             "--columns 'slider.tau=slider.tau*", 1.0 / factor,
                             0.02 / factor});
  }
}

TEST(FindKnobTest, ACleanRecordingHasNone) {
  const SimulatedRecording recording("cartpole", 1, 3.0);
  const CheckInput input = recording.Input();
  AsRead as_read(input);
  EXPECT_LT(as_read.fit().error, 1.2);
  std::vector<Finding> findings;
  EXPECT_FALSE(FindKnob(&as_read, &findings));
  EXPECT_THAT(findings, IsEmpty());
}

}  // namespace
}  // namespace sysid
