// That identified.urdf and the specification beside it keep every effect: those
// that a URDF can say, those that it cannot, and corrected nominal values.

#include <nlohmann/json.hpp>
#include <ostream>

#include "tests/support/test_name.h"
#include "tests/tools/programs.h"

namespace sysid {
namespace {

using Json = nlohmann::json;

struct Planted {
  std::string model, add, set;  // as sysid_simulate plants it
  std::string effect;           // as it is fitted
  Arguments more;
  int parameters;  // of the fit
};

void PrintTo(const Planted& planted, std::ostream* out) {
  *out << planted.effect << " in " << planted.model;
}

class EffectFilesTest : public ::testing::Test,
                        public ::testing::WithParamInterface<Planted> {
 protected:
  ProgramFolder folder_;
};

TEST_P(EffectFilesTest, AFitFromTheIdentifiedModelReproducesIt) {
  const Planted& planted = GetParam();
  folder_.Write("rods.urdf", kRods);
  std::string damped = kRods;
  damped.replace(damped.find("<axis"), 0, "<dynamics friction=\"0.02\"/>");
  folder_.Write("damped.urdf", damped);
  Arguments simulate{"--model",    planted.model, "--tilt",   "1",
                     "--duration", "4",           "--excite", "multisine",
                     "--add",      planted.add};
  if (!planted.set.empty()) {
    simulate = simulate + Arguments{"--set", planted.set};
  }
  SimulateInto(folder_, "run.csv", simulate);
  const ProgramResult result = folder_.Run(
      SYSID_FIT, Arguments{"--model", planted.model, "--traj", "run.csv",
                           "--add", planted.effect, "--out", "result"} +
                     planted.more);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const Json first = Json::parse(folder_.Read("result/fit.json"));
  EXPECT_THAT(first["effects"], testing::Contains(planted.effect));
  const ProgramResult again =
      folder_.Run(SYSID_FIT, {"--model", "result/identified.urdf", "--traj",
                              "run.csv", "--json", "again.json"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const Json second = Json::parse(folder_.Read("again.json"));
  EXPECT_EQ(second["effects"], first["effects"]);
  ASSERT_EQ(static_cast<int>(first["parameters"].size()), planted.parameters);
  ASSERT_EQ(second["parameters"].size(), first["parameters"].size());
  for (size_t i = 0; i < first["parameters"].size(); ++i) {
    const Json& a = first["parameters"][i];
    const Json& b = second["parameters"][i];
    SCOPED_TRACE(a.dump() + b.dump());
    EXPECT_EQ(a["name"], b["name"]);
    if (!a["std_error"].is_number()) continue;
    const bool scale = a["name"] == "link2.inertia_scale";
    const double value = scale ? 1.0 : a["value"].get<double>();
    EXPECT_NEAR(b["initial"], value, 1e-12);
    EXPECT_NEAR(b["value"], value, 0.1 * b["std_error"].get<double>());
  }
  EXPECT_NEAR(second["error"]["train"]["normalized_rms"],
              first["error"]["train"]["normalized_rms"], 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Catalogue, EffectFilesTest,
    ::testing::Values(
        Planted{"rods.urdf",
                "stribeck_friction@joint1=0.05",
                "joint1.static_friction=0.2,joint1.stribeck_velocity=0.4",
                "stribeck_friction@joint1",
                {"--free", "joint1.stribeck_velocity=0.3"},
                3},
        // In the place of the URDF's Coulomb friction.
        Planted{"damped.urdf",
                "stribeck_friction@joint1=0.05",
                "joint1.static_friction=0.2,joint1.stribeck_velocity=0.4",
                "stribeck_friction@joint1",
                {"--fix", "joint1.stribeck_velocity=0.4"},
                2},
        Planted{"rods.urdf",
                "quadratic_drag@joint1=0.1",
                "",
                "quadratic_drag@joint1",
                {},
                1},
        Planted{"rods.urdf",
                "spring@joint1=1",
                "joint1.spring_reference=0.2",
                "spring@joint1",
                {},
                2},
        Planted{
            "rods.urdf", "armature@joint2=0.05", "", "armature@joint2", {}, 1},
        Planted{"rods.urdf",
                "effort_gain@joint1=0.2",
                "",
                "effort_gain@joint1",
                {},
                1},
        Planted{"rods.urdf",
                "effort_delay@base=0.014",
                "",
                "effort_delay@base",
                {},
                1},
        Planted{"rods.urdf",
                "cogging@joint1=0.5",
                "joint1.cogging_order=5",
                "cogging@joint1",
                {"--fix", "joint1.cogging_order=5"},
                2},
        Planted{"rods.urdf",
                "gravity_tilt@base=0",
                "gravity_tilt_y=0.05",
                "gravity_tilt@base",
                {"--fix", "gravity_tilt_x"},
                1},
        Planted{"rods.urdf",
                "aerodynamic_drag@link2=0.1",
                "",
                "aerodynamic_drag@link2",
                {},
                1},
        Planted{"rods.urdf", "mass@link2=1.3", "", "mass@link2", {}, 1},
        // com_y, along the axes, is held.
        Planted{"rods.urdf", "com@link2=0.05", "", "com@link2", {}, 2},
        Planted{"rods.urdf", "inertia@link2=1.5", "", "inertia@link2", {}, 1}),
    [](const auto& info) {
      return TestName(info.param.model + info.param.effect);
    });

// Columns are inputs by their own names where a law reads them.
TEST(TypedLaws, ReadColumnsByTheirNames) {
  const ProgramFolder folder;
  std::string wind = "t,wind\n";
  for (int k = 0; k <= 40; ++k) {
    wind += std::to_string(0.1 * k) + "," + std::to_string(std::sin(0.5 * k)) +
            "\n";
  }
  folder.Write("wind.csv", wind);
  SimulateInto(folder, "run.csv",
               {"--model", "cartpole", "--duration", "4", "--inputs",
                "wind.csv", "--add", "custom@hinge: k*wind=0.3"});
  const ProgramResult fit =
      folder.Run(SYSID_FIT, {"--model", "cartpole", "--traj", "run.csv",
                             "--add", "custom@hinge: k*wind", "--json", "-"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  for (const Json& p : Json::parse(fit.out)["parameters"]) {
    EXPECT_NE(p["name"], "hinge.wind");
    if (p["name"] == "hinge.k") {
      EXPECT_NEAR(p["value"].get<double>(), 0.3, 0.03);
    }
  }
  const ProgramResult empty = folder.Run(
      SYSID_FIT,
      {"--model", "cartpole", "--traj", "run.csv", "--add", "custom@hinge: "});
  EXPECT_EQ(empty.exit_code, 2);
  EXPECT_THAT(empty.err, testing::HasSubstr("has no law"));
}

TEST(TypedLaws, WithoutAValueOnTheDataAreRefusedByEveryProgram) {
  const ProgramFolder folder;
  SimulateInto(folder, "run.csv", {"--model", "cartpole", "--duration", "4"});
  const std::string law = "custom@hinge: -k*log(qd)";
  const Arguments data{"--model", "cartpole", "--traj", "run.csv"};
  for (const auto& [program, flag] :
       {std::pair{SYSID_FIT, "--add"}, std::pair{SYSID_CHECK, "--add"},
        std::pair{SYSID_DIAGNOSE, "--candidates"}}) {
    const ProgramResult result =
        folder.Run(program, data + Arguments{flag, law});
    EXPECT_EQ(result.exit_code, 2) << program;
    EXPECT_THAT(
        result.err,
        testing::AllOf(testing::HasSubstr(std::string(flag) + ": " + law +
                                          " has no value from "),
                       testing::HasSubstr(" s of run.csv, where hinge.q is"),
                       testing::HasSubstr("hint: ")));
  }
}

}  // namespace
}  // namespace sysid
