#include "sysid/diagnosis/formula_proposals.h"

#include <gmock/gmock.h>

#include <cmath>
#include <set>

#include "models/effects/catalogue.h"
#include "sysid/diagnosis/formula_terms.h"
#include "tests/support/all_joints.h"
#include "tests/support/random_force.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> ShapesOf(const Mechanism& mechanism,
                                  const std::string& joint, bool driven,
                                  const std::vector<std::string>& inputs) {
  std::vector<std::string> shapes;
  for (const FormulaTerm& term :
       TermsOf(mechanism, mechanism.FindJoint(joint), driven, inputs)) {
    shapes.push_back(term.shape);
  }
  return shapes;
}

TEST(FormulaTerms, AreLawsThatAUserCouldType) {
  Mechanism mechanism = AllJoints();
  mechanism.inputs = {"oil", "bus voltage"};
  const Catalogue catalogue;
  for (const std::string joint : {"hinge", "slide", "wheel"}) {
    std::set<std::string> laws;
    for (const FormulaTerm& term : TermsOf(
             mechanism, mechanism.FindJoint(joint), true, mechanism.inputs)) {
      const std::string law = "custom@" + joint + ": " + TextOf(term, "7");
      EXPECT_TRUE(laws.insert(law).second) << law << " is there twice";
      const auto effect = catalogue.Make(law, mechanism, "test");
      EXPECT_EQ(effect->parameters()[0].name, joint + ".c7");
      EXPECT_TRUE(effect->parameters()[0].grid.empty()) << law;
    }
  }
}

TEST(FormulaTerms, ReadOnlyWhatIsThere) {
  const Mechanism mechanism = AllJoints();
  const auto driven = ShapesOf(mechanism, "hinge", true, {"oil"});
  EXPECT_THAT(driven, Contains("q^2*qd"));
  EXPECT_THAT(driven, Contains("q*tau*oil"));
  for (const std::string& shape : ShapesOf(mechanism, "slide", false, {})) {
    EXPECT_EQ(shape.find("tau"), std::string::npos) << shape;
    EXPECT_EQ(shape.find("sin(q)"), std::string::npos) << shape;
  }
}

TEST(FormulaTerms, ReadTheJointsNextToIt) {
  const Mechanism chain = Shipped("pendulum3_planar").mechanism();
  const auto middle = ShapesOf(chain, "joint2", true, {});
  EXPECT_THAT(middle, Contains("abs(joint1.qd)*qd"));
  EXPECT_THAT(middle, Contains("cos(q+joint3.q)*tau"));
  for (const std::string& shape : ShapesOf(chain, "joint1", true, {})) {
    EXPECT_EQ(shape.find("joint3"), std::string::npos) << shape;
  }
}

// Two planar links with laws that the catalogue lacks.
class ProposeFormulasTest : public ::testing::Test {
 protected:
  ProposeFormulasTest() : model_(Shipped("pendulum2_planar")) {}

  DiagnosisProblem Recorded(const Model& truth) const {
    std::vector<sysid::Run> runs;
    for (int seed = 1; seed <= 3; ++seed) {
      runs.push_back(Record(truth, seed, {.duration = 6.0, .level = 1.0}));
    }
    return MakeProblem(model_, {{"link1.length", 0.5}, {"link2.length", 0.5}},
                       runs);
  }
  static std::vector<FormulaProposal> Propose(
      const DiagnosisProblem& problem, const EvaluatedModel& found,
      const std::set<std::string>& joints = {"joint1", "joint2"}) {
    constexpr int kCatalogue = 40;
    return ProposeFormulas(problem, found, joints, kCatalogue,
                           [](const std::string&, double) {});
  }
  static std::vector<FormulaProposal> Propose(const DiagnosisProblem& problem) {
    return Propose(problem, EvaluateGiven(problem));
  }

  const Model model_;
};

TEST_F(ProposeFormulasTest, FindALawThatTheCatalogueLacks) {
  const Model truth = Shipped("pendulum2_planar", {"custom@joint2: -k*q^2*qd"},
                              {{"joint2.k", 0.05}});
  const auto proposals = Propose(Recorded(truth));
  ASSERT_FALSE(proposals.empty());
  const FormulaProposal& best = proposals.front();
  EXPECT_THAT(best.laws, ElementsAre("custom@joint2: c1*q^2*qd"));
  EXPECT_THAT(best.beside, IsEmpty());
  ASSERT_EQ(best.parameters.size(), 1u);
  EXPECT_EQ(best.parameters[0].name, "joint2.c1");
  EXPECT_NEAR(best.parameters[0].value, -0.05,
              5 * best.parameters[0].std_error);
  EXPECT_LT(best.cv_error, 1.2);
  EXPECT_LT(best.holdout, 1.3);
}

TEST_F(ProposeFormulasTest, KeepAnEffectOfTheCatalogueBesideALaw) {
  const Model truth = Shipped(
      "pendulum2_planar", {"custom@joint2: -k*q^2*qd", "quadratic_drag@joint1"},
      {{"joint2.k", 0.05}, {"joint1.quadratic_drag", 0.05}});
  const DiagnosisProblem problem = Recorded(truth);
  const EvaluatedModel base = EvaluateGiven(problem);
  const auto drag =
      Catalogue().Make("quadratic_drag@joint1", model_.mechanism(), "test");
  const EvaluatedModel found =
      EvaluateFrom(problem, base, {drag}, {}, {{}}, 0.0, problem.options);
  const auto proposals = Propose(problem, found);
  ASSERT_FALSE(proposals.empty());
  EXPECT_THAT(proposals.front().laws, ElementsAre("custom@joint2: c1*q^2*qd"));
  EXPECT_THAT(proposals.front().beside, ElementsAre("quadratic_drag@joint1"));
  EXPECT_LT(proposals.front().holdout, 1.2);
}

TEST_F(ProposeFormulasTest, NameParametersThatTheModelDoesNotHave) {
  const Model truth = Shipped(
      "pendulum2_planar", {"custom@joint2: -c1*qd", "custom@joint2: -k*q^2*qd"},
      {{"joint2.c1", 0.02}, {"joint2.k", 0.05}});
  DiagnosisProblem problem = Recorded(truth);
  const Model given = Shipped("pendulum2_planar", {"custom@joint2: -c1*qd"},
                              {{"joint2.c1", 0.02}});
  problem.model = given;
  const auto proposals = Propose(problem);
  ASSERT_FALSE(proposals.empty());
  EXPECT_THAT(proposals.front().laws, ElementsAre("custom@joint2: c2*q^2*qd"));
}

TEST_F(ProposeFormulasTest, AreNoneOfACompleteModel) {
  EXPECT_THAT(Propose(Recorded(model_)), IsEmpty());
}

TEST(ProposeFormulas, AreNoneUnderARandomForce) {
  int offered = 0;
  for (int seed = 1; seed <= 3; ++seed) {
    DiagnosisProblem problem(ForcedPendulum());
    problem.free = FreeFrom(problem.model, TruthOfForcedPendulum());
    problem.options.noise = 1e-3;
    problem.SetRuns({RecordUnderRandomForce({.seed = 10 * seed}),
                     RecordUnderRandomForce({.seed = 10 * seed + 1})},
                    {RecordUnderRandomForce({.seed = 10 * seed + 2})});
    offered += ProposeFormulas(
                   problem, EvaluateGiven(problem), {"joint1", "joint2"}, 40,
                   [](const std::string&, double) {
                   }).empty()
                   ? 0
                   : 1;
  }
  EXPECT_EQ(offered, 0);
}

}  // namespace
}  // namespace sysid
