#include "sysid/diagnosis/linear_sets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

// Two planar links with frictions that the model lacks.
class LinearSetsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Model truth =
        Shipped("pendulum2_planar",
                {"viscous_damping@joint1", "coulomb_friction@joint2"},
                {{"joint1.damping", 0.02}, {"joint2.friction", 0.01}});
    std::vector<sysid::Run> runs;
    for (int seed = 1; seed <= 4; ++seed) {
      runs.push_back(Record(truth, seed, {.duration = 6.0}));
    }
    const Model model = Shipped("pendulum2_planar");
    problem_ = new DiagnosisProblem(MakeProblem(
        model, {{"link1.length", 0.5}, {"link2.length", 0.5}}, runs));
    problem_->options.segment = 0.5;
    catalogue_ = new Candidates(AllCandidates(model));
    base_ = new EvaluatedModel(EvaluateGiven(*problem_));
  }
  static void TearDownTestSuite() {
    delete base_;
    delete catalogue_;
    delete problem_;
  }

  // The terms of effects by name, the first of each.
  static LinearSets::Set Terms(const LinearSets& sets,
                               const std::vector<std::string>& names) {
    LinearSets::Set found;
    for (const std::string& name : names) {
      for (size_t t = 0; t < sets.terms().size(); ++t) {
        if ((*catalogue_)[sets.terms()[t].effect]->name() != name) continue;
        found.push_back(static_cast<int>(t));
        break;
      }
    }
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found.size(), names.size());
    return found;
  }
  // With the trust's part, over the fitted runs' stretches.
  static double Error(const LinearSets& sets,
                      const std::vector<std::string>& names) {
    const auto score = sets.ScoreOf(Terms(sets, names));
    return score ? std::exp(sets.LogErrors(*score).mean()) : 1e9;
  }
  static EvaluatedModel With(const std::vector<std::string>& names) {
    std::vector<std::shared_ptr<const Effect>> effects;
    for (const auto& effect : *catalogue_) {
      if (std::find(names.begin(), names.end(), effect->name()) !=
          names.end()) {
        effects.push_back(effect);
      }
    }
    EvaluatedModel opened =
        OpenModel(*problem_, effects, {}, {}, problem_->options);
    opened.fit = FitIndependentSegments(*opened.problem);
    return EvaluateAgain(*problem_, std::move(opened));
  }

  static DiagnosisProblem* problem_;
  static Candidates* catalogue_;
  static EvaluatedModel* base_;
};

DiagnosisProblem* LinearSetsTest::problem_ = nullptr;
Candidates* LinearSetsTest::catalogue_ = nullptr;
EvaluatedModel* LinearSetsTest::base_ = nullptr;

const std::vector<std::string> kTruth = {"viscous_damping@joint1",
                                         "coulomb_friction@joint2"};

// At the fitted model (J.3) is (7.11).
TEST_F(LinearSetsTest, ScoreTheModelItselfAsCrossValidationDoes) {
  const EvaluatedModel found = With(kTruth);
  ASSERT_TRUE(found.fit.converged);
  const LinearSets sets(*problem_, found, *catalogue_);
  ASSERT_TRUE(sets.Valid());
  EXPECT_EQ(sets.members().size(), 2u);
  const auto score = sets.ScoreOf(sets.members());
  ASSERT_TRUE(score);
  EXPECT_EQ(score->parameters, 2);
  // Of the fitted runs and of those held out.
  Eigen::Index j = 0;
  for (const CrossValidation::Stretch& stretch : found.cv.stretches) {
    if (!(stretch.dof > 0.0)) continue;
    ASSERT_LT(j, score->squares.size());
    EXPECT_NEAR(std::sqrt(score->squares[j++]), stretch.error(), 1e-3);
  }
  EXPECT_EQ(j, score->squares.size());
}

TEST_F(LinearSetsTest, ScoreTheTruthBestOfAllPairs) {
  const LinearSets sets(*problem_, *base_, *catalogue_);
  ASSERT_TRUE(sets.Valid());
  const double truth = Error(sets, kTruth), now = Error(sets, {});
  EXPECT_LT(truth, 1.1);
  EXPECT_GT(now, 2.0);
  int pairs = 0;
  for (size_t a = 0; a < sets.terms().size(); ++a) {
    for (size_t b = a + 1; b < sets.terms().size(); ++b) {
      if (sets.Exclude(a, b)) continue;
      const auto score =
          sets.ScoreOf({static_cast<int>(a), static_cast<int>(b)});
      if (!score) continue;
      ++pairs;
      EXPECT_GE(std::exp(sets.LogErrors(*score).mean()), 0.98 * truth)
          << (*catalogue_)[score->effects[0]]->name() << " "
          << (*catalogue_)[score->effects[1]]->name();
    }
  }
  EXPECT_GT(pairs, 100);
}

// What a member's going is worth, and its value where it comes back.
TEST_F(LinearSetsTest, TakeMembersOutAndOffer) {
  const EvaluatedModel found = With(kTruth);
  const LinearSets sets(*problem_, found, *catalogue_);
  ASSERT_TRUE(sets.Valid());
  const EvaluatedModel left = With({kTruth[0]});
  const auto without = sets.ScoreOf(Terms(sets, {kTruth[0]}));
  ASSERT_TRUE(without);
  const LinearSets from_left(*problem_, left, *catalogue_);
  const auto with = from_left.ScoreOf(Terms(from_left, kTruth));
  ASSERT_TRUE(with);
  EXPECT_NEAR(
      0.5 * without->squares.log().mean(),
      0.5 * from_left.ScoreOf(from_left.members())->squares.log().mean(), 0.2);
  for (size_t t = 0; t < with->set.size(); ++t) {
    const int effect = from_left.terms()[with->set[t]].effect;
    if ((*catalogue_)[effect]->name() != kTruth[1]) continue;
    ASSERT_FALSE(with->values[t].empty());
    EXPECT_NEAR(with->values[t][0], 0.01, 0.002);
  }
}

}  // namespace
}  // namespace sysid
