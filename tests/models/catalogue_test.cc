#include "models/effects/catalogue.h"

#include <gmock/gmock.h>

#include "models/error.h"
#include "models/find_model.h"
#include "models/model.h"
#include "models/urdf/load_urdf.h"
#include "tests/support/all_joints.h"
#include "tests/support/error_text.h"
#include "tests/support/test_effects.h"

namespace sysid {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;

// A catalogue with effects of every kind of target, whatever is shipped.
Catalogue WithTestEffects() {
  Catalogue catalogue;
  catalogue.Add<TestArmature>();
  catalogue.Add<TestGravity>();
  catalogue.Add<TestLinkForce>();
  catalogue.Add<TestMeasurement>();
  return catalogue;
}

std::vector<std::string> CandidatesOf(const std::string& kind) {
  std::vector<std::string> found;
  for (const auto& name : WithTestEffects().Candidates(AllJoints())) {
    if (name.starts_with(kind + "@")) found.push_back(name);
  }
  return found;
}

TEST(Candidates, AreEveryEffectOnEveryTargetWhereItHasAMeaning) {
  EXPECT_THAT(CandidatesOf("viscous_damping"),
              ElementsAre("viscous_damping@slide", "viscous_damping@ball",
                          "viscous_damping@hinge", "viscous_damping@wheel"));
  EXPECT_THAT(CandidatesOf("effort_bias"),
              ElementsAre("effort_bias@slide", "effort_bias@hinge",
                          "effort_bias@wheel"));
  EXPECT_THAT(CandidatesOf("test_gravity"), ElementsAre("test_gravity@base"));
}

TEST(Candidates, AreNotOnLinksWithoutMassOrThatCannotMove) {
  EXPECT_THAT(CandidatesOf("test_link_force"),
              ElementsAre("test_link_force@car", "test_link_force@upper",
                          "test_link_force@lower", "test_link_force@rim",
                          "test_link_force@payload"));
}

TEST(Candidates, CanAllBeMade) {
  const Mechanism mechanism = AllJoints();
  const Catalogue catalogue = WithTestEffects();
  for (const std::string& name : catalogue.Candidates(mechanism)) {
    const auto effect = catalogue.Make(name, mechanism, "test");
    EXPECT_EQ(effect->name(), name);
    EXPECT_THAT(catalogue.kinds(), Contains(effect->kind()));
  }
}

std::string ErrorOf(const std::string& name,
                    const Mechanism& mechanism = AllJoints()) {
  try {
    WithTestEffects().Make(name, mechanism, "--add");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

Mechanism OnlyABall() {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  AddSomeJoint("ball", JointType::kSpherical, 0, "body", SomeBody(),
               &mechanism);
  return mechanism;
}

Mechanism NoJoints() {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  return mechanism;
}

TEST(CatalogueErrors, SayHowToNameATarget) {
  EXPECT_EQ(ErrorOf("coulomb_friction"),
            "--add: effect 'coulomb_friction' has no target\n"
            "  hint: write effect@target, for instance coulomb_friction@slide");
  // The next entry of a list, which only a pair of joints would take up.
  EXPECT_EQ(ErrorOf("viscous_damping@hinge,coulomb_friction"),
            ErrorOf("coulomb_friction"));
  EXPECT_EQ(ErrorOf("coulomb_friction", NoJoints()),
            "--add: effect 'coulomb_friction' has no target\n"
            "  hint: write effect@target, for instance coulomb_friction@base");
}

TEST(CatalogueErrors, SayHowPairsAreNamed) {
  const Mechanism arm = LoadUrdf(FindModel("pendulum2_planar"));
  EXPECT_EQ(ErrorText([&] { Catalogue().Make("gear_coupling", arm, "--add"); }),
            "--add: effect 'gear_coupling' has no target\n  hint: write "
            "effect@target, for instance gear_coupling@joint1+joint2");
  EXPECT_EQ(ErrorText([&] {
              Catalogue().Make("gear_coupling@joint2+joint1", arm, "--add");
            }),
            "--add: effect 'gear_coupling': unknown target 'joint2,joint1'\n"
            "  hint: the joint that carries the other is named first: "
            "joint1,joint2");
}

TEST(CatalogueErrors, NameTheNearestEffect) {
  EXPECT_EQ(ErrorOf("coulom_fricton@hinge"),
            "--add: unknown effect 'coulom_fricton'\n"
            "  hint: did you mean 'coulomb_friction'?");
  EXPECT_EQ(ErrorOf("@hinge"), "--add: unknown effect ''\n  hint: known: " +
                                   Join(WithTestEffects().kinds()));
}

TEST(CatalogueErrors, NameTheNearestTarget) {
  EXPECT_EQ(ErrorOf("viscous_damping@hinje"),
            "--add: effect 'viscous_damping': unknown target 'hinje'\n"
            "  hint: did you mean 'hinge'?");
  EXPECT_EQ(ErrorOf("viscous_damping@"),
            "--add: effect 'viscous_damping': unknown target ''\n"
            "  hint: known: slide, ball, hinge, wheel");
  EXPECT_EQ(ErrorOf("viscous_damping@joint1", NoJoints()),
            "--add: effect 'viscous_damping': unknown target 'joint1'\n"
            "  hint: there is none to choose from");
}

TEST(CatalogueErrors, RefuseATargetOfAnotherKind) {
  EXPECT_EQ(ErrorOf("viscous_damping@upper"),
            "--add: effect 'viscous_damping': unknown target 'upper'\n"
            "  hint: known: slide, ball, hinge, wheel");
  EXPECT_EQ(ErrorOf("test_gravity@hinge"),
            "--add: effect 'test_gravity': unknown target 'hinge'\n"
            "  hint: known: base");
  EXPECT_EQ(ErrorOf("test_link_force@ball"),
            "--add: effect 'test_link_force': unknown target 'ball'\n"
            "  hint: known: car, upper, lower, rim, payload");
}

TEST(CatalogueErrors, SayWhereAnEffectHasNoMeaning) {
  EXPECT_EQ(ErrorOf("effort_bias@ball"),
            "--add: effect 'effort_bias' has no meaning on the spherical "
            "joint 'ball'\n  hint: it acts on: slide, hinge, wheel");
  EXPECT_EQ(ErrorOf("viscous_damping@bolt"),
            "--add: effect 'viscous_damping' has no meaning on the fixed "
            "joint 'bolt'\n  hint: it acts on: slide, ball, hinge, wheel");
  EXPECT_EQ(ErrorOf("effort_bias@ball", OnlyABall()),
            "--add: effect 'effort_bias' has no meaning on the spherical "
            "joint 'ball'\n  hint: this model has no joint for it");
  EXPECT_EQ(ErrorOf("test_link_force@stand"),
            "--add: effect 'test_link_force' has no meaning on the link "
            "'stand', which is fixed to the world\n"
            "  hint: it acts on: car, upper, lower, rim, payload");
}

TEST(Catalogue, MakesEffectsOfLinksWithoutMassThatAreNamed) {
  ASSERT_EQ(AllJoints().nominal.links[AllJoints().FindLink("tip")].mass, 0.0);
  EXPECT_EQ(Catalogue().Make("mass@tip", AllJoints(), "test")->name(),
            "mass@tip");
}

TEST(CatalogueErrors, CarryTheirPlace) {
  try {
    Catalogue().Make("friction", AllJoints(), "fit.yaml:9:5");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.place(), "fit.yaml:9:5");
  }
}

// --- Effects in a model -----------------------------------------------------

TEST(EffectSet, RefusesTheSameEffectTwice) {
  const Mechanism mechanism = AllJoints();
  Model model(mechanism);
  model.AddEffect(
      Catalogue().Make("viscous_damping@hinge", mechanism, "--add"));
  try {
    model.AddEffect(
        Catalogue().Make("viscous_damping@hinge", mechanism, "--add"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "model: viscous_damping@hinge is in the model already\n"
                 "  hint: name each effect once");
  }
  EXPECT_EQ(model.effects().size(), 1);
  EXPECT_EQ(model.nominal().effects.size(), 1u);
}

// A model with the effects of these names; the parameters of the k-th effect's
// first are k + 1.
Model WithEffects(const std::vector<std::string>& names) {
  Model model(AllJoints());
  double value = 0.0;
  for (const std::string& name : names) {
    const auto effect = Catalogue().Make(name, model.mechanism(), "test");
    model.AddEffect(effect);
    value += 1.0;
    if (effect->parameters().empty()) continue;
    model.SetEffectParameter(effect->parameters().front().name, value);
  }
  return model;
}

TEST(ModelEffects, StribeckFrictionTakesThePlaceOfCoulombs) {
  Model model = WithEffects({"viscous_damping@hinge", "coulomb_friction@hinge",
                             "coulomb_friction@slide", "mass@rim"});
  model.AddEffect(
      Catalogue().Make("stribeck_friction@hinge", model.mechanism(), "test"));
  EXPECT_THAT(model.effects().names(),
              ElementsAre("viscous_damping@hinge", "coulomb_friction@slide",
                          "mass@rim", "stribeck_friction@hinge"));
  // The law stays what it was: as much friction at rest as in motion.
  EXPECT_THAT(model.nominal().effects, ElementsAre(1.0, 3.0, 2.0, 2.0, 0.1));
  // Added where nothing was, it is off.
  model.AddEffect(
      Catalogue().Make("stribeck_friction@ball", model.mechanism(), "test"));
  EXPECT_THAT(model.nominal().effects,
              ElementsAre(1.0, 3.0, 2.0, 2.0, 0.1, 0.0, 0.0, 0.1));
}

TEST(ModelEffects, CoulombsFrictionCannotJoinStribecks) {
  Model model = WithEffects({"stribeck_friction@hinge"});
  const MechanismParameters<double> before = model.nominal();
  try {
    model.AddEffect(
        Catalogue().Make("coulomb_friction@hinge", model.mechanism(), ""),
        "--add");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "--add: coulomb_friction@hinge shares parameters with "
                 "stribeck_friction@hinge, which is in the model already\n"
                 "  hint: leave one of them out");
  }
  EXPECT_THAT(model.effects().names(), ElementsAre("stribeck_friction@hinge"));
  EXPECT_EQ(model.nominal().effects, before.effects);
}

TEST(ModelEffects, OnesWithoutParametersAreNamedOnceToo) {
  Model model = WithEffects({"mass@rim", "com@rim", "mass@lower"});
  EXPECT_THROW(
      model.AddEffect(Catalogue().Make("mass@rim", model.mechanism(), "test")),
      InputError);
  EXPECT_EQ(model.effects().size(), 3);
  EXPECT_TRUE(model.nominal().effects.empty());
}

TEST(EffectSet, KeepsEffectsAndTheirParametersInOrder) {
  const Mechanism mechanism = AllJoints();
  EffectSet set;
  set.Add(std::make_shared<TestArmature>(mechanism, "hinge"));
  set.Add(std::make_shared<TestGravity>(mechanism, "base"));
  set.Add(std::make_shared<TestArmature>(mechanism, "ball"));
  EXPECT_THAT(set.names(),
              ElementsAre("test_armature@hinge", "test_gravity@base",
                          "test_armature@ball"));
  EXPECT_EQ(set.offset(0), 0);
  EXPECT_EQ(set.offset(1), 1);
  EXPECT_EQ(set.offset(2), 4);
  ASSERT_EQ(set.parameters().size(), 5u);
  EXPECT_EQ(set.parameters()[4].name, "ball.test_armature");
  EXPECT_TRUE(set.Contains("test_gravity@base"));
  EXPECT_FALSE(set.Contains("test_armature@slide"));
}

TEST(ModelDeathTest, ChecksTheNameOfAnEffectParameter) {
  Model model(AllJoints());
  EXPECT_DEATH(model.SetEffectParameter("hinge.damping", 1.0),
               "no effect has a parameter hinge.damping");
}

TEST(MakeModel, TurnsTheDynamicsOfTheUrdfIntoEffects) {
  Mechanism mechanism = AllJoints();
  mechanism.joints[mechanism.FindJoint("slide")].damping = 0.3;
  mechanism.joints[mechanism.FindJoint("slide")].friction = 0.1;
  mechanism.joints[mechanism.FindJoint("ball")].friction = 0.2;
  const Model model = MakeModel(mechanism, Catalogue());
  EXPECT_THAT(model.effects().names(),
              ElementsAre("viscous_damping@slide", "coulomb_friction@slide",
                          "coulomb_friction@ball"));
  EXPECT_THAT(model.nominal().effects, ElementsAre(0.3, 0.1, 0.2));
  EXPECT_EQ(MakeModel(AllJoints(), Catalogue()).effects().size(), 0);
}

}  // namespace
}  // namespace sysid
