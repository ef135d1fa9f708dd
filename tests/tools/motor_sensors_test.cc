// Two sensors of one joint, at the motor and behind the spring: columns
// J.motor_q and J.q.

#include <map>
#include <nlohmann/json.hpp>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::Contains;
using Json = nlohmann::json;

constexpr char kElastic[] =
    "joint_elasticity@joint1=80,sensor_offset@joint1.motor=0.05";

class MotorSensorsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ProgramFolder;
    folder_->Write("rods.urdf", kRods);
    for (const std::string seed : {"1", "2"}) {
      SimulateInto(*folder_, seed + ".csv",
                   {"--model", "rods.urdf", "--excite", "multisine", "--band",
                    "0.2,6", "--duration", "4", "--seed", seed, "--noise",
                    "1e-4", "--motor_sensors", "--add", kElastic, "--set",
                    "joint1.motor_inertia=0.02,joint1.drive_damping=0.5"});
    }
    SimulateInto(*folder_, "plain.csv",
                 {"--model", "rods.urdf", "--duration", "2"});
  }
  static void TearDownTestSuite() { delete folder_; }
  static Json Fit(const Arguments& more) {
    const ProgramResult result = folder_->Run(
        SYSID_FIT, Arguments{"--model", "rods.urdf", "--traj", "1.csv",
                             "--holdout", "2.csv", "--json", "-"} +
                       more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out);
  }
  static ProgramFolder* folder_;
};

ProgramFolder* MotorSensorsTest::folder_ = nullptr;

TEST_F(MotorSensorsTest, TellTheSpringAndTheirOwnOffsetApart) {
  const Json fit =
      Fit({"--add", "joint_elasticity@joint1,sensor_offset@joint1.motor"});
  EXPECT_LT(fit["error"]["train"]["normalized_rms"], 1.1);
  EXPECT_LT(fit["error"]["holdout"]["normalized_rms"], 1.1);
  const std::map<std::string, double> truth = {
      {"joint1.drive_stiffness", 80.0},
      {"joint1.drive_damping", 0.5},
      {"joint1.motor_inertia", 0.02},
      {"joint1.motor.sensor_offset", 0.05}};
  size_t found = 0;
  for (const Json& p : fit["parameters"]) {
    const auto at = truth.find(p["name"]);
    if (at == truth.end()) continue;
    ++found;
    const double std_error = p["std_error"];
    EXPECT_NEAR(p["value"], at->second, 4.0 * std_error);
    EXPECT_LT(std_error, 0.01 * at->second);
  }
  EXPECT_EQ(found, truth.size());
  std::vector<std::string> channels;
  for (const Json& channel : fit["error"]["channels"]) {
    channels.push_back(channel["name"]);
  }
  EXPECT_THAT(channels, Contains("joint1.motor_q"));
}

// Trajectories show them one by one; the equations of motion of the joints know
// nothing of the motor behind the spring.
TEST_F(MotorSensorsTest, ArePrintedOneByOneWithWhatTheyTell) {
  const ProgramResult result = folder_->Run(
      SYSID_FIT,
      {"--model", "rods.urdf", "--traj", "1.csv", "--add",
       "joint_elasticity@joint1,viscous_damping@joint1", "--json", "fit.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* name : {"joint1.drive_stiffness", "joint1.drive_damping",
                           "joint1.motor_inertia", "joint1.damping"}) {
    EXPECT_THAT(result.out, ::testing::HasSubstr(name));
  }
  EXPECT_FALSE(
      Json::parse(folder_->Read("fit.json")).contains("base_parameters"));
}

// With a rigid drive the motor's column says where the joint is.
TEST_F(MotorSensorsTest, StandForAJointWithoutASensorOfItsOwn) {
  std::string text = folder_->Read("1.csv");
  const size_t own = text.find("joint2.q");
  ASSERT_NE(own, std::string::npos);
  text.replace(own, 8, "not_read");
  folder_->Write("motor_only.csv", text);
  const ProgramResult result = folder_->Run(
      SYSID_FIT,
      {"--model", "rods.urdf", "--traj", "motor_only.csv", "--add",
       "joint_elasticity@joint1,sensor_offset@joint1.motor", "--json", "-"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_LT(Json::parse(result.out)["error"]["train"]["normalized_rms"], 1.1);
}

// Which must be named where a joint has one sensor only.
TEST_F(MotorSensorsTest, ShowTheSpringBetweenThemWithoutAHint) {
  const ProgramResult result = folder_->Run(
      SYSID_DIAGNOSE,
      {"--model", "rods.urdf", "--traj", "1.csv", "--holdout", "2.csv", "--add",
       "sensor_offset@joint1.motor", "--json", "-"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json first = Json::parse(result.out)["candidates"][0];
  EXPECT_EQ(first["effect"], "joint_elasticity") << result.out;
  EXPECT_EQ(first["target"], "joint1");
}

TEST_F(MotorSensorsTest, AreAskedForTheirOffsetInADiagnosis) {
  const ProgramResult result = folder_->Run(
      SYSID_DIAGNOSE, {"--model", "rods.urdf", "--traj", "1.csv", "--holdout",
                       "2.csv", "--add", "joint_elasticity@joint1",
                       "--candidates", "sensor_offset", "--json", "-"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json first = Json::parse(result.out)["candidates"][0];
  EXPECT_EQ(first["effect"], "sensor_offset");
  EXPECT_EQ(first["target"], "joint1.motor");
}

TEST_F(MotorSensorsTest, RefuseEffectsOfColumnsThatAreNotThere) {
  ExpectRefused(*folder_, SYSID_FIT,
                {"--model", "rods.urdf", "--traj", "plain.csv", "--add",
                 "sensor_offset@joint1.motor"},
                "--add", "is of the column joint1.motor_q, which no run has",
                "--columns joint1.motor_q=COLUMN");
  ExpectRefused(*folder_, SYSID_FIT,
                {"--model", "rods.urdf", "--traj", "plain.csv", "--add",
                 "sensor_offset@jiont1.motor"},
                "--add", "unknown target 'jiont1.motor'", "joint1.motor");
  ExpectRefused(*folder_, SYSID_FIT,
                {"--model", "rods.urdf", "--traj", "plain.csv", "--add",
                 "viscous_damping@joint1.motor"},
                "--add", "unknown target 'joint1.motor'", "joint1");
}

}  // namespace
}  // namespace sysid
