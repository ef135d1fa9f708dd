#include "sysid/estimation/run_parts.h"

#include <gtest/gtest.h>

#include <vector>

#include "sysid/simulation/simulate.h"
#include "tests/support/fit_setup.h"
#include "tests/support/measured_run.h"

namespace sysid {
namespace {

sysid::Run Driven(const Model& model) {
  SimulationOptions options;
  options.duration = 4.0;
  options.noise = 1e-3;
  options.seed = 1;
  options.excitation = Excitation::kMultisine;
  options.excitation_level = 0.3;
  return Simulate(model, RandomState(model, 0.5, 1), options);
}

TEST(HoldOutLastQuarter, KeepsTimesEffortsAndMeasurements) {
  const Model model = Shipped("cartpole");
  const sysid::Run whole = Driven(model);
  std::vector<sysid::Run> runs{whole};
  const std::vector<sysid::Run> held = HoldOutLastQuarter(&runs);
  ASSERT_EQ(runs.size(), 1u);
  ASSERT_EQ(held.size(), 1u);
  EXPECT_EQ(held[0].name, whole.name);
  EXPECT_NEAR(held[0].size(), whole.size() / 4.0, 2.0);
  // One sample is in both: the last of one begins the other.
  ASSERT_EQ(runs[0].size() + held[0].size(), whole.size() + 1);
  const int cut = runs[0].size() - 1;
  const auto expect_part = [&](const sysid::Run& part, int first) {
    ASSERT_EQ(part.channels.size(), whole.channels.size());
    for (int k = 0; k < part.size(); ++k) {
      EXPECT_EQ(part.t[k], whole.t[first + k]);
      EXPECT_EQ(part.effort.row(k), whole.effort.row(first + k));
      for (size_t c = 0; c < whole.channels.size(); ++c) {
        EXPECT_EQ(part.channels[c].name, whole.channels[c].name);
        EXPECT_EQ(part.channels[c].values.row(k),
                  whole.channels[c].values.row(first + k));
      }
    }
  };
  expect_part(runs[0], 0);
  expect_part(held[0], cut);
  expect_part(JoinEnds(runs, held)[0], 0);
  EXPECT_EQ(JoinEnds(runs, held)[0].t, whole.t);
  // Efforts after the cut are the end's, as thinning leaves them there.
  ThinRuns(25.0, &runs);
  std::vector<sysid::Run> thin = held;
  ThinRuns(25.0, &thin);
  const sysid::Run joined = JoinEnds(runs, thin)[0];
  ASSERT_EQ(joined.t.back(), thin[0].t.back());
  const int ends = joined.size() - thin[0].size();
  EXPECT_EQ(joined.t[ends], thin[0].t[0]);
  EXPECT_LT(joined.t[ends - 1], thin[0].t[0]);
  EXPECT_EQ(joined.effort.bottomRows(thin[0].size()), thin[0].effort);
}

// Every n-th sample, and the efforts whose impulse is that of all.
TEST(ThinRuns, KeepsTheImpulseOfTheEfforts) {
  const Model model = Shipped("cartpole");
  const sysid::Run whole = Driven(model);
  std::vector<sysid::Run> runs{whole, whole};
  runs[1].t.clear();
  for (const double t : whole.t) runs[1].t.push_back(10 * t);  // 10 Hz
  EXPECT_EQ(ThinRuns(25.0, &runs), 4);
  EXPECT_EQ(runs[1].size(), whole.size());
  const sysid::Run& thin = runs[0];
  ASSERT_EQ(thin.size(), (whole.size() + 3) / 4);
  for (int i = 0; i + 1 < thin.size(); ++i) {
    EXPECT_EQ(thin.t[i], whole.t[4 * i]);
    EXPECT_EQ(thin.channels[0].values.row(i),
              whole.channels[0].values.row(4 * i));
    double impulse = 0.0;
    for (int k = 4 * i; k < 4 * i + 4; ++k) {
      impulse += whole.effort(k, 0) * (whole.t[k + 1] - whole.t[k]);
    }
    EXPECT_NEAR(thin.effort(i, 0) * (thin.t[i + 1] - thin.t[i]), impulse,
                1e-12);
  }
}

}  // namespace
}  // namespace sysid
