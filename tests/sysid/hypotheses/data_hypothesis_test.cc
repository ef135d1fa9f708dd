#include "sysid/hypotheses/data_hypothesis.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sysid/hypotheses/coarse_fit.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

Run Recording(const std::string& name, const Model& model) {
  Run run;
  run.name = name;
  for (int k = 0; k < 50; ++k) run.t.push_back(0.01 * k);
  for (int j = 0; j < 2; ++j) {
    Channel channel;
    channel.kind = ChannelKind::kPosition;
    channel.target = j;
    channel.name = model.mechanism().joints[j].name;
    channel.values = RowMatrixXd::Constant(50, 1, 1.0 + j);
    run.channels.push_back(channel);
  }
  run.effort = RowMatrixXd::Ones(50, 2);
  return run;
}

class DataHypothesisTest : public ::testing::Test {
 protected:
  DataHypothesisTest()
      : model_(Shipped("pendulum2_planar")),
        a_(Recording("a.csv", model_)),
        b_(Recording("runs/b.csv", model_)) {
    input_.model = &model_;
    input_.free = &free_;
    input_.runs = {&a_, &b_};
  }
  DataHypothesis Of(DataFault fault, const std::string& subject) const {
    for (const DataHypothesis& h : AllHypotheses(input_)) {
      if (h.fault == fault && h.subject() == subject) return h;
    }
    ADD_FAILURE() << "no " << ToString(fault) << " of " << subject;
    return {};
  }

  Model model_;
  std::vector<FreeParameter> free_;
  sysid::Run a_, b_;
  CheckInput input_;
};

TEST_F(DataHypothesisTest, FixesOfSomeRunsAreOneFlag) {
  const auto fix = [&](const DataHypothesis& hypothesis,
                       const std::vector<int>& runs, double p = 0.0) {
    return Join(FixTexts(input_, Suppose(hypothesis, runs, p)), " ");
  };
  const DataHypothesis flipped = Of(DataFault::kAxisFlipped, "joint2.q");
  EXPECT_EQ(fix(flipped, {}), "--columns joint2.q=-joint2.q");
  EXPECT_EQ(fix(flipped, {1}), "--columns 'b.csv/joint2.q=-joint2.q'");
  EXPECT_EQ(fix(flipped, {0, 1}),
            "--columns 'a.csv/joint2.q=-joint2.q,b.csv/joint2.q=-joint2.q'");
  const DataHypothesis late = Of(DataFault::kChannelLate, "joint1.q");
  EXPECT_EQ(fix(late, {0, 1}, 0.02),
            "--shift 'a.csv/joint1.q=0.02,b.csv/joint1.q=0.02'");
}

TEST_F(DataHypothesisTest, TakesDegreesOfAllHingesForOneFault) {
  const Supposition degrees =
      Suppose(Of(DataFault::kDegrees, "joint1.q, joint2.q"), {}, 0.0);
  const Mechanism& mechanism = model_.mechanism();
  sysid::Run a = a_;
  Undo(degrees, mechanism, 0, &a);
  for (const Channel& channel : a.channels) {
    EXPECT_LT(std::abs(channel.values(0, 0)), 0.1) << channel.name;
  }
}

TEST_F(DataHypothesisTest, ChangesTheRunsThatItIsOfAlone) {
  const Supposition degrees =
      Suppose(Of(DataFault::kDegrees, "joint2.q"), {1}, 0.0);
  const Mechanism& mechanism = model_.mechanism();
  sysid::Run a = a_, b = b_;
  Undo(degrees, mechanism, 0, &a);
  Undo(degrees, mechanism, 1, &b);
  EXPECT_EQ(a.channels[1].values(0, 0), 2.0);
  EXPECT_NEAR(b.channels[1].values(0, 0), 2.0 * M_PI / 180.0, 1e-15);
  EXPECT_EQ(b.channels[0].values(0, 0), 1.0);
  EXPECT_NEAR(LogUnit(degrees, mechanism, b.channels[1]),
              std::log(M_PI / 180.0), 1e-12);
  EXPECT_EQ(LogUnit(degrees, mechanism, b.channels[0]), 0.0);
}

// Continuous hypotheses are nothing at 0.
TEST_F(DataHypothesisTest, AScalarOfNothingChangesNothing) {
  for (const DataHypothesis& hypothesis : AllHypotheses(input_)) {
    if (!hypothesis.is_continuous()) continue;
    sysid::Run run = a_;
    Undo(Suppose(hypothesis, {}, 0.0), model_.mechanism(), 0, &run);
    const std::string name = ToString(hypothesis.fault);
    EXPECT_EQ(run.t, a_.t) << name;
    EXPECT_EQ(run.effort, a_.effort) << name;
    for (int c = 0; c < 2; ++c) {
      EXPECT_EQ(run.channels[c].values, a_.channels[c].values) << name;
    }
  }
}

TEST(CompareTest, IsOfTheWindowsOfTheRunsThatChange) {
  CoarseFit as_read, changed;
  as_read.log_errors = RowMatrixXd::Zero(6, 2);
  changed.log_errors = RowMatrixXd::Zero(6, 2);
  as_read.weights = RowMatrixXd::Constant(6, 2, 0.5);
  changed.log_errors.bottomRows(3) << -1.0, -1.2, -1.1, -1.1, -1.0, -1.1;
  const std::vector<int> held_runs = {0, 0, 0, 1, 1, 1};
  const Difference all = Compare(as_read, changed, held_runs, {});
  EXPECT_EQ(all.windows, 6);
  EXPECT_NEAR(all.mean, 3.25 / 6.0, 1e-12);
  EXPECT_FALSE(all.IsBetter(3.0, 1.1));
  const Difference second = Compare(as_read, changed, held_runs, {1});
  EXPECT_EQ(second.windows, 3);
  EXPECT_NEAR(second.mean, 3.25 / 3.0, 1e-12);
  EXPECT_NEAR(second.std_error, std::sqrt(0.005 / 3.0 / 6.0), 1e-12);
  EXPECT_TRUE(second.IsBetter(3.0, 1.1));
  EXPECT_TRUE(Compare(as_read, changed, held_runs, {0}).IsTie());
}

TEST(CompareTest, HasNoUseOfWindowsAtRest) {
  CoarseFit as_read, changed;
  as_read.log_errors = RowMatrixXd::Zero(8, 1);
  changed.log_errors = RowMatrixXd::Zero(8, 1);
  as_read.weights = RowMatrixXd::Zero(8, 1);
  changed.log_errors.topRows(4) << -1.0, -1.2, -1.1, -1.1;
  as_read.weights.topRows(4).setConstant(0.5);
  const std::vector<int> held_runs(8, 0);
  const Difference moving = Compare(as_read, changed, held_runs, {});
  EXPECT_NEAR(moving.windows, 4.0, 1e-12);
  EXPECT_NEAR(moving.mean, 1.1, 1e-12);
  EXPECT_NEAR(moving.std_error, std::sqrt(0.02 / 3.0 / 4.0), 1e-12);
  EXPECT_TRUE(moving.IsBetter(3.0, 1.1));
  as_read.weights.setConstant(0.5);
  EXPECT_FALSE(Compare(as_read, changed, held_runs, {}).IsBetter(3.0, 1.1));
}

}  // namespace
}  // namespace sysid
