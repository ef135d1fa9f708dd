#include "sysid/diagnosis/stability.h"

#include <gmock/gmock.h>

#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

// A machine with one law, fitted with another one.
EvaluatedModel FittedWith(const std::string& law, const std::string& planted,
                          const Value& value) {
  const Model truth = Shipped("pendulum2_planar", {planted}, {value});
  std::vector<sysid::Run> runs;
  for (int seed = 1; seed <= 4; ++seed) {
    runs.push_back(Record(truth, seed, {.duration = 6.0}));
  }
  const DiagnosisProblem problem =
      MakeProblem(Shipped("pendulum2_planar"), {{"link2.length", 0.5}}, runs);
  const EvaluatedModel base = EvaluateGiven(problem);
  const auto effect = Catalogue().Make(law, problem.model.mechanism(), "test");
  return EvaluateFrom(problem, base, {effect}, {}, {ValuesOf(base)}, 0.0,
                      problem.options);
}

TEST(ParametersByStrataTest, FindTheRightLawConstant) {
  const EvaluatedModel fitted =
      FittedWith("cubic_damping@joint2", "cubic_damping@joint2",
                 {"joint2.cubic_damping", 0.004});
  const auto all = ParametersByStrata(fitted);
  ASSERT_FALSE(all.empty());
  for (const ParameterByStrata& one : all) {
    EXPECT_TRUE(one.IsConstant()) << NameOf(one.strata) << one.least_spread;
    EXPECT_GE(one.estimates.size(), 2u);
    EXPECT_EQ(one.parameter, "joint2.cubic_damping");
    if (one.strata != Strata::kRun) continue;
    EXPECT_EQ(one.estimates.size(), fitted.problem->runs().size());
  }
  EXPECT_THAT(StandIns(all), testing::IsEmpty());
}

TEST(ParametersByStrataTest, FindAStandInThatIsNot) {
  const auto found = StandIns(ParametersByStrata(
      FittedWith("viscous_damping@joint2", "cubic_damping@joint2",
                 {"joint2.cubic_damping", 0.004})));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].effect, "viscous_damping@joint2");
  EXPECT_GT(found[0].least_spread, 0.15);
  EXPECT_GT(found[0].gain, 0.0);
}

TEST(ParametersByStrataTest, AreNoneWithoutEffects) {
  const Model model = Shipped("pendulum2_planar");
  const DiagnosisProblem problem = MakeProblem(
      model, {{"link2.length", 0.5}}, {Record(model, 1), Record(model, 2)});
  EXPECT_THAT(ParametersByStrata(EvaluateGiven(problem)), testing::IsEmpty());
}

}  // namespace
}  // namespace sysid
