#include "sysid/diagnosis/fitted_sets.h"

#include <gmock/gmock.h>

#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// A damping that is there, one that is not, and the length that is free.
class FittedSetsTest : public testing::Test {
 protected:
  FittedSetsTest()
      : problem_(MakeProblem(Shipped("pendulum2_planar"),
                             {{"link2.length", 0.5}}, Recorded())),
        base_(EvaluateGiven(problem_)),
        sets_(problem_, catalogue_) {}

  static std::vector<sysid::Run> Recorded() {
    const Model truth = Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                                {{"joint1.damping", 0.05}});
    return {Record(truth, 1), Record(truth, 2), Record(truth, 3)};
  }
  static Candidates Catalogued() {
    const Mechanism mechanism = Shipped("pendulum2_planar").mechanism();
    Candidates effects;
    for (const char* name :
         {"viscous_damping@joint1", "viscous_damping@joint2"}) {
      effects.push_back(Catalogue().Make(name, mechanism, "test"));
    }
    return effects;
  }
  EvaluatedModel Fitted(const std::vector<int>& effects) const {
    Candidates added;
    for (const int e : effects) added.push_back(catalogue_[e]);
    return EvaluateFrom(problem_, base_, added, {}, {ValuesOf(base_)}, 0.0,
                        problem_.options);
  }

  const Candidates catalogue_ = Catalogued();
  const DiagnosisProblem problem_;
  const EvaluatedModel base_;
  FittedSets sets_;
};

TEST_F(FittedSetsTest, HaveTheSimplestThatNoneBeatsForTheBest) {
  EXPECT_EQ(sets_.Best(), nullptr);
  sets_.Keep({}, base_);
  EXPECT_THAT(sets_.Best()->effects, IsEmpty());
  sets_.Keep({0, 1}, Fitted({0, 1}));
  sets_.Keep({0}, Fitted({0}));
  EXPECT_THAT(sets_.Best()->effects, ElementsAre(0));
  EXPECT_THAT(sets_.RivalsOf(*sets_.Best()), IsEmpty());
}

// The errors of these models are the same throughout: what differs is what the
// fit says of its parameters.
TEST_F(FittedSetsTest, RefuseWhatOnlyTradesWithOtherMembers) {
  EvaluatedModel model = Fitted({0});
  EXPECT_TRUE(sets_.Keep({0}, model)->IsAnswer());
  // With what was free before it is no fault of the effect.
  model.fit.not_identifiable = {{"joint1.damping", "link2.length"}};
  EXPECT_TRUE(sets_.Keep({0}, model)->IsAnswer());
  model.fit.not_identifiable = {{"joint1.damping"}};
  const auto refused = sets_.Keep({0}, model);
  EXPECT_FALSE(refused->IsAnswer());
  EXPECT_EQ(refused->undetermined, 0);
}

TEST_F(FittedSetsTest, RememberWhatWasBeatenAndGiveBackWhatTheyHad) {
  sets_.Keep({}, base_);
  sets_.Keep({0}, Fitted({0}));
  const FittedSets before = sets_;
  sets_.GoOnWith(*sets_.Best());
  EXPECT_TRUE(sets_.WasBeaten({}));
  EXPECT_FALSE(sets_.WasBeaten({0}));
  EXPECT_EQ(sets_.Best(), nullptr);
  sets_.Restore(before);
  EXPECT_FALSE(sets_.WasBeaten({}));
  EXPECT_THAT(sets_.Best()->effects, ElementsAre(0));
}

TEST_F(FittedSetsTest, TakeNoSetWithWhatAForceMayHaveMadeUp) {
  sets_.Keep({}, base_);
  const auto fitted = sets_.Keep({0}, Fitted({0}));
  sets_.RefuseAsChance(0, *fitted);
  EXPECT_TRUE(sets_.IsChance(0));
  EXPECT_THAT(sets_.Best()->effects, IsEmpty());
  EXPECT_FALSE(sets_.Keep({0}, Fitted({0}))->IsAnswer());
}

}  // namespace
}  // namespace sysid
