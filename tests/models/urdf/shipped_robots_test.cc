#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "models/dynamics.h"
#include "models/error.h"
#include "models/find_model.h"
#include "models/physical.h"
#include "models/urdf/load_urdf.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(ShippedRobots, AreTheseAndNoOthers) {
  EXPECT_THAT(ShippedModels(),
              ElementsAre("arm7", "cartpole", "double_pendulum_dfki", "emps",
                          "pendulum1", "pendulum2", "pendulum2_planar",
                          "pendulum3", "pendulum3_planar", "rod_and_bob",
                          "simple_pendulum_dfki", "video_pendulum"));
}

TEST(ShippedRobots, AreSoundAndCanMove) {
  for (const std::string& name : ShippedModels()) {
    SCOPED_TRACE(name);
    const Mechanism mechanism = LoadUrdf(FindModel(name));
    EXPECT_EQ(mechanism.name, name);
    EXPECT_THAT(PhysicalFaults(mechanism, mechanism.nominal), IsEmpty());
    EXPECT_THAT(SingularJoints(MakeModel(mechanism, Catalogue())), IsEmpty());
  }
}

TEST(ShippedRobots, HaveTheirNames) {
  const Mechanism pendulum = LoadUrdf(FindModel("pendulum3"));
  EXPECT_THAT(pendulum.JointNames(), ElementsAre("joint1", "joint2", "joint3"));
  EXPECT_THAT(pendulum.LinkNames(),
              ElementsAre("base", "link1", "link2", "link3", "tip"));
  EXPECT_EQ(pendulum.nq, 12);
  EXPECT_EQ(LoadUrdf(FindModel("pendulum3_planar")).nq, 3);
  const Mechanism cartpole = LoadUrdf(FindModel("cartpole"));
  EXPECT_THAT(cartpole.JointNames(), ElementsAre("slider", "hinge"));
  EXPECT_THAT(cartpole.LinkNames(), ElementsAre("base", "cart", "pole", "tip"));
  EXPECT_EQ(LoadUrdf(FindModel("arm7")).JointNames().size(), 7u);
}

TEST(ShippedRobots, PendulumsHangStraightDownWithTheirLengths) {
  for (const std::string name : {"pendulum1", "pendulum2", "pendulum3",
                                 "pendulum2_planar", "pendulum3_planar"}) {
    SCOPED_TRACE(name);
    const Mechanism mechanism = LoadUrdf(FindModel(name));
    const int links = static_cast<int>(mechanism.JointNames().size());
    for (int i = 1; i <= links; ++i) {
      EXPECT_EQ(LinkLength(mechanism, mechanism.nominal, i), 0.5);
      EXPECT_EQ(LinkAxis(mechanism, i), -Eigen::Vector3d::UnitZ());
    }
    const Model model(mechanism);
    Workspace<double> ws(model);
    const Eigen::VectorXd q = mechanism.NeutralConfiguration();
    ForwardKinematics(&ws, q.data());
    EXPECT_EQ(LinkPosition(ws, mechanism.FindLink("tip")),
              Eigen::Vector3d(0, 0, -0.5 * links));
  }
}

// The specifications name joints and links that the robots have.
TEST(ShippedRobots, HaveSpecificationsThatFitThem) {
  const std::set<std::string> keys = {"model", "free", "effects", "columns"};
  for (const std::string& name : ShippedModels()) {
    SCOPED_TRACE(name);
    const std::filesystem::path urdf = FindModel(name);
    const Mechanism mechanism = LoadUrdf(urdf);
    const YAML::Node spec =
        YAML::LoadFile((urdf.parent_path() / (name + ".sysid.yaml")).string());
    EXPECT_EQ(spec["model"].as<std::string>(), name + ".urdf");
    for (const auto& entry : spec) {
      EXPECT_TRUE(keys.count(entry.first.as<std::string>()))
          << entry.first.as<std::string>();
    }
    for (const auto& entry : spec["free"]) {
      const std::string parameter = entry.first.as<std::string>();
      const std::string link = parameter.substr(0, parameter.rfind('.'));
      EXPECT_GT(mechanism.FindLink(link), 0) << parameter;
    }
    for (const auto& effect : spec["effects"]) {
      EXPECT_TRUE(Catalogue().Make(effect.as<std::string>(), mechanism, ""));
    }
  }
}

TEST(FindModel, TakesFilesAsTheyAre) {
  EXPECT_EQ(FindModel("some/where"), "some/where");
  EXPECT_EQ(FindModel("robot.urdf"), "robot.urdf");
}

TEST(FindModel, PrefersTheFolderOfTheEnvironment) {
  const std::filesystem::path data =
      std::filesystem::path(testing::TempDir()) / "sysid_find_model";
  std::filesystem::create_directories(data / "robots");
  std::ofstream(data / "robots" / "pendulum1.urdf") << "<robot/>";
  setenv("SYSID_DATA_DIR", data.c_str(), 1);
  EXPECT_EQ(FindModel("pendulum1"), (data / "robots/pendulum1.urdf").string());
  EXPECT_NE(FindModel("pendulum2"), "");
  unsetenv("SYSID_DATA_DIR");
  std::filesystem::remove_all(data);
}

TEST(FindModel, NamesTheNearestModel) {
  try {
    FindModel("pendlum2");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "--model: no shipped model is named 'pendlum2'\n  hint: did "
                 "you mean 'pendulum2'?");
  }
  try {
    FindModel("");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                testing::HasSubstr("--model: no model is named\n  hint: a URDF "
                                   "file, or one of: arm7, cartpole"));
  }
}

}  // namespace
}  // namespace sysid
