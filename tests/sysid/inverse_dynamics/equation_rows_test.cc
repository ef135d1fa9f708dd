#include "sysid/inverse_dynamics/equation_rows.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/sysid/inverse_dynamics/two_links.h"

namespace sysid {
namespace {

constexpr EquationFilter kFilter = {0.015, 0.03};  // s
constexpr double kRounding = 1e-9;                 // of the largest number

EquationRows RowsOf(const Model& model, const Run& run, int threads) {
  return EvaluateEquations(model, SampleMotion(model, run, kFilter, threads),
                           model.nominal(), {}, threads);
}

// All that belongs to a time of some rows is what belongs to one of others.
void ExpectSameAt(const EquationRows& a, int i, const EquationRows& b, int k) {
  SCOPED_TRACE(a.t[i]);
  EXPECT_EQ(a.t[i], b.t[k]);
  const auto same = [](const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
    EXPECT_LE((x - y).norm(), kRounding * (1.0 + y.norm()));
  };
  same(a.rows.middleRows(i * a.nv, a.nv), b.rows.middleRows(k * b.nv, b.nv));
  same(a.effort.row(i), b.effort.row(k));
  same(a.qd.row(i), b.qd.row(k));
  same(a.qdd.row(i), b.qdd.row(k));
  EXPECT_EQ(a.rests.row(i), b.rests.row(k));
}

TEST(EquationRows, AreTheSameByAnyNumberOfThreads) {
  const Model model = FrictionArm(0.1);
  const sysid::Run run = Shaken(model, 1e-4, 1);
  const EquationRows alone = RowsOf(model, run, 1);
  const EquationRows by_three = RowsOf(model, run, 3);
  ASSERT_GT(alone.times(), 2 * kTimesOfRange);
  ASSERT_EQ(by_three.times(), alone.times());
  for (int i = 0; i < alone.times(); ++i) {
    ExpectSameAt(by_three, i, alone, i);
  }
}

// Where one range ends and the next begins nothing changes: a run that begins
// later, by a whole number of widths, has the same rows in other ranges.
TEST(EquationRows, AreTheSameInOtherRanges) {
  const Model model = FrictionArm(0.1);
  const sysid::Run run = Shaken(model, 1e-4, 1);
  const double later = 100 * kFilter.average, end = run.t.back();
  const EquationRows all = RowsOf(model, run, 1);
  const EquationRows part = EvaluateEquations(
      model, SampleMotion(model, run, later, end, kFilter), model.nominal());
  ASSERT_GT(part.times(), kTimesOfRange);
  for (int i = 1; i < part.times(); ++i) {
    const int k = i + all.times() - part.times();
    EXPECT_NEAR(part.t[i], all.t[k], kRounding);
    const auto r = part.rows.middleRows(i * part.nv, part.nv);
    const auto of_all = all.rows.middleRows(k * all.nv, all.nv);
    EXPECT_LE((r - of_all).norm(), 1e-6 * (1.0 + of_all.norm())) << part.t[i];
  }
}

// Of what is measured beside a gap nothing is lost, or told of another time.
TEST(EquationRows, LeaveOutAGapAndNothingElse) {
  constexpr double kFrom = 5.0, kTo = 5.5;
  const Model model = FrictionArm(0.1);
  const sysid::Run whole = Shaken(model, 1e-4, 1);
  sysid::Run gap = whole;
  for (int k = 0; k < gap.size(); ++k) {
    if (gap.t[k] <= kFrom || gap.t[k] >= kTo) continue;
    for (Channel& channel : gap.channels) {
      channel.values.row(k).setConstant(
          std::numeric_limits<double>::quiet_NaN());
    }
  }
  const EquationRows all = RowsOf(model, whole, 1);
  const EquationRows rows = RowsOf(model, gap, 1);
  ASSERT_LT(rows.times(), all.times());
  // How far a missing sample reaches.
  const double reach = 2.0 * ReachOf(kFilter) + 1.0;
  int i = 0, compared = 0;
  for (int k = 0; k < all.times(); ++k) {
    if (all.t[k] > kFrom - reach && all.t[k] < kTo + reach) continue;
    while (i < rows.times() && rows.t[i] < all.t[k]) ++i;
    ASSERT_LT(i, rows.times());
    ExpectSameAt(rows, i, all, k);
    compared += all.t[k] > kTo;
  }
  EXPECT_GT(compared, kTimesOfRange);
}

}  // namespace
}  // namespace sysid
