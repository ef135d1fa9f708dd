// Laws of the catalogue, typed: the same fit.

#include <gmock/gmock.h>

#include "tests/support/law_twins.h"
#include "tests/support/test_name.h"

namespace sysid {
namespace {

class TypedLaws : public testing::TestWithParam<LawTwin> {};

TEST_P(TypedLaws, FitAsTheirTwinsDo) {
  const LawTwin& twin = GetParam();
  const sysid::Run run = RunOfTwins(twin);
  const Fit shipped = FitLevenbergMarquardt(ProblemOf(twin, false, run));
  const Fit typed = FitLevenbergMarquardt(ProblemOf(twin, true, run));
  ASSERT_TRUE(shipped.converged) << shipped.termination;
  ASSERT_TRUE(typed.converged) << typed.termination;
  EXPECT_NEAR(typed.train.total.normalized_rms, 1.0, 0.1);
  // Both end where a step moves the cost by 1e-7 of it: by less than a
  // thousandth in the error, by 0.05 standard errors in a parameter.
  EXPECT_NEAR(typed.train.total.normalized_rms,
              shipped.train.total.normalized_rms, 1e-3);
  for (const LawTwin::Parameter& p : twin.parameters) {
    const ParameterEstimate& a = EstimateOf(shipped, p.shipped);
    const ParameterEstimate& b = EstimateOf(typed, p.typed);
    EXPECT_NEAR(b.value, a.value, 0.05 * a.std_error) << p.typed;
    EXPECT_NEAR(b.std_error, a.std_error, 0.01 * a.std_error) << p.typed;
    EXPECT_LT(std::abs(b.value - p.truth), 4.0 * b.std_error) << p.typed;
  }
}

INSTANTIATE_TEST_SUITE_P(Textbook, TypedLaws, testing::ValuesIn(LawTwins()),
                         [](const auto& info) {
                           return TestName(info.param.shipped);
                         });

}  // namespace
}  // namespace sysid
