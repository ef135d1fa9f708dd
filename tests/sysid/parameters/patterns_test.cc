#include "sysid/parameters/patterns.h"

#include <gmock/gmock.h>

#include "models/find_model.h"
#include "models/hold_joints.h"
#include "models/urdf/load_urdf.h"
#include "sysid/parameters/fit_specification.h"
#include "tests/support/error_text.h"

namespace sysid {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// A plate on the floor; two links, a massless flange and a gripper on the
// second; a ball behind them.
constexpr char kArm[] = R"(<robot name="arm"><link name="floor"/>
<joint name="bolt" type="fixed"><parent link="floor"/><child link="plate"/>
</joint>
<link name="plate"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="joint1" type="continuous"><parent link="plate"/>
<child link="link1"/><axis xyz="0 1 0"/></joint>
<link name="link1"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="joint2" type="continuous"><parent link="link1"/>
<child link="link2"/><axis xyz="1 0 0"/></joint>
<link name="link2"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="weld" type="fixed"><parent link="link2"/><child link="flange"/>
</joint><link name="flange"/>
<joint name="screw" type="fixed"><parent link="flange"/><child link="gripper"/>
</joint>
<link name="gripper"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="ball" type="spherical"><parent link="flange"/>
<child link="bob"/></joint>
<link name="bob"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>)";

class PatternsTest : public ::testing::Test {
 protected:
  std::vector<std::string> Parameters(const std::string& pattern) const {
    return Expand(pattern, "--free", ParameterVocabulary(model_));
  }
  std::vector<std::string> Effects(const std::string& pattern) const {
    return Expand(pattern, "--add",
                  EffectVocabulary(catalogue_, model_.mechanism()));
  }

  Catalogue catalogue_;
  Model model_ = MakeModel(LoadUrdfText(kArm, "arm.urdf"), catalogue_);
};

TEST_F(PatternsTest, MeetParametersOfWhatMovesAndShows) {
  EXPECT_THAT(Parameters("*.mass"), ElementsAre("link1.mass", "link2.mass",
                                                "gripper.mass", "bob.mass"));
  // Not the plate's, which cannot move.
  EXPECT_THAT(Parameters("*.com_x"), ElementsAre("link1.com_x", "link2.com_x",
                                                 "gripper.com_x", "bob.com_x"));
  EXPECT_THAT(Parameters("link[2-9].com_?"),
              ElementsAre("link2.com_x", "link2.com_y", "link2.com_z"));
  EXPECT_THAT(Parameters("grav*"), ElementsAre("gravity"));
  EXPECT_THAT(Parameters("link2.*"),
              AllOf(Contains("link2.inertia_scale"), Contains("link2.ixy")));
}

TEST_F(PatternsTest, MeetParametersOfEffectsButNoWholeNumbers) {
  for (const char* effect : {"cogging@joint1", "viscous_damping@joint2"}) {
    model_.AddEffect(catalogue_.Make(effect, model_.mechanism(), "test"));
  }
  EXPECT_THAT(Parameters("joint?.[cd]*"),
              ElementsAre("joint1.cogging_sin", "joint1.cogging_cos",
                          "joint2.damping"));
}

TEST_F(PatternsTest, InertialIsAllOfEachLinkBehindAJoint) {
  const std::vector<std::string> inertial = Parameters("inertial");
  EXPECT_EQ(inertial.size(), 30u);
  EXPECT_THAT(std::vector<std::string>(inertial.begin(), inertial.begin() + 10),
              ElementsAre("link1.mass", "link1.com_x", "link1.com_y",
                          "link1.com_z", "link1.ixx", "link1.iyy", "link1.izz",
                          "link1.ixy", "link1.ixz", "link1.iyz"));
  EXPECT_EQ(inertial[10], "link2.mass");
  EXPECT_EQ(inertial[20], "bob.mass");
}

TEST_F(PatternsTest, MeetEffectsWhereTheyHaveAMeaning) {
  EXPECT_THAT(Effects("viscous_damping@*"),
              ElementsAre("viscous_damping@joint1", "viscous_damping@joint2",
                          "viscous_damping@ball"));
  // Not of a ball.
  EXPECT_THAT(Effects("effort_bias@*"),
              ElementsAre("effort_bias@joint1", "effort_bias@joint2"));
  EXPECT_THAT(Effects("*_friction@joint2"),
              ElementsAre("coulomb_friction@joint2", "stribeck_friction@joint2",
                          "load_friction@joint2"));
  // Those that only their kind names.
  EXPECT_THAT(
      Effects("asymmetric_friction@*"),
      ElementsAre("asymmetric_friction@joint1", "asymmetric_friction@joint2"));
  EXPECT_THAT(Effects("gravity_tilt@*"), ElementsAre("gravity_tilt@base"));
  EXPECT_THAT(Effects("mass@*"), ElementsAre("mass@link1", "mass@link2",
                                             "mass@gripper", "mass@bob"));
}

TEST_F(PatternsTest, DoNotMeetJointsThatAreHeld) {
  const Mechanism held = HoldJoints(
      model_.mechanism(), {{model_.mechanism().FindJoint("joint1"), 0.3}});
  EXPECT_THAT(
      Expand("viscous_damping@*", "--add", EffectVocabulary(catalogue_, held)),
      ElementsAre("viscous_damping@joint2", "viscous_damping@ball"));
  const Vocabulary parameters =
      ParameterVocabulary(MakeModel(held, catalogue_));
  EXPECT_THAT(Expand("link*.mass", "--free", parameters),
              ElementsAre("link2.mass"));
  EXPECT_THAT(Expand("inertial", "--free", parameters),
              Not(Contains("link1.mass")));
}

TEST_F(PatternsTest, ThatMeetNothingNameWhatIsNear) {
  EXPECT_EQ(ErrorText([&] { Parameters("lnik*.mass"); }),
            "--free: 'lnik*.mass' meets no parameter of this model\n"
            "  hint: near names: link1.mass, link2.mass; parameters of effects "
            "are there where the effect is (--add), those of links where they "
            "move");
  EXPECT_EQ(ErrorText([&] { Effects("viscous_dampin@joint[1-4]"); }),
            "--add: 'viscous_dampin@joint[1-4]' meets no effect of this "
            "model\n"
            "  hint: near names: viscous_damping@joint1, "
            "viscous_damping@joint2; joints and links that are fixed or held "
            "(--lock) have none");
  EXPECT_THAT(ErrorText([&] { Effects("effort_bias@bal?"); }),
              StartsWith("--add: 'effort_bias@bal?' meets no effect"));
  EXPECT_EQ(ErrorText([&] {
              Expand("join_*", "--gains", JointVocabulary(model_.mechanism()));
            }),
            "--gains: 'join_*' meets no joint of one degree of freedom of this "
            "model\n  hint: near names: joint1, joint2");
  // A bracket that does not end is a letter.
  EXPECT_THAT(ErrorText([&] { Parameters("link1.mass["); }),
              HasSubstr("near names: link1.mass;"));
}

TEST_F(PatternsTest, GiveWayToNamesThatAreWrittenOut) {
  const std::vector<NamedValue> list = {{"link2.mass", 2.0, "here"},
                                        {"*.mass", 1.0, "there"},
                                        {"link1.com_x", {}, "here"},
                                        {"link1.[cm]*", 3.0, "last"}};
  std::vector<std::string> expanded;
  for (const NamedValue& one :
       ExpandPatterns(list, &NamedValue::name, ParameterVocabulary(model_))) {
    expanded.push_back(one.name + "@" + one.place);
  }
  EXPECT_THAT(expanded, ElementsAre("link2.mass@here", "gripper.mass@there",
                                    "bob.mass@there", "link1.com_x@here",
                                    "link1.mass@last", "link1.com_y@last",
                                    "link1.com_z@last"));
}

TEST_F(PatternsTest, LeaveOtherNamesToOthers) {
  const std::vector<NamedValue> list = {
      {"link9.mass", {}, ""}, {"link1.mass", {}, ""}, {"link1.mass", {}, ""}};
  EXPECT_EQ(ExpandPatterns(list, &NamedValue::name, ParameterVocabulary(model_))
                .size(),
            3u);
}

TEST_F(PatternsTest, AreNoPatternsWhereANameReadsLikeThat) {
  Vocabulary vocabulary;
  vocabulary.names = vocabulary.met = {"link[1].mass", "link1.mass"};
  EXPECT_FALSE(IsPattern("link[1].mass", vocabulary));
  EXPECT_TRUE(IsPattern("link[2].mass", vocabulary));
  EXPECT_FALSE(IsPattern("inertial", vocabulary));
}

}  // namespace
}  // namespace sysid
