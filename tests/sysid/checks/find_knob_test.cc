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

// The one finding's first remedy begins so, and a number stands behind.
void ExpectRemedy(const std::vector<Finding>& findings,
                  const std::string& begin, double value, double tolerance) {
  ASSERT_EQ(findings.size(), 1u);
  const std::string& remedy = findings[0].remedies.at(0);
  ASSERT_THAT(remedy, StartsWith(begin));
  EXPECT_NEAR(std::stod(remedy.substr(begin.size())), value, tolerance)
      << FullText(findings[0]);
}

TEST(FindKnobTest, ADelayOfTwoAndAHalfSamplesIsSeen) {
  constexpr double kLate = 0.025;
  SimulatedRecording recording("cartpole", 1, 3.0);
  ChannelEdits edits;
  edits.shifts = {{"hinge.q", -kLate, ""}};
  ApplyEdits(edits, recording.model().mechanism(), &recording.run(), nullptr);
  const CheckInput input = recording.Input();
  AsRead as_read(input);
  EXPECT_LT(std::abs(LinearisedValue(as_read, FindDelays, "hinge.q")),
            0.2 * kLate);
  std::vector<Finding> findings;
  EXPECT_TRUE(FindKnob(&as_read, &findings));
  // A tenth of a sample: what interpolating the channel twice leaves.
  ExpectRemedy(findings, "--shift hinge.q=", kLate, 1e-3);
  EXPECT_EQ(findings[0].fault, "channel_late");
  EXPECT_EQ(findings[0].subject, "hinge.q");
}

TEST(FindKnobTest, ADriftByATurnIsSeen) {
  constexpr double kDuration = 3.0, kRate = 2 * M_PI / kDuration;
  SimulatedRecording recording("pendulum2_planar", 1, kDuration);
  sysid::Run& run = recording.run();
  Channel* q = ChannelOf(&run, ChannelKind::kPosition, 1);
  for (int k = 0; k < run.size(); ++k) q->values(k, 0) += kRate * run.t[k];
  const CheckInput input = recording.Input();
  AsRead as_read(input);
  EXPECT_LT(std::abs(LinearisedValue(as_read, FindDrifts, "joint2.q")),
            0.2 * kRate);
  std::vector<Finding> findings;
  EXPECT_TRUE(FindKnob(&as_read, &findings));
  ExpectRemedy(findings, "--columns 'joint2.q=joint2.q-t*", kRate, 1e-3);
  EXPECT_EQ(findings[0].fault, "drift");
  EXPECT_EQ(findings[0].subject, "joint2.q");
}

TEST(FindKnobTest, AnEffortInAnotherUnitIsSeen) {
  for (const double factor : {1e-3, 5.0, 1e3}) {
    SCOPED_TRACE(factor);
    SimulatedRecording recording("cartpole", 1, 3.0);
    recording.run().effort.col(0) *= factor;  // the slider's
    const CheckInput input = recording.Input();
    AsRead as_read(input);
    std::vector<Finding> findings;
    EXPECT_TRUE(FindKnob(&as_read, &findings));
    ExpectRemedy(findings, "--columns 'slider.tau=slider.tau*", 1.0 / factor,
                 0.02 / factor);
    EXPECT_EQ(findings[0].fault, "effort_scale");
    EXPECT_EQ(findings[0].subject, "slider.tau");
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
