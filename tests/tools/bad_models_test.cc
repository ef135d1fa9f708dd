// Models that cannot be used: the issue's list, each by its message.

#include <filesystem>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

constexpr char kPendulum[] = R"(<?xml version="1.0"?>
<!-- A ball on a rod. -->
<robot name="pendulum1">
  <link name="base"/>

  <joint name="joint1" type="spherical">
    <origin xyz="0 0 0" rpy="0 0 0"/>
    <parent link="base"/>
    <child link="link1"/>
  </joint>
  <link name="link1">
    <inertial>
      <origin xyz="0 0 -0.5" rpy="0 0 0"/>
      <mass value="1.0"/>
      <inertia ixx="3.90625e-5" ixy="0" ixz="0" iyy="3.90625e-5" iyz="0" izz="7.8125e-5"/>
    </inertial>
  </link>

  <joint name="tip_joint" type="fixed">
    <origin xyz="0 0 -0.5" rpy="0 0 0"/>
    <parent link="link1"/>
    <child link="tip"/>
  </joint>
  <link name="tip"/>
</robot>
)";

// The pendulum, `from` replaced by `to` (each time).
std::string Changed(const std::string& from, const std::string& to) {
  std::string text = kPendulum;
  size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  for (; at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string Hinge(const std::string& inside) {
  return Changed("type=\"spherical\">", "type=\"continuous\">" + inside);
}

class BadModelsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.Write("run.csv",
                  "t,joint1.qw,joint1.qx,joint1.qy,joint1.qz\n0,1,0,0,0\n");
  }

  // Of both programs. A place such as ":12:3" is one in the model.
  void ExpectModel(const std::string& urdf, const std::string& place,
                   const std::string& what, const std::string& hint) {
    folder_.Write("robot.urdf", urdf);
    ExpectFile("robot.urdf", "robot.urdf" + place, what, hint);
  }

  void ExpectFile(const std::string& model, const std::string& place,
                  const std::string& what, const std::string& hint) {
    ExpectFitRefused(
        folder_,
        {"--model", model, "--traj", "run.csv", "--free", "link1.length"},
        place, what, hint);
    ExpectRefused(folder_, SYSID_SIMULATE,
                  {"--model", model, "--out_csv", "made.csv"}, place, what,
                  hint);
  }

  ProgramFolder folder_;
};

TEST_F(BadModelsTest, AMissingFile) {
  ExpectFile("nowhere.urdf", "nowhere.urdf", "No such file",
             "the name of a shipped model");
}

TEST_F(BadModelsTest, AFolder) {
  ExpectFile("./", "./", "is a folder", "name a file in it");
}

TEST_F(BadModelsTest, AnUnknownName) {
  ExpectFile("fit.sysid.yaml", "--model",
             "no shipped model is named 'fit.sysid.yaml'", "given by --spec");
  ExpectFile("pendulm1", "--model", "no shipped model is named 'pendulm1'",
             "did you mean 'pendulum1'?");
}

TEST_F(BadModelsTest, NoText) {
  std::filesystem::create_symlink("/dev/zero", folder_.Path("zero.urdf"));
  const Arguments model{"--model", "zero.urdf"};
  for (const ProgramResult& result :
       {folder_.Run(SYSID_FIT, model + Arguments{"--traj", "run.csv"}),
        folder_.Run(SYSID_SIMULATE,
                    model + Arguments{"--out_csv", "made.csv"})}) {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, ::testing::StartsWith("error: zero.urdf"));
  }
}

TEST_F(BadModelsTest, NoXml) {
  ExpectModel("hello\n", ":1:1", "not XML", "a URDF is XML");
  ExpectModel("", "", "the file is empty", "a URDF is XML");
  ExpectModel("<robot name='r'><link name='a'>", ":1:32", "not XML",
              "close it by </link>");
}

TEST_F(BadModelsTest, TwoRoots) {
  ExpectModel(Changed("<link name=\"base\"/>",
                      "<link name=\"base\"/><link name=\"other\"/>"),
              ":4:22", "2 root links: 'base', 'other'", "only one link");
}

TEST_F(BadModelsTest, ALoop) {
  ExpectModel(Changed("<parent link=\"base\"/>", "<parent link=\"tip\"/>"),
              ":11:3", "a loop without a root", "a URDF is a tree");
}

TEST_F(BadModelsTest, ANegativeMass) {
  ExpectModel(Changed("<mass value=\"1.0\"", "<mass value=\"-1\""), "",
              "joint 'joint1': the inertia that it moves is negative",
              "or hold it still: --lock 'joint1'");
}

TEST_F(BadModelsTest, AMissingMass) {
  ExpectModel(Changed("<mass value=\"1.0\"/>", ""), ":12:5",
              "link 'link1': <inertial> has no <mass>", "<mass value=");
}

TEST_F(BadModelsTest, APointOnASphericalJoint) {
  const std::string zero =
      "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" "
      "iyz=\"0\" izz=\"0\"/>";
  ExpectModel(Changed("<inertia ixx=\"3.90625e-5\" ixy=\"0\" ixz=\"0\" "
                      "iyy=\"3.90625e-5\" iyz=\"0\" izz=\"7.8125e-5\"/>",
                      zero),
              "", "joint 'joint1': link 'link1' has no inertia about its axis",
              "however small");
}

TEST_F(BadModelsTest, AZeroAxis) {
  ExpectModel(Hinge("<axis xyz=\"0 0 0\"/>"), ":6:48",
              "joint 'joint1': the axis is zero", "the direction");
}

TEST_F(BadModelsTest, AMimicOfAJointThatIsNotThere) {
  ExpectModel(Hinge("<axis xyz=\"0 1 0\"/><mimic joint=\"tip_jont\"/>"),
              ":6:61",
              "joint 'joint1': follows joint 'tip_jont', which is not in the "
              "file",
              "did you mean 'tip_joint'?");
}

TEST_F(BadModelsTest, APlanarJoint) {
  ExpectModel(Changed("type=\"spherical\"", "type=\"planar\""), ":6:24",
              "joint 'joint1': planar joints are not supported",
              "two prismatic joints");
}

TEST_F(BadModelsTest, AnUnknownJointType) {
  ExpectModel(Changed("type=\"spherical\"", "type=\"sperical\""), ":6:24",
              "unknown joint type 'sperical'", "did you mean 'spherical'?");
}

TEST_F(BadModelsTest, TextInANumber) {
  ExpectModel(Changed("<mass value=\"1.0\"", "<mass value=\"heavy\""), ":14:13",
              "'heavy' in <mass value=\"heavy\"> is not a finite number",
              "digits");
}

TEST_F(BadModelsTest, NothingThatMoves) {
  ExpectModel("<robot name='r'><link name='a'/></robot>", "", "no moving joint",
              "joints are revolute");
}

}  // namespace
}  // namespace sysid
