#include "models/urdf/load_urdf.h"

#include <gmock/gmock.h>

#include <clocale>
#include <cmath>
#include <limits>
#include <string>

#include "models/error.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;

constexpr char kInertial[] =
    "<inertial><mass value='2'/><inertia ixx='1' ixy='0' ixz='0' iyy='2' "
    "iyz='0' izz='2.5'/></inertial>";

std::string Link(const std::string& name) {
  return "<link name='" + name + "'>" + kInertial + "</link>";
}

// `rest` stands inside of the joint.
std::string JointText(const std::string& name, const std::string& type,
                      const std::string& parent, const std::string& child,
                      const std::string& rest = "") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" +
         parent + "'/><child link='" + child + "'/>" + rest + "</joint>";
}

Mechanism Load(const std::string& body) {
  return LoadUrdfText("<robot name='r'>" + body + "</robot>", "r.urdf");
}

Mechanism OneJoint(const std::string& type, const std::string& rest = "") {
  return Load("<link name='base'/>" + Link("a") +
              JointText("j", type, "base", "a", rest));
}

TEST(LoadUrdf, KnowsEveryJointType) {
  for (JointType type : {JointType::kRevolute, JointType::kContinuous,
                         JointType::kPrismatic, JointType::kSpherical}) {
    const Mechanism mechanism = OneJoint(ToString(type));
    EXPECT_EQ(mechanism.joints[0].type, type);
    EXPECT_EQ(mechanism.nq, ConfigurationSize(type));
    EXPECT_EQ(mechanism.nv, VelocitySize(type));
  }
}

TEST(LoadUrdf, KeepsTheOrderOfTheFileWithParentsFirst) {
  // urdfdom sorts by name; here neither links nor joints are in its order, and
  // the joint of the last link comes first.
  const Mechanism mechanism =
      Load(Link("z") + Link("m") + "<link name='base'/>" + Link("a") +
           Link("b") + JointText("j9", "fixed", "z", "b") +
           JointText("j8", "continuous", "base", "m") +
           JointText("j7", "spherical", "base", "z") +
           JointText("j1", "prismatic", "m", "a"));
  EXPECT_THAT(mechanism.LinkNames(), ElementsAre("base", "m", "z", "b", "a"));
  EXPECT_THAT(mechanism.JointNames(), ElementsAre("j8", "j7", "j1"));
  EXPECT_EQ(mechanism.joints[2].name, "j9");
  EXPECT_EQ(mechanism.joints[2].type, JointType::kFixed);
  EXPECT_EQ(mechanism.joints[2].parent_link, 2);
  EXPECT_EQ(mechanism.joints[3].parent_link, 1);
  EXPECT_EQ(mechanism.joints[3].v_index, 4);
  EXPECT_THAT(mechanism.links[0].child_joints, ElementsAre(0, 1));
}

TEST(LoadUrdf, TurnsTheInertiaIntoLinkAxes) {
  // Roll of a quarter turn: y of the inertia is z of the link.
  const Mechanism mechanism = Load(
      "<link name='base'/><link name='a'><inertial>"
      "<origin xyz='0.1 0.2 0.3' rpy='1.5707963267948966 0 0'/>"
      "<mass value='2'/><inertia ixx='1' ixy='0.1' ixz='0.2' iyy='2' iyz='0.3' "
      "izz='2.5'/></inertial></link>" +
      JointText("j", "spherical", "base", "a"));
  const Inertial<double>& body = mechanism.nominal.links[1];
  EXPECT_EQ(body.mass, 2);
  EXPECT_EQ(body.com, Eigen::Vector3d(0.1, 0.2, 0.3));
  Eigen::Matrix3d expected;
  expected << 1, -0.2, 0.1, -0.2, 2.5, -0.3, 0.1, -0.3, 2;
  EXPECT_LT((body.inertia - expected).norm(), 1e-15);
  EXPECT_EQ(body.inertia, body.inertia.transpose());
}

TEST(LoadUrdf, ReadsTheJointsOriginAsFixedAxisAngles) {
  const Mechanism mechanism =
      OneJoint("continuous", "<origin xyz='1 2 3' rpy='0.1 0.2 0.3'/>");
  const Eigen::Matrix3d expected =
      (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) *
       Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  EXPECT_LT((mechanism.joints[0].R_PJ - expected).norm(), 1e-15);
  EXPECT_EQ(mechanism.nominal.joint_p[0], Eigen::Vector3d(1, 2, 3));
}

TEST(LoadUrdf, TakesXForAMissingAxis) {
  EXPECT_EQ(OneJoint("continuous").joints[0].axis, Eigen::Vector3d::UnitX());
}

TEST(LoadUrdf, NormalisesAnAxisThatLostDigits) {
  const Joint joint =
      OneJoint("continuous", "<axis xyz='0.7071 0 0.7071'/>").joints[0];
  EXPECT_NEAR(joint.axis.norm(), 1, 1e-15);
  EXPECT_NEAR(joint.axis[0], std::sqrt(0.5), 1e-15);
}

TEST(LoadUrdf, KeepsDynamicsAndLimits) {
  const Joint joint =
      OneJoint("revolute",
               "<dynamics damping='0.1' friction='0.2'/>"
               "<limit lower='-1' upper='2' effort='3' velocity='4'/>")
          .joints[0];
  EXPECT_EQ(joint.damping, 0.1);
  EXPECT_EQ(joint.friction, 0.2);
  EXPECT_TRUE(joint.has_limits);
  EXPECT_EQ(joint.lower, -1);
  EXPECT_EQ(joint.upper, 2);
  EXPECT_EQ(joint.effort_limit, 3);
  EXPECT_EQ(joint.velocity_limit, 4);
  EXPECT_EQ(
      OneJoint("spherical", "<dynamics damping='0.1'/>").joints[0].damping,
      0.1);
}

TEST(LoadUrdf, NeedsNoLimits) {
  EXPECT_FALSE(OneJoint("revolute").joints[0].has_limits);
  const Joint joint =
      OneJoint("prismatic", "<limit lower='0' upper='1'/>").joints[0];
  EXPECT_TRUE(joint.has_limits);
  EXPECT_EQ(joint.effort_limit, std::numeric_limits<double>::infinity());
}

TEST(LoadUrdf, AllowsAMasslessLinkThatIsFixedToAMassiveOne) {
  const Mechanism mechanism =
      Load("<link name='base'/><link name='flange'/>" + Link("a") +
           JointText("j", "continuous", "base", "flange") +
           JointText("f", "fixed", "flange", "a"));
  EXPECT_EQ(mechanism.nominal.links[1].mass, 0);
  EXPECT_EQ(mechanism.nominal.links[2].mass, 2);
}

TEST(LoadUrdf, IgnoresVisualsAndTheExtensionsOfOthers) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  const Mechanism mechanism = Load(
      "<material name='blue'/><gazebo><static>x</static></gazebo>"
      "<transmission name='t'/><link name='base'><visual><geometry><mesh/>"
      "</geometry></visual></link>" +
      Link("a") +
      JointText("j", "spherical", "base", "a",
                "<safety_controller/><calibration/>"));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(mechanism.nv, 3);
}

TEST(LoadUrdf, ReadsNumbersSeparatedByAnyWhiteSpaceAndSigns) {
  const Mechanism mechanism =
      OneJoint("continuous", "<origin xyz=' +1\n\t2.5e-1  -3 '/>");
  EXPECT_EQ(mechanism.nominal.joint_p[0], Eigen::Vector3d(1, 0.25, -3));
}

TEST(LoadUrdf, ReadsDecimalPointsInEveryLocale) {
  const char* set = std::setlocale(LC_ALL, "de_DE.UTF-8");
  if (!set) GTEST_SKIP() << "no German locale on this machine";
  const Mechanism mechanism = OneJoint("continuous", "<origin xyz='0.5 0 0'/>");
  std::setlocale(LC_ALL, "C");
  EXPECT_EQ(mechanism.nominal.joint_p[0][0], 0.5);
}

TEST(LoadUrdf, UnderstandsEscapesInNames) {
  const Mechanism mechanism =
      Load("<link name='base'/>" + Link("a&amp;b") +
           JointText("j&lt;", "spherical", "base", "a&amp;b"));
  EXPECT_EQ(mechanism.links[1].name, "a&b");
  EXPECT_EQ(mechanism.joints[0].name, "j<");
}

}  // namespace
}  // namespace sysid
