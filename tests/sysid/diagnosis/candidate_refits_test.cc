#include "sysid/diagnosis/candidate_refits.h"

#include <gtest/gtest.h>

#include "sysid/diagnosis/candidate_list.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

// A double pendulum with dry friction, and refits of laws that may explain it.
class TrialsTest : public ::testing::Test {
 protected:
  static constexpr const char* kRobot = "pendulum2_planar";

  void SetUp() override {
    const Model truth = Shipped(kRobot, {"coulomb_friction@joint1"},
                                {{"joint1.friction", 0.05}});
    std::vector<sysid::Run> runs;
    for (int seed = 1; seed <= 3; ++seed) {
      runs.push_back(Record(truth, seed, {.duration = 4.0}));
    }
    problem_ = std::make_unique<DiagnosisProblem>(MakeProblem(
        Shipped(kRobot), {{"link1.length", 0.5}, {"link2.length", 0.5}}, runs));
    candidates_ = AllCandidates(problem_->model);
    base_ = std::make_unique<EvaluatedModel>(EvaluateGiven(*problem_));
  }

  EvaluatedModel With(const std::string& name,
                      const std::vector<Value>& start) {
    for (const auto& effect : candidates_) {
      if (effect->name() != name) continue;
      ScreenedEffect expected;
      expected.effect = effect;
      for (const Value& value : start) {
        ExpectedParameter p;
        p.name = value.name;
        p.value = value.value;
        expected.parameters.push_back(p);
      }
      return EvaluateWith(*problem_, *base_, {&expected}, problem_->options);
    }
    ADD_FAILURE() << name;
    return std::move(*base_);
  }

  std::unique_ptr<DiagnosisProblem> problem_;
  std::vector<std::shared_ptr<const Effect>> candidates_;
  std::unique_ptr<EvaluatedModel> base_;
};

// The peak of Stribeck's law fits what is left of any friction that sticks a
// little otherwise than ours; a little is no reason to believe it.
TEST_F(TrialsTest, ThePartIsBetterThanAWholeThatAddsLittle) {
  const EvaluatedModel part =
      With("coulomb_friction@joint1", {{"joint1.friction", 0.05}});
  EvaluatedModel whole =
      With("stribeck_friction@joint1", {{"joint1.friction", 0.05},
                                        {"joint1.static_friction", 0.06},
                                        {"joint1.stribeck_velocity", 0.1}});
  ASSERT_TRUE(IsAtNoiseFloor(part)) << part.train_error();
  ASSERT_TRUE(IsAtNoiseFloor(whole)) << whole.train_error();
  const auto scale_error = [](double by, EvaluatedModel* evaluated) {
    for (auto& stretch : evaluated->cv.stretches) stretch.squares *= by * by;
  };
  whole.cv = part.cv;
  scale_error(0.97, &whole);  // as it would be
  ASSERT_FALSE(AreAsGood(part, whole));
  const Refitter refitter(*problem_, candidates_);
  EXPECT_TRUE(refitter.IsBetter(part, whole));
  EXPECT_FALSE(refitter.IsBetter(whole, part));
  // But not where the part leaves something.
  EvaluatedModel poor = part;
  scale_error(2.0, &poor);
  EXPECT_FALSE(refitter.IsBetter(poor, whole));
  EXPECT_TRUE(refitter.IsBetter(whole, poor));
}

// What a refit has shown not to hold is no reason to fit the same with more.
TEST_F(TrialsTest, APairPromisesNoMoreThanWhatItsEffectsKept) {
  const double error = base_->train_error();
  Screening screening;
  screening.error = error;
  for (const char* name : {"armature@joint1", "coulomb_friction@joint1"}) {
    ScreenedEffect effect;
    effect.effect = Catalogue().Make(name, problem_->model.mechanism(), "test");
    effect.predicted_error = 0.9 * error;
    effect.criterion = -2 * kClearly;
    screening.effects.push_back(effect);
  }
  screening.pairs = {{0, 1, 0.8 * error, -4 * kClearly}};
  CandidateRefit single{{0}, {screening.effects[0]}, 0.9 * error, {}, ""};
  EXPECT_EQ(ProposePairs(screening, {single}).size(), 1u);
  single.after = *base_;  // 0.89 of it
  EXPECT_EQ(ProposePairs(screening, {single}).size(), 1u);
  single.predicted = 0.7 * error;
  EXPECT_TRUE(ProposePairs(screening, {single}).empty());  // 1.14
}

// A joint that friction holds all the time rests with any inertia that is large
// enough: that predicts as well as what is there, and says nothing.
TEST(WhyRefused, AnInertiaThatOnlyHoldsItsJointIsNotDetermined) {
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
  ScreenedEffect expected;
  expected.effect = armature;
  ExpectedParameter p;
  p.name = "joint1.armature";
  p.value = 1e6;  // of a pendulum of 1 kg and 1 m
  expected.parameters = {p};
  CandidateRefit refit;
  refit.expected = {expected};
  refit.after = EvaluateWith(problem, base, {&expected}, problem.options);
  ASSERT_LT(refit.after->train_error(), 0.5 * base.train_error());
  EXPECT_EQ(WhyRefused(problem, base, refit, 1),
            "this data does not determine armature@joint1");
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
