#include "sysid/session/free_choice.h"

#include <gmock/gmock.h>

#include <limits>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/named_values.h"
#include "tests/support/error_text.h"

namespace sysid {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

// A question of a shipped model, and what was chosen.
struct Asked {
  FitRequest request;
  FitSpecification spec;
  std::vector<std::string> notices;

  Session Choose(const std::string& robot = "pendulum2_planar") {
    const Catalogue catalogue;
    Session session(MakeModel(LoadUrdf(FindModel(robot)), catalogue));
    session.model_file = "model.urdf";
    ChooseFree(request, spec, catalogue, &session);
    notices = session.notices;
    return session;
  }
  std::string Error(const std::string& robot = "pendulum2_planar") {
    return ErrorText([&] { Choose(robot); });
  }
};

// "free: {name: ...}" of a specification.
FitSpecification::Free Free(const std::string& name) {
  FitSpecification::Free free;
  free.name = name;
  free.place = "fit.yaml:2:3";
  return free;
}

std::vector<std::string> NamesOf(const Session& choice) {
  std::vector<std::string> names;
  for (const FreeParameter& free : choice.free) {
    names.push_back(free.parameter.name);
  }
  return names;
}

TEST(ChooseFree, TakesTheFlagsNamesWithWhatTheSpecificationSaysOfThem) {
  Asked asked;
  asked.spec.free = {Free("link1.length"), Free("link2.length")};
  asked.spec.free[1].initial = 0.7;
  asked.spec.free[1].lower = 0.6;
  asked.spec.free[1].prior = FreeParameter::Prior{0.8, 0.1};
  EXPECT_THAT(NamesOf(asked.Choose()),
              ElementsAre("link1.length", "link2.length"));
  asked.request.free = SplitAssignments("link2.length", "--free");
  const FreeParameter free = asked.Choose().free.at(0);
  EXPECT_EQ(free.parameter.name, "link2.length");
  EXPECT_EQ(free.initial, 0.7);
  EXPECT_EQ(free.lower, 0.6);
  ASSERT_TRUE(free.prior.has_value());
  EXPECT_EQ(free.prior->mean, 0.8);
  // The flag's start wins.
  asked.request.free = SplitAssignments("link2.length=0.9", "--free");
  EXPECT_EQ(asked.Choose().free.at(0).initial, 0.9);
}

TEST(ChooseFree, FreesWhatAnAddedEffectBrings) {
  Asked asked;
  asked.request.free = SplitAssignments("link1.length", "--free");
  asked.spec.effects = {{"viscous_damping@joint2", "fit.yaml:5:5"}};
  asked.request.add = SplitEffects("coulomb_friction@joint1", "--add");
  const Session choice = asked.Choose();
  EXPECT_THAT(NamesOf(choice),
              ElementsAre("link1.length", "joint2.damping", "joint1.friction"));
  EXPECT_THAT(choice.added, ElementsAre("coulomb_friction@joint1"));
  EXPECT_THAT(choice.freed_by_added, UnorderedElementsAre("joint1.friction"));
  EXPECT_THAT(choice.model.effects().names(),
              UnorderedElementsAre("viscous_damping@joint2",
                                   "coulomb_friction@joint1"));
  EXPECT_THAT(asked.notices, IsEmpty());
}

TEST(ChooseFree, WritesPatternsOut) {
  Asked asked;
  asked.request.free =
      SplitAssignments("link*.mass,link2.mass=2,joint1.*", "--free");
  asked.request.add = SplitEffects("viscous_damping@*", "--add");
  const Session choice = asked.Choose();
  EXPECT_THAT(NamesOf(choice),
              ElementsAre("link1.mass", "link2.mass", "joint1.x", "joint1.y",
                          "joint1.z", "joint1.damping", "joint2.damping"));
  EXPECT_EQ(choice.free[0].initial, 1.0);
  EXPECT_EQ(choice.free[1].initial, 2.0);
  EXPECT_THAT(choice.added,
              ElementsAre("viscous_damping@joint1", "viscous_damping@joint2"));
  EXPECT_THAT(choice.freed_by_added, ElementsAre("joint2.damping"));
}

TEST(ChooseFree, TakesWhatTheSpecificationSaysOfAPattern) {
  Asked asked;
  asked.spec.free = {Free("*.damping"), Free("link2.length"), Free("link?.l*")};
  asked.spec.free[0].lower = 0.001;
  asked.spec.free[0].initial = 0.01;
  asked.spec.free[2].upper = 4.0;
  asked.spec.effects = {{"viscous_damping@joint[12]", "fit.yaml:9:5"}};
  const Session choice = asked.Choose();
  EXPECT_THAT(NamesOf(choice), ElementsAre("joint1.damping", "joint2.damping",
                                           "link2.length", "link1.length"));
  EXPECT_EQ(choice.free[0].lower, 0.001);
  EXPECT_EQ(choice.free[1].initial, 0.01);
  // Written out: with its own bounds.
  EXPECT_EQ(choice.free[2].upper, std::numeric_limits<double>::infinity());
  EXPECT_EQ(choice.free[3].upper, 4.0);
}

TEST(ChooseFree, TakesAPatternAwayFromWhatIsFree) {
  Asked asked;
  asked.request.free = SplitAssignments("inertial", "--free");
  asked.request.fix = SplitAssignments("link2.*", "--fix");
  Session choice = asked.Choose();
  EXPECT_EQ(NamesOf(choice).size(), 10u);
  EXPECT_THAT(NamesOf(choice), testing::Each(testing::StartsWith("link1.")));
  EXPECT_THAT(choice.fixed, testing::Contains("link2.length"));
  // A name that is written out wins over a pattern.
  asked.request.free = SplitAssignments("inertial,link2.mass", "--free");
  choice = asked.Choose();
  EXPECT_THAT(NamesOf(choice), testing::Contains("link2.mass"));
  EXPECT_EQ(NamesOf(choice).size(), 11u);
  asked.request.fix = SplitAssignments("link2.*,link2.mass", "--fix");
  EXPECT_THAT(asked.Error(),
              HasSubstr("--fix: 'link2.mass' is also in --free"));
  // A flag over the file.
  asked.request.free = {};
  asked.request.fix = SplitAssignments(
      "link2.*=0.3,link2.com_*,link2.i*,link2.length", "--fix");
  asked.spec.free = {Free("link1.length"), Free("link2.mass")};
  choice = asked.Choose();
  EXPECT_THAT(NamesOf(choice), ElementsAre("link1.length"));
  EXPECT_EQ(FindParameters(choice.model, {"link2.mass"}, "test")[0].nominal,
            0.3);
}

TEST(ChooseFree, RefusesPatternsThatMeetNothing) {
  Asked asked;
  asked.request.free = SplitAssignments("lnik*.mass", "--free");
  EXPECT_THAT(asked.Error(),
              testing::StartsWith("--free: 'lnik*.mass' meets no parameter of "
                                  "this model\n  hint: near names: "
                                  "link1.mass, link2.mass;"));
  asked.request.free = SplitAssignments("link1.mass", "--free");
  asked.request.fix = SplitAssignments("joint1.d*", "--fix");
  EXPECT_THAT(asked.Error(), testing::StartsWith("--fix: 'joint1.d*' meets "));
  asked.request.fix = {};
  asked.request.add = SplitEffects("viscous_damping@elbow*", "--add");
  EXPECT_THAT(asked.Error(),
              testing::StartsWith("--add: 'viscous_damping@elbow*' meets no "
                                  "effect of this model\n  hint: near names: "
                                  "viscous_damping@joint1"));
  asked.request.add = {};
  asked.spec.free = {Free("arm*")};
  EXPECT_THAT(asked.Error(),
              testing::StartsWith("fit.yaml:2:3: 'arm*' meets no parameter"));
}

TEST(ChooseFree, SaysWhichEffectTakesThePlaceOfAnother) {
  Asked asked;
  asked.spec.effects = {{"coulomb_friction@joint1", "fit.yaml:5:5"}};
  asked.request.add = SplitEffects("stribeck_friction@joint1", "--add");
  const Session choice = asked.Choose();
  EXPECT_THAT(choice.model.effects().names(),
              ElementsAre("stribeck_friction@joint1"));
  EXPECT_THAT(asked.notices,
              ElementsAre("stribeck_friction@joint1 takes the place of "
                          "coulomb_friction@joint1"));
}

// A pendulum that turns about y does not feel where on y its mass is.
TEST(ChooseFree, HoldsWhatTheMotionDoesNotDependOn) {
  Asked asked;
  asked.request.add = SplitEffects("com@link2", "--add");
  const Session choice = asked.Choose();
  EXPECT_THAT(NamesOf(choice), testing::Contains("link2.com_z"));
  EXPECT_THAT(NamesOf(choice), testing::Not(testing::Contains("link2.com_y")));
  ASSERT_EQ(asked.notices.size(), 1u);
  EXPECT_THAT(
      asked.notices[0],
      testing::AllOf(HasSubstr("com@link2: the motion of this "
                               "model does not depend on "),
                     HasSubstr("link2.com_y"), testing::EndsWith(", held")));
}

TEST(ChooseFree, HoldsWhatIsFixedAndLetsTheFlagWin) {
  Asked asked;
  asked.spec.free = {Free("link1.length"), Free("link2.length")};
  asked.spec.fix = {{"link2.mass", 3.0, "fit.yaml:6:3"}};
  asked.request.fix = SplitAssignments("link2.mass=2,link1.length", "--fix");
  const Session choice = asked.Choose();
  EXPECT_THAT(NamesOf(choice), ElementsAre("link2.length"));
  EXPECT_THAT(choice.fixed, ElementsAre("link2.mass", "link1.length"));
  EXPECT_EQ(FindParameters(choice.model, {"link2.mass"}, "test")[0].nominal,
            2.0);
}

TEST(ChooseFree, RefusesFixedValuesThatMakeNoBody) {
  Asked asked;
  asked.spec.free = {Free("link1.length")};
  asked.spec.fix = {{"link2.ixx", 1.0, "fit.yaml:6:3"}};
  EXPECT_THAT(asked.Error(),
              HasSubstr("fit.yaml:6:3: the values make no possible body: "));
}

TEST(ChooseFree, RefusesBoundsThatLeaveNothing) {
  Asked asked;
  asked.spec.free = {Free("link1.length")};
  asked.spec.free[0].upper = -1.0;
  EXPECT_THAT(asked.Error(),
              HasSubstr("fit.yaml:2:3: the bounds of 'link1.length' leave "
                        "nothing between them: ["));
  asked.spec.free[0].upper = 0.2;
  EXPECT_THAT(asked.Error(),
              HasSubstr("fit.yaml:2:3: 'link1.length' starts at 0.5 outside "
                        "its bounds ["));
  EXPECT_THAT(asked.Error(),
              HasSubstr("hint: widen the bounds, or give an initial value "
                        "between them"));
}

// All entries of an inertia are fitted through its square root, where a bound
// of one of them means nothing.
TEST(ChooseFree, RefusesBoundsOfAWholeInertia) {
  Asked asked;
  for (const char* entry : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}) {
    asked.spec.free.push_back(Free(std::string("link2.") + entry));
  }
  const Session choice = asked.Choose();
  EXPECT_EQ(choice.free[0].upper, std::numeric_limits<double>::infinity());
  asked.spec.free[1].upper = 1.0;
  EXPECT_EQ(asked.Error(),
            "fit.yaml:2:3: 'link2.iyy' can have neither bounds nor a prior "
            "while all entries of its link's inertia are free\n"
            "  hint: they are kept physically possible together; free "
            "inertia_scale instead to bound them");
}

TEST(ChooseFree, AsksForSomethingToFitWhereSomethingMustBe) {
  Asked asked;
  EXPECT_THAT(asked.Error(),
              HasSubstr("--free: nothing is free, so there is nothing to fit\n"
                        "  hint: name parameters with --free; this model has "
                        "link1.length, "));
  asked.spec.path = "fit.yaml";
  EXPECT_THAT(asked.Error(), HasSubstr("fit.yaml: nothing is free"));
  asked.request.may_free_nothing = true;
  EXPECT_EQ(asked.Error(), "no error");
}

TEST(ChooseFree, FreesNothingOfTheSpecificationByNone) {
  Asked asked;
  asked.spec.free = {Free("link1.length")};
  EXPECT_EQ(asked.Choose().free.size(), 1u);
  asked.request.free_none = true;
  asked.request.may_free_nothing = true;
  EXPECT_TRUE(asked.Choose().free.empty());
}

// Effects stay as it has them; what --add names is to be found.
TEST(ChooseFree, HoldsEffectsOfTheSpecificationByNone) {
  Asked asked;
  FitSpecification::Free damping = Free("joint1.damping");
  damping.initial = 0.3;
  asked.spec.free = {damping};
  asked.spec.effects = {{"viscous_damping@joint1", "fit.yaml:3:3"}};
  asked.request.free_none = true;
  asked.request.add = SplitEffects("coulomb_friction@joint1", "--add");
  const Session session = asked.Choose();
  ASSERT_EQ(session.free.size(), 1u);
  EXPECT_EQ(session.free[0].parameter.name, "joint1.friction");
  EXPECT_EQ(
      FindParameters(session.model, {"joint1.damping"}, "test")[0].nominal,
      0.3);
}

TEST(CheckValue, RefusesWhatAParameterCannotBe) {
  Asked asked;
  asked.request.add = SplitEffects("cogging@joint1", "--add");
  const Model model = asked.Choose().model;
  const auto error = [&](const std::string& name, double value) {
    const Parameter parameter = FindParameters(model, {name}, "test").front();
    return ErrorText([&] { CheckValue(model, parameter, value, "--set"); });
  };
  EXPECT_EQ(error("link1.length", 0.3), "no error");
  EXPECT_THAT(error("link1.length", -0.3),
              HasSubstr("--set: 'link1.length' cannot be -0.3 m\n"
                        "  hint: it lies between "));
  EXPECT_THAT(error("link1.length", std::nan("")),
              HasSubstr("--set: 'link1.length' cannot be nan m"));
  EXPECT_EQ(error("joint1.cogging_order", 3.0), "no error");
  EXPECT_THAT(error("joint1.cogging_order", 3.5), HasSubstr("cannot be 3.5"));
}

// An arm of two hinges about y; `tip` is the second link's body.
std::string TwoHinges(const std::string& tip) {
  return "<robot name='two'><link name='base'/><link name='upper'><inertial>"
         "<origin xyz='0 0 -0.2'/><mass value='2'/><inertia ixx='0.03' ixy='0' "
         "ixz='0' iyy='0.03' iyz='0' izz='0.01'/></inertial></link>"
         "<joint name='a' type='revolute'><parent link='base'/><child "
         "link='upper'/><axis xyz='0 1 0'/></joint><link name='lower'>" +
         tip +
         "</link><joint name='b' type='revolute'><origin xyz='0 0 -0.4'/>"
         "<parent link='upper'/><child link='lower'/><axis xyz='0 1 0'/>"
         "</joint></robot>";
}

std::string Inertial6(const std::string& mass, const std::string& moments) {
  return "<inertial><origin xyz='0 0 0'/><mass value='" + mass +
         "'/><inertia " + moments + "/></inertial>";
}

// What was chosen of a URDF text.
struct AskedOf : Asked {
  explicit AskedOf(const std::string& urdf) : text(urdf) {}
  Session ChooseOf() {
    const Catalogue catalogue;
    Session session(MakeModel(LoadUrdfText(text, "two.urdf"), catalogue));
    session.model_file = "two.urdf";
    ChooseFree(request, spec, catalogue, &session);
    notices = session.notices;
    return session;
  }
  std::string text;
};

constexpr char kAllSix[] =
    "lower.ixx,lower.iyy,lower.izz,lower.ixy,lower.ixz,lower.iyz";

TEST(ChooseFree, StartsAnImpossibleInertiaAtTheNearestPossible) {
  AskedOf asked(TwoHinges(Inertial6(
      "1", "ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.03'")));
  asked.request.free = SplitAssignments(kAllSix, "--free");
  const Session choice = asked.ChooseOf();
  ASSERT_EQ(asked.notices.size(), 1u);
  EXPECT_THAT(asked.notices[0],
              testing::AllOf(
                  testing::StartsWith("the inertia of lower is free and no "
                                      "body's: the fit starts from the nearest "
                                      "possible one, "),
                  testing::EndsWith(" % away")));
  double sum = 0;
  for (int k = 0; k < 2; ++k) sum += choice.free[k].initial;
  EXPECT_GE(sum, choice.free[2].initial);
  EXPECT_EQ(choice.free[0].initial,
            choice.model.nominal().links[2].inertia(0, 0));
  // Whoever holds an entry of it holds it.
  asked.request.free = SplitAssignments("upper.mass", "--free");
  asked.request.fix = SplitAssignments("lower.ixx=0.02", "--fix");
  EXPECT_EQ(asked.ChooseOf().model.nominal().links[2].inertia(2, 2), 0.03);
  EXPECT_THAT(asked.notices, IsEmpty());
}

TEST(ChooseFree, NamesTheJointThatNothingMakesRegular) {
  AskedOf asked(TwoHinges(
      Inertial6("0.2", "ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'")));
  asked.request.free = SplitAssignments("upper.mass", "--free");
  EXPECT_EQ(ErrorText([&] { asked.ChooseOf(); }),
            "two.urdf: joint 'b': link 'lower' and what it carries have no "
            "inertia about its axis\n  hint: give what moves there some mass "
            "and inertia, however small, a rotor (--add armature@b), or hold "
            "it still: --lock 'b'");
  // A rotor, a free inertia or a centre of mass off the axis do.
  asked.request.add = SplitEffects("armature@b", "--add");
  Session choice = asked.ChooseOf();
  EXPECT_EQ(choice.free.back().parameter.name, "b.armature");
  EXPECT_EQ(choice.free.back().initial, 0.01);
  EXPECT_THAT(asked.notices,
              ElementsAre("nothing else has inertia there: the fit starts "
                          "b.armature at 0.01 kg m^2"));
  asked.request.add = {};
  asked.request.free = SplitAssignments(kAllSix, "--free");
  choice = asked.ChooseOf();
  EXPECT_GT(choice.free[1].initial, 0.0);
  ASSERT_EQ(asked.notices.size(), 1u);
  EXPECT_THAT(asked.notices[0],
              HasSubstr("the inertia of lower is free and zero: the fit starts "
                        "from that of a solid ball"));
  asked.request.free = SplitAssignments("lower.com_x=0.1", "--free");
  asked.ChooseOf();
  EXPECT_THAT(asked.notices, IsEmpty());
}

// A fix is not blamed for what the file says of the link already.
TEST(ChooseFree, DoesNotBlameAFixForTheFile) {
  AskedOf asked(TwoHinges(Inertial6(
      "1", "ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.03'")));
  asked.request.free = SplitAssignments("upper.mass", "--free");
  asked.request.fix = SplitAssignments("lower.mass=1.5", "--fix");
  EXPECT_EQ(asked.ChooseOf().model.nominal().links[2].mass, 1.5);
}

TEST(ChooseCandidates, KnowsKindsNamesAndPatterns) {
  const Catalogue catalogue;
  Session session(
      MakeModel(LoadUrdf(FindModel("pendulum2_planar")), catalogue));
  const Mechanism& mechanism = session.model.mechanism();
  const auto chosen = [&](const std::vector<std::string>& names) {
    std::vector<std::string> effects;
    for (const auto& effect :
         ChooseCandidates(catalogue, session, names, "--candidates")) {
      effects.push_back(effect->name());
    }
    return effects;
  };
  // A drive's effects only where there is one, or where they are named.
  EXPECT_THAT(chosen({}), Not(Contains("effort_bias@joint1")));
  EXPECT_THAT(chosen({"effort_bias@joint1"}),
              ElementsAre("effort_bias@joint1"));
  sysid::Run run;
  run.effort.setZero(3, 2);
  run.effort(1, 0) = 0.1;
  session.runs = {run};
  EXPECT_THAT(chosen({}), Contains("effort_bias@joint1"));
  EXPECT_THAT(chosen({}), Not(Contains("cogging@joint2")));
  run.effort(2, 1) = 0.1;
  session.runs.push_back(run);
  // All laws that the recording has the columns for.
  EXPECT_GT(chosen({}).size(), catalogue.Candidates(mechanism).size());
  EXPECT_THAT(chosen({}),
              IsSupersetOf({"joint_elasticity@joint2", "sensor_delay@joint1",
                            "asymmetric_friction@joint1"}));
  EXPECT_THAT(chosen({}), Not(Contains("thermal_friction@joint1")));
  EXPECT_THAT(chosen({"spring", "spring@joint2"}),
              UnorderedElementsAre("spring@joint1", "spring@joint2"));
  EXPECT_THAT(chosen({"*_friction@joint1", "gravity*"}),
              ElementsAre("coulomb_friction@joint1", "stribeck_friction@joint1",
                          "load_friction@joint1", "gravity_tilt@base"));
  EXPECT_EQ(ErrorText([&] { chosen({"sprung"}); }),
            "--candidates: unknown effect 'sprung'\n"
            "  hint: did you mean 'spring'?");
  EXPECT_THAT(ErrorText([&] { chosen({"sprig@*"}); }),
              testing::StartsWith("--candidates: 'sprig@*' meets no effect of "
                                  "this model\n  hint: near names: "
                                  "spring@joint1, spring@joint2;"));
}

}  // namespace
}  // namespace sysid
