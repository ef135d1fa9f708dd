#include "models/mechanism.h"

#include <gmock/gmock.h>

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Inertial<double> Body(double mass, const Eigen::Vector3d& com,
                      const Eigen::Vector3d& moments) {
  Inertial<double> body;
  body.mass = mass;
  body.com = com;
  body.inertia = moments.asDiagonal();
  return body;
}

int Add(Mechanism* mechanism, const std::string& name, JointType type,
        const std::string& parent, const Eigen::Vector3d& p_PJ,
        const Inertial<double>& body = Inertial<double>()) {
  Joint joint;
  joint.name = name + "_joint";
  joint.type = type;
  joint.parent_link = mechanism->FindLink(parent);
  return mechanism->AddJoint(joint, name, p_PJ, body);
}

Mechanism OneOfEachJoint() {
  const Inertial<double> body = Body(1.0, {0, 0, 0.1}, {1, 1, 1});
  Mechanism mechanism;
  mechanism.AddRoot("root");
  Add(&mechanism, "slide", JointType::kPrismatic, "root", {0, 0, 1}, body);
  Add(&mechanism, "ball", JointType::kSpherical, "slide", {3, 4, 0}, body);
  Add(&mechanism, "mount", JointType::kFixed, "ball", {0, 0, 0}, body);
  Add(&mechanism, "hinge", JointType::kRevolute, "ball", {0, 2, 0}, body);
  Add(&mechanism, "wheel", JointType::kContinuous, "mount", {1, 0, 0},
      Body(1.0, {0, 0, 0}, {1, 1, 1}));
  Add(&mechanism, "tip", JointType::kFixed, "hinge", {0, 0, -0.7});
  return mechanism;
}

TEST(Mechanism, CountsAndIndexesItsCoordinatesInTheOrderOfItsJoints) {
  const Mechanism mechanism = OneOfEachJoint();
  EXPECT_EQ(mechanism.nq, 1 + 4 + 0 + 1 + 1 + 0);
  EXPECT_EQ(mechanism.nv, 1 + 3 + 0 + 1 + 1 + 0);
  std::vector<int> q, v;
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    q.push_back(mechanism.joints[i].q_index);
    v.push_back(mechanism.joints[i].v_index);
    EXPECT_EQ(mechanism.joints[i].child_link, static_cast<int>(i) + 1);
    EXPECT_LE(mechanism.joints[i].parent_link, static_cast<int>(i));
  }
  EXPECT_THAT(q, ElementsAre(0, 1, 5, 5, 6, 7));
  EXPECT_THAT(v, ElementsAre(0, 1, 4, 4, 5, 6));
}

TEST(Mechanism, KnowsTheChildrenOfEachLinkInTheirOrder) {
  const Mechanism mechanism = OneOfEachJoint();
  const int ball = mechanism.FindLink("ball");
  EXPECT_THAT(mechanism.links[ball].child_joints,
              ElementsAre(mechanism.FindJoint("mount_joint"),
                          mechanism.FindJoint("hinge_joint")));
  EXPECT_THAT(mechanism.links[mechanism.FindLink("tip")].child_joints,
              IsEmpty());
}

TEST(Mechanism, FindsItsPartsByNameAndSaysMinusOneOtherwise) {
  const Mechanism mechanism = OneOfEachJoint();
  EXPECT_EQ(mechanism.FindLink("root"), 0);
  EXPECT_EQ(mechanism.FindLink("hinge"), 4);
  EXPECT_EQ(mechanism.FindLink("hinge_joint"), -1);
  EXPECT_EQ(mechanism.FindJoint("hinge_joint"), 3);
  EXPECT_EQ(mechanism.FindJoint("hinge"), -1);
}

TEST(Mechanism, ListsMovingJointsOnlyAndEveryLink) {
  const Mechanism mechanism = OneOfEachJoint();
  EXPECT_THAT(
      mechanism.JointNames(),
      ElementsAre("slide_joint", "ball_joint", "hinge_joint", "wheel_joint"));
  EXPECT_THAT(
      mechanism.LinkNames(),
      ElementsAre("root", "slide", "ball", "mount", "hinge", "wheel", "tip"));
}

TEST(Mechanism, NeutralConfigurationHasIdentityQuaternionsWithWLast) {
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(7);
  expected[4] = 1.0;  // after the slide: x, y, z, w
  EXPECT_EQ(OneOfEachJoint().NeutralConfiguration(), expected);
}

TEST(Mechanism, JointTypesHaveTheSizesAndNamesOfTheContract) {
  EXPECT_EQ(ConfigurationSize(JointType::kFixed), 0);
  EXPECT_EQ(ConfigurationSize(JointType::kPrismatic), 1);
  EXPECT_EQ(ConfigurationSize(JointType::kSpherical), 4);
  EXPECT_EQ(VelocitySize(JointType::kFixed), 0);
  EXPECT_EQ(VelocitySize(JointType::kContinuous), 1);
  EXPECT_EQ(VelocitySize(JointType::kSpherical), 3);
  EXPECT_TRUE(IsRotation1(JointType::kRevolute));
  EXPECT_TRUE(IsRotation1(JointType::kContinuous));
  EXPECT_FALSE(IsRotation1(JointType::kPrismatic));
  EXPECT_FALSE(IsRotation1(JointType::kSpherical));
  EXPECT_EQ(ToString(JointType::kFixed), "fixed");
  EXPECT_EQ(ToString(JointType::kRevolute), "revolute");
  EXPECT_EQ(ToString(JointType::kContinuous), "continuous");
  EXPECT_EQ(ToString(JointType::kPrismatic), "prismatic");
  EXPECT_EQ(ToString(JointType::kSpherical), "spherical");
}

TEST(MechanismDeathTest, RefusesAnAxisThatIsNotUnitAndAParentThatIsNotThere) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  Joint joint;
  joint.name = "bent";
  joint.parent_link = 0;
  joint.axis = Eigen::Vector3d(0, 0, 2);
  EXPECT_DEATH(mechanism.AddJoint(joint, "a", {0, 0, 0}, {}), "bent");
  joint.axis = Eigen::Vector3d::UnitX();
  joint.parent_link = 1;
  EXPECT_DEATH(mechanism.AddJoint(joint, "a", {0, 0, 0}, {}), "parent_link");
  EXPECT_DEATH(mechanism.AddRoot("again"), "the root is added first, once");
}

TEST(LinkLength, IsTheDistanceToTheFirstChildJoint) {
  const Mechanism mechanism = OneOfEachJoint();
  EXPECT_EQ(
      LinkLength(mechanism, mechanism.nominal, mechanism.FindLink("slide")),
      5.0);
}

TEST(LinkLength, CountsAFixedTip) {
  const Mechanism mechanism = OneOfEachJoint();
  EXPECT_EQ(
      LinkLength(mechanism, mechanism.nominal, mechanism.FindLink("hinge")),
      0.7);
}

TEST(LinkLength, OfALastLinkIsTwiceTheDistanceOfItsCentreOfMass) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  Add(&mechanism, "arm", JointType::kRevolute, "root", {9, 9, 9},
      Body(1.0, {0.3, 0, -0.4}, {1, 1, 1}));
  EXPECT_EQ(LinkLength(mechanism, mechanism.nominal, 1), 1.0);
}

TEST(LinkLength, IsZeroWhereItIsUndefined) {
  const Mechanism mechanism = OneOfEachJoint();
  EXPECT_EQ(
      LinkLength(mechanism, mechanism.nominal, mechanism.FindLink("wheel")),
      0.0);
}

TEST(LinkLength, ComesFromTheParametersGivenAndNotFromTheNominalOnes) {
  const Mechanism mechanism = OneOfEachJoint();
  MechanismParameters<double> changed = mechanism.nominal;
  changed.joint_p[mechanism.FindJoint("ball_joint")] *= 2.0;
  EXPECT_EQ(LinkLength(mechanism, changed, mechanism.FindLink("slide")), 10.0);
}

TEST(LinkAxis, PointsToTheFirstChildJoint) {
  const Mechanism mechanism = OneOfEachJoint();
  EXPECT_TRUE(LinkAxis(mechanism, mechanism.FindLink("slide"))
                  .isApprox(Eigen::Vector3d(0.6, 0.8, 0.0), 1e-15));
}

TEST(LinkAxis, OfALinkWhoseFirstChildSitsOnItsJointPointsToItsCentreOfMass) {
  const Mechanism mechanism = OneOfEachJoint();
  EXPECT_EQ(LinkAxis(mechanism, mechanism.FindLink("ball")),
            Eigen::Vector3d(0, 0, 1));
}

TEST(LinkAxis, OfALastLinkPointsToItsCentreOfMass) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  Add(&mechanism, "arm", JointType::kRevolute, "root", {9, 9, 9},
      Body(1.0, {0.3, 0, -0.4}, {1, 1, 1}));
  EXPECT_TRUE(
      LinkAxis(mechanism, 1).isApprox(Eigen::Vector3d(0.6, 0, -0.8), 1e-15));
}

TEST(LinkAxis, IsZWhereEverythingIsAtTheJoint) {
  const Mechanism mechanism = OneOfEachJoint();
  EXPECT_EQ(LinkAxis(mechanism, mechanism.FindLink("wheel")),
            Eigen::Vector3d::UnitZ());
}

TEST(SecondMoments, AreTheSumsOfMassTimesCoordinates) {
  // Point masses 2 kg at x = +-0.5 m and 3 kg at y = +-0.1 m.
  const Eigen::Vector3d sums(2 * 2 * 0.25, 2 * 3 * 0.01, 0.0);
  const Eigen::Matrix3d inertia =
      Eigen::Vector3d(sums[1] + sums[2], sums[0] + sums[2], sums[0] + sums[1])
          .asDiagonal();
  EXPECT_TRUE(SecondMoments<double>(inertia).isApprox(
      Eigen::Matrix3d(sums.asDiagonal()), 1e-15));
}

}  // namespace
}  // namespace sysid
