#include "sysid/api/next_step.h"

#include <gmock/gmock.h>

#include "sysid/report/diagnosis_report.h"
#include "tests/sysid/api/api_test_case.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;

TEST(WithStep, PutsAStepBehindWhatWasAsked) {
  FitRequest request;
  request.add = {"viscous_damping@joint1"};
  request.fix = {{"link1.mass", 2.0}};
  const NextStep step{{"cogging@joint1"},
                      {{"joint1.cogging_order", 6.0}, {"joint1.cogging_sin"}},
                      "inverse_dynamics"};
  const FitRequest next = WithStep(request, step);
  EXPECT_THAT(next.add,
              ElementsAre("viscous_damping@joint1", "cogging@joint1"));
  ASSERT_EQ(next.fix.size(), 3u);
  EXPECT_EQ(next.fix[1].value, 6.0);
  EXPECT_EQ(next.solver, "inverse_dynamics");
  EXPECT_EQ(WithStep(request, {}).solver, "");
  // As flags say it.
  EXPECT_EQ(AddText(step), "cogging@joint1");
  EXPECT_EQ(FixText(step), "joint1.cogging_order=6,joint1.cogging_sin");
  EXPECT_EQ(SolverText(step), " --solver inverse_dynamics");
  EXPECT_EQ(SolverText({}), "");
}

TEST(ChooseNext, HoldsWhatWasAssumedOfAModelThatExplainsNothing) {
  const Model model = PlanarPendulum();
  Session session(model);
  session.assumed = {"link1.mass=0.25"};
  Diagnosis diagnosis(model);
  diagnosis.verdict = Verdict::kUnexplained;
  diagnosis.proposed = {"viscous_damping@joint1"};
  const NextStep step = ChooseNext(session, diagnosis);
  EXPECT_THAT(step.add, testing::IsEmpty());
  EXPECT_EQ(FixText(step), "link1.mass=0.25");
}

}  // namespace
}  // namespace sysid
