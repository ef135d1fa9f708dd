#include "sysid/diagnosis/evaluated_model.h"

#include <gtest/gtest.h>

#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/unexplained_force/discrepancy.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

// A joint that friction holds all the time rests with any inertia that is large
// enough: that predicts as well as what is there, and says nothing.
TEST(PValueOf, IsLargeOfAnInertiaThatOnlyHoldsItsJoint) {
  const Model truth = Shipped("pendulum2_planar", {"coulomb_friction@joint1"},
                              {{"joint1.friction", 50.0}});
  std::vector<sysid::Run> runs;
  for (int seed = 1; seed <= 3; ++seed) {
    runs.push_back(Record(truth, seed, {.duration = 4.0}));
  }
  const DiagnosisProblem problem =
      MakeProblem(Shipped("pendulum2_planar"), {{"link2.length", 0.5}}, runs);
  const auto armature =
      Catalogue().Make("armature@joint1", problem.model.mechanism(), "test");
  const EvaluatedModel base = EvaluateGiven(problem);
  // Of a pendulum of 1 kg and 1 m.
  const EvaluatedModel after =
      EvaluateFrom(problem, base, {armature}, {}, {{{"joint1.armature", 1e6}}},
                   0.0, problem.options);
  ASSERT_LT(after.train_error(), 0.5 * base.train_error());
  EXPECT_GT(PValueOf(*armature, problem.model, after.fit), kByChance);
}

// Segments whose spins went astray stay there; whole runs tell.
TEST(EvaluateJoined, FindsTheSpinsThatSegmentsMiss) {
  const Model model = Shipped("pendulum2");
  std::vector<sysid::Run> runs;
  for (int seed = 1; seed <= 2; ++seed) {
    runs.push_back(Record(model, seed, {.duration = 4.0}));
  }
  DiagnosisProblem problem =
      MakeProblem(model, {{"link1.length", 0.5}, {"link2.length", 0.5}}, runs);
  EvaluatedModel base = EvaluateGiven(problem);
  ASSERT_TRUE(HasBlindStates(base));
  // Spins by 20 rad/s about each link, which no heading shows.
  for (Solution::Nodes* nodes :
       {&base.fit.point.runs[0], &base.holdout_point.runs[0]}) {
    for (int k = 0; k < nodes->segments(); ++k) {
      for (const Body& body : model.bodies()) {
        nodes->states(k, model.nq() + body.v_index + 2) += 20.0;
      }
    }
  }
  const EvaluatedModel astray = EvaluateAgain(problem, std::move(base));
  const EvaluatedModel joined = EvaluateJoined(problem, astray);
  EXPECT_GT(astray.train_error(), 1.5);
  EXPECT_LT(joined.train_error(), 1.1);
  EXPECT_LT(joined.holdout_error(), 1.1);
}

}  // namespace
}  // namespace sysid
