#include "sysid/checks/equation_error.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/readings/edit_run.h"
#include "sysid/io/channel_edits.h"
#include "tests/sysid/checks/simulated_recording.h"

namespace sysid {
namespace {

constexpr EquationError::Widths kWidths = {0.02, 0.03};  // s

double Rms(const sysid::Run& run) {
  return std::sqrt(run.effort.squaredNorm() / run.effort.size());
}

EquationError Equations(const LooseModel& model, const sysid::Run& run) {
  // In pieces, so that each block has some.
  std::vector<sysid::Run> windows;
  const int length = run.size() / 16;
  for (int first = 0; first + length <= run.size(); first += length) {
    windows.push_back(Slice(run, first, first + length));
  }
  return EquationError(model, windows, 0.13, kWidths);
}

TEST(EquationErrorTest, OfTheRightModelOnlyTheNoiseIsLeft) {
  SimulatedRecording recording("pendulum2_planar", 1, 16.0);
  const double left =
      Equations({recording.model(), {}}, recording.run()).Least();
  EXPECT_GT(left, 0.0);
  EXPECT_LT(left, 0.15 * Rms(recording.run()));
}

// Masses, centres, inertias and frictions that are wrong by any factor are
// found in one step, for all of it is linear in them.
TEST(EquationErrorTest, IsThatOfTheBestBodies) {
  SimulatedRecording recording("pendulum2_planar", 1, 16.0);
  const double right =
      Equations(WithBodies({recording.model(), {}}), recording.run()).Least();
  Set({{"link1.mass", 3.0}, {"link2.com_z", -0.1}}, &recording.model());
  const double given =
      Equations({recording.model(), {}}, recording.run()).Least();
  EXPECT_GT(given, 10.0 * right);
  EXPECT_NEAR(
      Equations(WithBodies({recording.model(), {}}), recording.run()).Least(),
      right, 1e-6 * right);
}

TEST(EquationErrorTest, GrowsWithADelayToEitherSide) {
  SimulatedRecording recording("pendulum2_planar", 1, 16.0);
  const auto at = [&](double delay) {
    sysid::Run run = recording.run();
    ChannelEdits edits;
    edits.shifts = {{"joint2.q", delay, ""}};
    ApplyEdits(edits, recording.model().mechanism(), &run, nullptr);
    return Equations({recording.model(), {}}, run).Least();
  };
  EXPECT_GT(at(0.01), 2.0 * at(0.0));
  EXPECT_GT(at(0.02), 1.5 * at(0.01));
  EXPECT_GT(at(-0.01), 2.0 * at(0.0));
}

// The blocks are neighbours in time: without the one that is spoilt the rest is
// as it was.
TEST(EquationErrorTest, ABlockCanBeLeftOut) {
  SimulatedRecording recording("pendulum2_planar", 1, 16.0);
  sysid::Run& run = recording.run();
  const double clean = Equations({recording.model(), {}}, run).Least();
  const int block = run.size() / EquationError::kBlocks;
  run.effort.topRows(block) *= -1.0;
  const EquationError spoilt = Equations({recording.model(), {}}, run);
  EXPECT_GT(spoilt.Least(), 5.0 * clean);
  EXPECT_LT(spoilt.Least(0), 1.5 * clean);
  EXPECT_GT(spoilt.Least(1), 5.0 * clean);
}

// Where a channel has no number there is no row; of none nothing is known.
TEST(EquationErrorTest, OfNothingIsInfinite) {
  SimulatedRecording recording("pendulum2_planar", 1, 4.0);
  ChannelOf(&recording.run(), ChannelKind::kPosition, 1)
      ->values.setConstant(NAN);
  EXPECT_EQ(Equations({recording.model(), {}}, recording.run()).Least(),
            INFINITY);
}

}  // namespace
}  // namespace sysid
