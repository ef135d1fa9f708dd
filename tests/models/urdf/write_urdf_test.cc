#include "models/urdf/write_urdf.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "models/find_model.h"
#include "models/hold_joints.h"
#include "models/urdf/load_urdf.h"
#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Model Load(const std::string& name) {
  return MakeModel(LoadUrdf(FindModel(name)), Catalogue());
}

Mechanism Reload(const Model& model,
                 const std::vector<std::string>& comments = {}) {
  return LoadUrdfText(WriteUrdf(model, comments), "written.urdf");
}

// Everything equal to the last bit but R_PJ.
void ExpectSame(const Mechanism& a, const Mechanism& b) {
  ASSERT_EQ(a.LinkNames(), b.LinkNames());
  ASSERT_EQ(a.joints.size(), b.joints.size());
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.nq, b.nq);
  EXPECT_EQ(a.nv, b.nv);
  for (size_t i = 0; i < a.joints.size(); ++i) {
    const Joint& s = a.joints[i];
    const Joint& t = b.joints[i];
    EXPECT_EQ(s.name, t.name);
    EXPECT_EQ(s.type, t.type);
    EXPECT_EQ(s.parent_link, t.parent_link);
    EXPECT_LT((s.R_PJ - t.R_PJ).cwiseAbs().maxCoeff(), 1e-15) << s.name;
    if (VelocitySize(s.type) == 1) {
      EXPECT_EQ(s.axis, t.axis) << s.name;
    }
    EXPECT_EQ(s.has_limits, t.has_limits);
    EXPECT_EQ(s.lower, t.lower);
    EXPECT_EQ(s.upper, t.upper);
    EXPECT_EQ(s.effort_limit, t.effort_limit);
    EXPECT_EQ(s.velocity_limit, t.velocity_limit);
    EXPECT_EQ(a.nominal.joint_p[i], b.nominal.joint_p[i]);
  }
  for (size_t i = 0; i < a.links.size(); ++i) {
    const Inertial<double>& s = a.nominal.links[i];
    const Inertial<double>& t = b.nominal.links[i];
    EXPECT_EQ(s.mass, t.mass);
    EXPECT_EQ(s.com, t.com);
    EXPECT_EQ(s.inertia, t.inertia) << a.links[i].name;
  }
}

TEST(WriteUrdf, ShippedRobotsLoadAgainToTheSameNumbers) {
  for (const std::string& name : ShippedModels()) {
    SCOPED_TRACE(name);
    const Model model = Load(name);
    ExpectSame(model.mechanism(), Reload(model));
  }
}

TEST(WriteUrdf, RandomTreesLoadAgainToTheSameNumbers) {
  Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    SCOPED_TRACE(trial);
    const Mechanism mechanism = RandomMechanism(1 + trial % 12, &random);
    ExpectSame(mechanism, Reload(Model(mechanism)));
  }
}

TEST(WriteUrdf, RotationsComeBackAlsoWherePitchIsAQuarterTurn) {
  Random random(1);
  const auto angle = [&] { return random.Uniform(-M_PI, M_PI); };
  for (int trial = 0; trial < 200; ++trial) {
    Mechanism mechanism = Load("pendulum1").mechanism();
    Eigen::Quaterniond q = random.Rotation();
    if (trial % 2) {
      const double pitch =
          (trial % 4 == 1 ? 1 : -1) * (M_PI / 2 - (trial % 8 < 4 ? 0 : 1e-9));
      q = Eigen::AngleAxisd(angle(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angle(), Eigen::Vector3d::UnitX());
    }
    mechanism.joints[0].R_PJ = q.normalized().toRotationMatrix();
    const Eigen::Matrix3d back = Reload(Model(mechanism)).joints[0].R_PJ;
    EXPECT_LT((back - mechanism.joints[0].R_PJ).cwiseAbs().maxCoeff(), 1e-15)
        << "trial " << trial << "\n"
        << mechanism.joints[0].R_PJ;
  }
}

TEST(WriteUrdf, AFittedModelKeepsItsValues) {
  Model model = Load("arm7");
  MechanismParameters<double> fitted = model.nominal();
  Random random(2);
  for (Inertial<double>& body : fitted.links) {
    const double k = random.Uniform(0.9, 1.1);
    body.mass *= k / 3;
    body.com *= k / 7;
    body.inertia *= k * M_PI;
  }
  for (Eigen::Vector3d& p : fitted.joint_p) p *= random.Uniform(0.9, 1.1);
  model.SetNominal(fitted);
  const Mechanism back = Reload(model);
  for (size_t i = 0; i < back.links.size(); ++i) {
    EXPECT_EQ(back.nominal.links[i].mass, fitted.links[i].mass);
    EXPECT_EQ(back.nominal.links[i].com, fitted.links[i].com);
    EXPECT_EQ(back.nominal.links[i].inertia, fitted.links[i].inertia);
  }
  for (size_t i = 0; i < back.joints.size(); ++i) {
    EXPECT_EQ(back.nominal.joint_p[i], fitted.joint_p[i]);
  }
}

TEST(WriteUrdf, DampingAndFrictionBecomeDynamics) {
  Model model = Load("cartpole");
  const Catalogue catalogue;
  model.AddEffect(
      catalogue.Make("viscous_damping@slider", model.mechanism(), "--add"));
  model.AddEffect(
      catalogue.Make("coulomb_friction@hinge", model.mechanism(), "--add"));
  model.SetEffectParameter("slider.damping", 0.1 / 3);
  model.SetEffectParameter("hinge.friction", 2e-3);
  const Model back = MakeModel(Reload(model), catalogue);
  EXPECT_EQ(back.effects().names(), model.effects().names());
  EXPECT_EQ(back.nominal().effects, model.nominal().effects);
  EXPECT_THAT(WriteUrdf(model), Not(HasSubstr("sysid:")));
}

TEST(WriteUrdf, WhatAUrdfCannotSayIsAComment) {
  Model model = Load("cartpole");
  const Catalogue catalogue;
  model.AddEffect(
      catalogue.Make("effort_bias@slider", model.mechanism(), "--add"));
  model.SetEffectParameter("slider.effort_bias", -3.2);
  MechanismParameters<double> nominal = model.nominal();
  nominal.gravity = 1.62;
  model.SetNominal(nominal);
  const std::string text = WriteUrdf(model);
  EXPECT_THAT(text, HasSubstr("<!-- sysid: effort_bias@slider "
                              "slider.effort_bias=-3.2 N -->"));
  EXPECT_THAT(text, HasSubstr("<!-- sysid: gravity=1.62 m/s^2 -->"));
  ExpectSame(model.mechanism(), LoadUrdfText(text, "written.urdf"));
}

TEST(WriteUrdf, CommentsMayHoldDashes) {
  const Model model = Load("pendulum1");
  const std::string text =
      WriteUrdf(model, {"sysid_fit --model x --", "--->", "---"});
  EXPECT_THAT(text, HasSubstr("<!-- sysid: sysid_fit - -model x - - -->"));
  ExpectSame(model.mechanism(), LoadUrdfText(text, "written.urdf"));
}

TEST(WriteUrdf, NamesAreEscaped) {
  Mechanism mechanism = Load("pendulum1").mechanism();
  mechanism.source.reset();
  mechanism.name = "a \"b\" <c> & 'd'";
  mechanism.links[1].name = "x&y<z";
  const Mechanism back = Reload(Model(mechanism));
  EXPECT_EQ(back.name, mechanism.name);
  EXPECT_EQ(back.links[1].name, mechanism.links[1].name);
}

constexpr char kGripper[] = R"(<?xml version="1.0"?>
<!-- of a collection -->
<robot name="gripper" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <!-- sysid: effort_bias@slide slide.effort_bias=1 N -->
  <!-- grey -->
  <material name="grey"><color rgba="0.7 0.7 0.7 1"/></material>
  <link name="base"><visual><geometry><box size="1 1 1"/></geometry></visual>
  </link>
  <link name="palm">
    <inertial>
      <mass value="1.50"/>
      <origin xyz="0 0 0.10" rpy="1.5707963 0 0"/>
      <inertia ixx="1e-2" ixy="0" ixz="0" iyy="2e-2" iyz="0" izz="1.5e-2"/>
    </inertial>
    <visual>
      <geometry><mesh filename="package://g/palm.dae" scale="1 1 1"/></geometry>
      <material name="grey"/>
    </visual>
    <collision><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <joint name="slide" type="prismatic">
    <origin xyz="0 0 0.30" rpy="0.10 0.2 0.3"/>
    <parent link="base"/><child link="palm"/>
    <axis xyz="0 0 1.0"/>
    <limit lower="0" upper="0.5" effort="1e3" velocity="2"/>
    <dynamics damping="0.50"/>
    <safety_controller k_velocity="10"/>
  </joint>
  <link name="finger">
    <inertial>
      <mass value="0.1"/>
      <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/>
    </inertial>
  </link>
  <joint name="knuckle" type="revolute">
    <origin xyz="0.05 0 0.1"/>
    <parent link="palm"/><child link="finger"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="5" velocity="2"/>
    <dynamics damping="0.01" friction="0.02"/>
  </joint>
  <transmission name="t"><type>transmission_interface/SimpleTransmission</type>
    <joint name="slide"><hardwareInterface>EffortJoint</hardwareInterface>
    </joint></transmission>
  <gazebo reference="palm"><mu1>0.2</mu1></gazebo>
</robot>
)";

Model Gripper(const Mechanism& mechanism) {
  return MakeModel(mechanism, Catalogue());
}

TEST(WriteUrdf, KeepsWhatTheDynamicsDoNotUse) {
  Model model = Gripper(LoadUrdfText(kGripper, "g.urdf"));
  MechanismParameters<double> fitted = model.nominal();
  fitted.links[1].mass = 1.75;
  model.SetNominal(fitted);
  const std::string text = WriteUrdf(model, {"from a run"});
  for (const char* kept :
       {"<!-- of a collection -->", "<!-- grey -->",
        "<color rgba=\"0.7 0.7 0.7 1\"", "<box size=\"1 1 1\"",
        "<mesh filename=\"package://g/palm.dae\" scale=\"1 1 1\"",
        "<sphere radius=\"0.1\"", "<safety_controller k_velocity=\"10\"",
        "<type>transmission_interface/SimpleTransmission</type>",
        "<hardwareInterface>EffortJoint</hardwareInterface>",
        "<gazebo reference=\"palm\">", "<mu1>0.2</mu1>",
        "xmlns:xacro=\"http://www.ros.org/wiki/xacro\"",
        // Numbers that are the file's, as they are written there.
        "<mass value=\"1.75\"", "xyz=\"0 0 0.10\" rpy=\"1.5707963 0 0\"",
        "ixx=\"1e-2\"", "xyz=\"0 0 0.30\" rpy=\"0.10 0.2 0.3\"",
        "xyz=\"0 0 1.0\"", "effort=\"1e3\"", "damping=\"0.50\""}) {
    EXPECT_THAT(text, HasSubstr(kept));
  }
  EXPECT_THAT(text, HasSubstr("<!-- sysid: from a run -->"));
  EXPECT_THAT(text, Not(HasSubstr("effort_bias")));
  const Mechanism back = LoadUrdfText(text, "written.urdf");
  EXPECT_EQ(back.nominal.links[1].mass, 1.75);
  EXPECT_EQ(back.nominal.links[1].inertia, fitted.links[1].inertia);
  // Written once more of what was written: not a letter changes.
  EXPECT_EQ(WriteUrdf(Gripper(back), {"from a run"}), text);
}

TEST(WriteUrdf, TheDynamicsAloneHaveNoMeshes) {
  const Model model = Gripper(LoadUrdfText(kGripper, "g.urdf"));
  const std::string text = WriteUrdf(model, {}, UrdfContent::kDynamics);
  EXPECT_THAT(text, Not(HasSubstr("mesh")));
  ExpectSame(model.mechanism(), LoadUrdfText(text, "written.urdf"));
}

TEST(WriteUrdf, ChangedInertiasAreInTheLinksAxes) {
  Model model = Gripper(LoadUrdfText(kGripper, "g.urdf"));
  MechanismParameters<double> fitted = model.nominal();
  fitted.links[1].inertia *= 1.1;
  fitted.links[2].com = Eigen::Vector3d(0.01, 0.02, 0.03);
  fitted.joint_p[1][0] = 0.06;
  model.SetNominal(fitted);
  const Mechanism back = Reload(model);
  for (size_t i = 1; i < fitted.links.size(); ++i) {
    EXPECT_EQ(back.nominal.links[i].inertia, fitted.links[i].inertia);
    EXPECT_EQ(back.nominal.links[i].com, fitted.links[i].com);
  }
  EXPECT_EQ(back.nominal.joint_p[1], fitted.joint_p[1]);
}

TEST(WriteUrdf, HeldJointsAreWhatTheyWere) {
  const Mechanism whole = LoadUrdfText(kGripper, "g.urdf");
  for (const bool with_source : {true, false}) {
    Mechanism held = HoldJoints(whole, {{0, 0.2}});
    if (!with_source) held.source.reset();
    Model model = Gripper(held);
    MechanismParameters<double> fitted = model.nominal();
    fitted.links[2].mass = 0.125;
    model.SetNominal(fitted);
    Mechanism expected = whole;
    expected.nominal.links[2].mass = 0.125;
    const Mechanism back = Reload(model);
    ExpectSame(expected, back);
    EXPECT_EQ(back.joints[0].damping, 0.5);
    // The dynamics alone have them where they are held.
    const Mechanism still = LoadUrdfText(
        WriteUrdf(model, {}, UrdfContent::kDynamics), "written.urdf");
    EXPECT_EQ(still.joints[0].type, JointType::kFixed);
    EXPECT_TRUE(still.nominal.joint_p[0].isApprox(
        whole.nominal.joint_p[0] +
        0.2 * whole.joints[0].R_PJ * Eigen::Vector3d::UnitZ()));
  }
}

// Two fingers that follow a slide, one of them by way of the other.
constexpr char kFingers[] = R"(<robot name="gripper">
  <link name="palm"/>
  <link name="left"><inertial><mass value="0.2"/><origin xyz="0 0.01 0.05"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <link name="right"><inertial><mass value="0.3"/><origin xyz="0 0.01 0.05"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <link name="slide"><inertial><mass value="0.4"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
  <joint name="right_finger" type="revolute">
    <parent link="palm"/><child link="right"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1"/>
    <dynamics damping="0.02" friction="0.01"/>
    <mimic joint="left_finger" multiplier="-1" offset="0.125"/>
  </joint>
  <joint name="left_finger" type="revolute">
    <parent link="palm"/><child link="left"/><axis xyz="1 0 0"/>
    <mimic joint="drive" multiplier="20"/>
  </joint>
  <joint name="drive" type="prismatic">
    <parent link="palm"/><child link="slide"/><axis xyz="0 0 1"/>
  </joint>
</robot>)";

TEST(WriteUrdf, KeepsTheJointsThatFollowOthers) {
  const Mechanism gripper = LoadUrdfText(kFingers, "gripper.urdf");
  EXPECT_EQ(gripper.nv, 1);
  EXPECT_EQ(gripper.joints[0].type, JointType::kRevolute);
  const Followed right = FollowedBy(gripper, 0);
  EXPECT_EQ(gripper.joints[right.joint].name, "drive");
  EXPECT_EQ(right.multiplier, -20.0);
  EXPECT_EQ(right.offset, 0.125);
  Model model = MakeModel(gripper, Catalogue());
  model.SetEffectParameter("right_finger.damping", 0.5);
  const std::string written = WriteUrdf(model);
  EXPECT_THAT(written, HasSubstr("<mimic joint=\"left_finger\" "
                                 "multiplier=\"-1\" offset=\"0.125\" />"));
  EXPECT_THAT(written, HasSubstr("damping=\"0.5\""));
  EXPECT_THAT(written, HasSubstr("friction=\"0.01\""));
  ExpectSame(LoadUrdfText(written, "written.urdf"), gripper);
  // Without the file too.
  const Mechanism again = LoadUrdfText(
      WriteUrdf(model, {}, UrdfContent::kDynamics), "written.urdf");
  ExpectSame(again, gripper);
  EXPECT_EQ(FollowedBy(again, 0).multiplier, -20.0);
  EXPECT_EQ(FollowedBy(again, 0).offset, 0.125);
}

TEST(WriteUrdf, KeepsTheMimicsOfAJointThatIsHeld) {
  const Mechanism gripper = LoadUrdfText(kFingers, "gripper.urdf");
  const Mechanism held = HoldJoints(gripper, {{2, 0.01}});
  EXPECT_EQ(held.nv, 0);
  EXPECT_NEAR(held.joints[0].held->position, 0.125 - 0.2, 1e-15);
  ExpectSame(LoadUrdfText(WriteUrdf(MakeModel(held, Catalogue())), "w.urdf"),
             gripper);
}

}  // namespace
}  // namespace sysid
