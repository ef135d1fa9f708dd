#include "sysid/checks/finding.h"

#include <gtest/gtest.h>

namespace sysid {
namespace {

Finding Of(const std::string& fault, Severity severity, double weight) {
  Finding finding;
  finding.fault = fault;
  finding.severity = severity;
  finding.weight = weight;
  return finding;
}

TEST(FindingTest, WorstComeFirst) {
  std::vector<Finding> findings = {
      Of("a", Severity::kNote, 9), Of("b", Severity::kWrong, 1),
      Of("c", Severity::kWrong, 2), Of("d", Severity::kUnreadable, 0)};
  Sort(&findings);
  std::string order;
  for (const Finding& finding : findings) order += finding.fault;
  EXPECT_EQ(order, "dcba");
}

// A reading that the model does not follow either may be the fault of what the
// numbers show; one that explains the data is not.
TEST(FindingTest, WhatIsNotExplainedStandsBehindTheNumbers) {
  Finding guess = Of("a", Severity::kWrong, 9),
          sure = Of("b", Severity::kWrong, 2);
  guess.error_left = 10.0;
  sure.error_left = 1.1;
  std::vector<Finding> findings = {guess, Of("c", Severity::kHarmful, 1), sure,
                                   Of("d", Severity::kNote, 9)};
  Sort(&findings);
  std::string order;
  for (const Finding& finding : findings) order += finding.fault;
  EXPECT_EQ(order, "bcad");
}

TEST(FindingTest, TextSaysPlaceEvidenceAndRemedies) {
  Finding finding = Of("spikes", Severity::kWrong, 1);
  finding.file = "a.csv";
  finding.subject = "joint1.q";
  finding.t_start = 1.5;
  finding.t_end = 2;
  finding.evidence = "2 values jump";
  finding.consequence = "least squares bend";
  finding.remedies = {"--ignore x", "--loss huber"};
  EXPECT_EQ(PlaceOf(finding), "a.csv: joint1.q, 1.5 s to 2 s");
  EXPECT_EQ(BriefText(finding),
            "spikes: a.csv: joint1.q, 1.5 s to 2 s: 2 values jump; try "
            "--ignore x");
  EXPECT_EQ(FullText(finding),
            "spikes  a.csv: joint1.q, 1.5 s to 2 s\n    2 values jump\n"
            "    least squares bend\n    suggested fix: --ignore x\n"
            "             or: --loss huber\n");
}

}  // namespace
}  // namespace sysid
