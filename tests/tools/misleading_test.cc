// Issue 19: findings that misled. Recordings that are right, or that were read
// wrong, and what sysid_check and sysid_fit must not say of them.

#include <nlohmann/json.hpp>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using Json = nlohmann::json;

// Asks both programs; their findings by their JSON.
struct Said {
  ProgramResult check, fit;
  Json of_check, of_fit;
};

Said Ask(const ProgramFolder& folder, const Arguments& flags) {
  Said said;
  said.check =
      folder.Run(SYSID_CHECK, flags + Arguments{"--json", "check.json"});
  said.fit = folder.Run(SYSID_FIT, flags + Arguments{"--json", "fit.json"});
  said.of_check = Json::parse(folder.Read("check.json"))["findings"];
  said.of_fit = Json::parse(folder.Read("fit.json"))["findings"];
  return said;
}

// A rod that a spring turns to and fro by 23 rad, at 46 rad in 0.75 s.
constexpr char kWheel[] = R"(<robot name="wheel"><link name="base"/>
<joint name="joint1" type="TYPE"><parent link="base"/><child link="link1"/>
<axis xyz="0 1 0"/></joint>
<link name="link1"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.001"/>
</inertial></link></robot>)";

void WriteWheel(const ProgramFolder& folder, const std::string& type) {
  std::string urdf = kWheel;
  folder.Write(type + ".urdf", urdf.replace(urdf.find("TYPE"), 4, type));
}

TEST(MisleadingTest, AContinuousJointThatSpinsTo23RadIsNotInDegrees) {
  const ProgramFolder folder;
  WriteWheel(folder, "continuous");
  folder.Write("start.csv", "t,joint1.q\n0,23\n0.1,23\n");
  SimulateInto(folder, "spin.csv",
               {"--model", "continuous.urdf", "--add", "spring@joint1=1.2",
                "--initial", "start.csv", "--duration", "4"});
  const Arguments flags = {"--traj", "spin.csv",
                           "--add",  "spring@joint1",
                           "--free", "link1.mass,joint1.stiffness",
                           "--model"};
  const Said said = Ask(folder, flags + Arguments{"continuous.urdf"});
  EXPECT_EQ(said.check.exit_code, 0) << said.check.out;
  EXPECT_EQ(said.of_check, Json::array());
  EXPECT_EQ(said.fit.exit_code, 0) << said.fit.err;
  EXPECT_EQ(said.of_fit, Json::array());
  // The recording is one that is degrees where a joint has a reason to stay.
  WriteWheel(folder, "revolute");
  const ProgramResult revolute =
      folder.Run(SYSID_CHECK, flags + Arguments{"revolute.urdf"});
  EXPECT_THAT(revolute.out, HasSubstr("1. degrees  spin.csv"));
}

// A drive of 50 kg whose friction the model lacks: with the inertia of a cube
// of 0.2 m, and with a placeholder, which a slide never shows.
TEST(MisleadingTest, ADriveOf50KgIsNotAdvisedAThousandthOfItsMass) {
  const ProgramFolder folder;
  for (const std::string inertia : {"0.333", "0.01"}) {
    SCOPED_TRACE(inertia);
    folder.Write("drive.urdf", R"(<robot name="drive"><link name="base"/>
<joint name="joint1" type="prismatic"><parent link="base"/>
<child link="link1"/><axis xyz="1 0 0"/>
<limit lower="-2" upper="2" effort="500" velocity="2"/></joint>
<link name="link1"><inertial><mass value="50"/>
<inertia ixy="0" ixz="0" iyz="0" ixx=")" +
                                   inertia + R"(" iyy=")" + inertia +
                                   R"(" izz=")" + inertia + R"("/>
</inertial></link></robot>)");
    SimulateInto(
        folder, "run.csv",
        {"--model", "drive.urdf", "--add",
         "coulomb_friction@joint1=20,viscous_damping@joint1=200", "--excite",
         "multisine", "--duration", "8", "--noise", "1e-4"});
    for (const std::string free : {"link1.mass", "joint1.damping"}) {
      SCOPED_TRACE(free);
      Arguments flags = {"--model", "drive.urdf", "--traj",
                         "run.csv", "--free",     free};
      if (free == "joint1.damping") {
        flags = flags + Arguments{"--add", "viscous_damping@joint1"};
      }
      const Said said = Ask(folder, flags);
      EXPECT_EQ(said.of_check, Json::array());
      EXPECT_EQ(said.of_fit, Json::array());
      // What was not asked is named there, by the fault: mass_in_grams.
      EXPECT_THAT(said.fit.err, Not(HasSubstr("link1.mass=0.05")));
    }
  }
}

// A joint whose columns nobody mapped is said first, with their names, and no
// column of the other joint is blamed for it.
TEST(MisleadingTest, AJointThatWasNotMappedIsSaidFirstAndNoOtherIsBlamed) {
  const ProgramFolder folder;
  SimulateInto(folder, "run.csv",
               {"--model", "pendulum2_planar", "--excite", "multisine",
                "--seed", "3", "--duration", "5", "--noise", "1e-3"});
  for (const std::string joint : {"joint1", "joint2"}) {
    SCOPED_TRACE(joint);
    std::string text = folder.Read("run.csv");
    text.replace(text.find(joint + ".q"), joint.size() + 2, "pos1");
    text.replace(text.find(joint + ".tau"), joint.size() + 4, "cur1");
    folder.Write("foreign.csv", text);
    const Said said =
        Ask(folder, {"--model", "pendulum2_planar", "--traj", "foreign.csv"});
    const std::string first =
        "note: foreign.csv: no column is read as the position of " + joint +
        " or the effort of " + joint +
        "; ignored the columns pos1, cur1: --columns " + joint +
        ".q=COLUMN maps one\n";
    EXPECT_THAT(said.check.err, StartsWith(first));
    EXPECT_THAT(said.fit.err, StartsWith(first));
    // That alone is said, and nothing of the other joint's good columns.
    const std::string flag =
        "--columns " + joint + ".q=pos1," + joint + ".tau=cur1";
    for (const Json& findings : {said.of_check, said.of_fit}) {
      ASSERT_EQ(findings.size(), 1u) << findings;
      EXPECT_EQ(findings[0]["fault"], "unmapped_columns");
      EXPECT_EQ(findings[0]["subject"], joint + ".q, " + joint + ".tau");
      EXPECT_EQ(findings[0]["remedies"], Json::array({flag}));
    }
    EXPECT_EQ(said.check.exit_code, 1);
    EXPECT_THAT(said.check.out, Not(HasSubstr("without joint")));
    const ProgramResult mapped = folder.Run(
        SYSID_CHECK, {"--model", "pendulum2_planar", "--traj", "foreign.csv",
                      "--columns", joint + ".q=pos1," + joint + ".tau=cur1"});
    EXPECT_EQ(mapped.out, "pendulum2_planar: nothing wrong with 1 run\n");
  }
}

// A URDF's <limit lower upper> means nothing to a continuous joint: one that
// spins beyond them is read as it is.
TEST(MisleadingTest, AContinuousJointHasNoLimits) {
  const ProgramFolder folder;
  folder.Write("wheel.urdf", R"(<robot name="wheel"><link name="base"/>
<joint name="joint1" type="continuous"><parent link="base"/>
<child link="link1"/><axis xyz="0 1 0"/>
<limit lower="-3.14" upper="3.14" effort="9" velocity="9"/></joint>
<link name="link1"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.001"/>
</inertial></link></robot>)");
  folder.Write("start.csv", "t,joint1.q\n0,23\n0.1,23\n");
  SimulateInto(folder, "spin.csv",
               {"--model", "wheel.urdf", "--add", "spring@joint1=1.2",
                "--initial", "start.csv", "--duration", "4"});
  const ProgramResult fit = folder.Run(
      SYSID_FIT, {"--model", "wheel.urdf", "--traj", "spin.csv", "--add",
                  "spring@joint1", "--free", "link1.mass,joint1.stiffness"});
  EXPECT_EQ(fit.exit_code, 0) << fit.err;
}

}  // namespace
}  // namespace sysid
