#include "sysid/inverse_dynamics/effort_audit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace sysid {
namespace {

// Two joints that swing: u - r is what the bodies need, and the effort that and
// friction.
std::vector<EquationRows> Swinging(double scale) {
  constexpr int kTimes = 400;
  EquationRows rows;
  rows.nv = 2;
  rows.rows.setZero(kTimes * 2, 1);
  rows.effort.resize(kTimes, 2);
  rows.qd.resize(kTimes, 2);
  rows.qdd.resize(kTimes, 2);
  rows.rests.setConstant(kTimes, 2, false);
  for (int t = 0; t < kTimes; ++t) {
    rows.t.push_back(0.05 * t);
    for (int v = 0; v < 2; ++v) {
      const double phase = (1.0 + 0.3 * v) * 0.05 * t;
      const double qd = std::cos(phase);
      const double needed = 3.0 * std::sin(0.7 * phase) - 0.5 * std::sin(phase);
      rows.qd(t, v) = qd;
      rows.qdd(t, v) = -std::sin(phase);
      rows.effort(t, v) = scale * (needed + 0.4 * qd + std::copysign(0.3, qd));
      rows.rows(t * 2 + v, 0) = rows.effort(t, v) - needed;
    }
  }
  return {rows};
}

TEST(AuditEfforts, TakesEffortsThatAreThoseOfTheirJoint) {
  for (const EffortAudit& audit : AuditEfforts(Swinging(1.0))) {
    EXPECT_GT(audit.explained, 0.99);
    EXPECT_NEAR(audit.scale, 1.0, 0.01);
    EXPECT_TRUE(audit.IsEffort());
  }
  // Of a motor whose constant is a third off, or whose sign is wrong: other
  // findings say so.
  EXPECT_TRUE(AuditEfforts(Swinging(0.3))[0].IsEffort());
  EXPECT_TRUE(AuditEfforts(Swinging(-1.0))[0].IsEffort());
}

TEST(AuditEfforts, RejectsWhatIsSoMuchLessThanTheBodiesNeed) {
  EXPECT_FALSE(AuditEfforts(Swinging(0.01))[0].IsEffort());
  EXPECT_FALSE(AuditEfforts(Swinging(50.0))[1].IsEffort());
}

TEST(AuditEfforts, RejectsWhatNoMotionOfTheJointExplains) {
  std::vector<EquationRows> runs = Swinging(1.0);
  EquationRows& rows = runs[0];
  for (int t = 0; t < rows.times(); ++t) {
    const double needed = rows.effort(t, 1) - rows.rows(t * 2 + 1, 0);
    rows.effort(t, 1) = std::sin(7.3 * t * t);
    rows.rows(t * 2 + 1, 0) = rows.effort(t, 1) - needed;
  }
  const std::vector<EffortAudit> audits = AuditEfforts(runs);
  EXPECT_TRUE(audits[0].IsEffort());
  EXPECT_LT(audits[1].explained, 0.1);
  EXPECT_FALSE(audits[1].IsEffort());
}

// Too few times decide nothing.
TEST(AuditEfforts, RejectsNothingOfFewTimes) {
  EquationRows rows;
  rows.nv = 1;
  const std::vector<EffortAudit> audits = AuditEfforts({rows});
  ASSERT_EQ(audits.size(), 1u);
  EXPECT_TRUE(audits[0].IsEffort());
}

}  // namespace
}  // namespace sysid
