#include "sysid/diagnosis/effect_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

using testing::IsEmpty;
using testing::UnorderedElementsAre;

// Two planar links, of which every law of the catalogue may be missing.
class EffectSearchTest : public testing::Test {
 protected:
  explicit EffectSearchTest()
      : model_(Shipped("pendulum2_planar")),
        catalogue_(AllCandidates(model_)) {}

  DiagnosisProblem Recorded(const Model& truth, double noise = kSetupNoise) {
    std::vector<sysid::Run> runs;
    for (int seed = 1; seed <= 3; ++seed) {
      runs.push_back(Record(truth, seed, {.duration = 6.0, .noise = noise}));
    }
    return MakeProblem(model_, {{"link1.length", 0.5}, {"link2.length", 0.5}},
                       runs);
  }
  EffectSearch::Answer Search(const DiagnosisProblem& problem,
                              const std::vector<std::string>& start = {}) {
    std::vector<int> effects;
    for (size_t e = 0; e < catalogue_.size(); ++e) {
      if (std::find(start.begin(), start.end(), catalogue_[e]->name()) !=
          start.end()) {
        effects.push_back(static_cast<int>(e));
      }
    }
    EXPECT_EQ(effects.size(), start.size());
    EffectSearch search(problem, catalogue_,
                        [this](const std::string& doing, double) {
                          reported_.push_back(doing);
                        });
    return search.Run(effects);
  }
  std::vector<std::string> Names(const std::vector<int>& effects) const {
    std::vector<std::string> names;
    for (const int e : effects) names.push_back(catalogue_[e]->name());
    return names;
  }

  const Model model_;
  Candidates catalogue_;
  std::vector<std::string> reported_;
};

const std::vector<std::string> kPair = {"viscous_damping@joint1",
                                        "coulomb_friction@joint2"};

TEST_F(EffectSearchTest, AddNothingToAModelThatIsComplete) {
  const DiagnosisProblem problem = Recorded(model_);
  const auto answer = Search(problem);
  EXPECT_THAT(answer.found->effects, IsEmpty());
  EXPECT_TRUE(answer.at_noise);
  EXPECT_TRUE(answer.explains);
  // Asked at the longest horizon: whole runs.
  EXPECT_NEAR(answer.found->model.fit.segment_s,
              problem.train->LongestDuration(), 0.1);
}

TEST_F(EffectSearchTest, FindTwoAtOnceWhateverTheWay) {
  const Model truth =
      Shipped("pendulum2_planar", kPair,
              {{"joint1.damping", 0.02}, {"joint2.friction", 0.01}});
  const DiagnosisProblem problem = Recorded(truth);
  const auto answer = Search(problem);
  EXPECT_THAT(Names(answer.found->effects),
              UnorderedElementsAre(kPair[0], kPair[1]));
  EXPECT_TRUE(answer.at_noise);
  EXPECT_TRUE(answer.explains);
  EXPECT_EQ(answer.order.size(), 2u);
  EXPECT_THAT(answer.rivals, IsEmpty());
  EXPECT_FALSE(reported_.empty());
  // From two that are wrong, and from one too many.
  for (const std::vector<std::string>& start :
       {std::vector<std::string>{"spring@joint1", "armature@joint2"},
        std::vector<std::string>{kPair[0], kPair[1], "spring@joint2"}}) {
    EXPECT_EQ(Search(problem, start).found->effects, answer.found->effects);
  }
}

TEST_F(EffectSearchTest, SayWhichLawsAreTheSameForce) {
  // The drag of a joint and that of its only link.
  const auto answer =
      Search(Recorded(Shipped("pendulum2_planar", {"quadratic_drag@joint1"},
                              {{"joint1.quadratic_drag", 0.05}})));
  ASSERT_EQ(answer.found->effects.size(), 1u);
  EXPECT_TRUE(answer.at_noise);
  std::vector<std::string> all = Names(answer.found->effects);
  for (const auto& rival : answer.rivals) {
    EXPECT_TRUE(rival->IsAnswer());
    EXPECT_LE(rival->score.parameters, answer.found->score.parameters);
    for (const std::string& name : Names(rival->effects)) all.push_back(name);
  }
  EXPECT_THAT(all, UnorderedElementsAre("quadratic_drag@joint1",
                                        "aerodynamic_drag@link1"));
  ASSERT_EQ(answer.rivals.size(), 1u);
  EXPECT_THAT(answer.same_force, testing::Contains(answer.rivals[0]->effects));
}

// A law that the candidates lack: what lowers the error most of them does not
// explain it.
TEST_F(EffectSearchTest, LeaveUnexplainedWhatNoCandidateIs) {
  std::erase_if(catalogue_, [](const auto& effect) {
    return effect->kind() != "effort_gain" && effect->kind() != "spring";
  });
  const auto answer =
      Search(Recorded(Shipped("pendulum2_planar", {"coulomb_friction@joint1"},
                              {{"joint1.friction", 0.05}})));
  EXPECT_FALSE(answer.explains);
  EXPECT_FALSE(answer.at_noise);
}

}  // namespace
}  // namespace sysid
