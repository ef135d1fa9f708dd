#include "sysid/diagnosis/rivals.h"

#include <gmock/gmock.h>

#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A search that added friction, and a drag after it.
class RivalsTest : public ::testing::Test {
 protected:
  RivalsTest() : model_(Shipped("pendulum2_planar")), diagnosis_(model_) {
    const Catalogue catalogue;
    for (const char* name :
         {"coulomb_friction@joint1", "viscous_damping@joint1",
          "stribeck_friction@joint1", "quadratic_drag@joint1"}) {
      candidates_.push_back(catalogue.Make(name, model_.mechanism(), "test"));
    }
    for (const int i : {0, 3}) {
      DiagnosisStep step;
      step.effects = {candidates_[i]->name()};
      step.indistinguishable_from.emplace_back();
      diagnosis_.steps.push_back(step);
    }
    auto final = std::make_shared<EvaluatedModel>(diagnosis_.base);
    final->added = {candidates_[0], candidates_[3]};
    diagnosis_.final = final;
    diagnosis_.verdict = Verdict::kMissingEffect;
  }

  std::vector<std::string>& Of(int step) {
    return diagnosis_.steps[step].indistinguishable_from[0];
  }

  Model model_;
  Diagnosis diagnosis_;
  std::vector<std::shared_ptr<const Effect>> candidates_;
};

TEST_F(RivalsTest, AnEffectHasEachAlternativeOnceAndAtItsOwnStep) {
  AddAlternatives("quadratic_drag@joint1", {"viscous_damping@joint1"},
                  &diagnosis_.steps);
  AddAlternatives("quadratic_drag@joint1",
                  {"viscous_damping@joint1", "coulomb_friction@joint1"},
                  &diagnosis_.steps);
  EXPECT_THAT(Of(0), IsEmpty());
  EXPECT_THAT(Of(1),
              ElementsAre("viscous_damping@joint1", "coulomb_friction@joint1"));
}

TEST_F(RivalsTest, WhatABetterModelTellsApartGoesAndTheRestStays) {
  Of(0) = {"viscous_damping@joint1", "stribeck_friction@joint1"};
  Of(1) = {"viscous_damping@joint1"};
  RemoveAlternatives("coulomb_friction@joint1",
                     {"viscous_damping@joint1", "armature@joint1"},
                     &diagnosis_.steps);
  EXPECT_THAT(Of(0), ElementsAre("stribeck_friction@joint1"));
  EXPECT_THAT(Of(1), ElementsAre("viscous_damping@joint1"));
}

TEST_F(RivalsTest, AnAlternativeInOnePlaceMakesAnUndecidedPairOfModels) {
  Of(0) = {"viscous_damping@joint1"};
  FindRivals(candidates_, &diagnosis_);
  EXPECT_EQ(diagnosis_.verdict, Verdict::kUndecided);
  EXPECT_THAT(
      diagnosis_.rivals,
      ElementsAre(
          ElementsAre("coulomb_friction@joint1", "quadratic_drag@joint1"),
          ElementsAre("viscous_damping@joint1", "quadratic_drag@joint1")));
  ASSERT_EQ(diagnosis_.told_apart_by.size(), 2u);
  EXPECT_EQ(diagnosis_.told_apart_by[0], "");
  EXPECT_NE(diagnosis_.told_apart_by[1], "");
}

// Three parameters explain whatever one explains: no rival.
TEST_F(RivalsTest, AnExtensionIsNoRival) {
  Of(0) = {"stribeck_friction@joint1"};
  FindRivals(candidates_, &diagnosis_);
  EXPECT_THAT(diagnosis_.rivals, IsEmpty());
  EXPECT_EQ(diagnosis_.verdict, Verdict::kMissingEffect);
}

TEST_F(RivalsTest, WithoutAlternativesTheVerdictStands) {
  FindRivals(candidates_, &diagnosis_);
  EXPECT_THAT(diagnosis_.rivals, IsEmpty());
  EXPECT_EQ(diagnosis_.verdict, Verdict::kMissingEffect);
}

}  // namespace
}  // namespace sysid
