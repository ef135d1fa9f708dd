// The files that sysid_fit writes: docs/interface.md sections 1 and 6.

#include <cmath>
#include <nlohmann/json.hpp>

#include "sysid/io/csv.h"
#include "tests/sysid/io/read_columns.h"
#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

bool IsNumberOrNull(const Json& json) {
  return json.is_number() || json.is_null();
}

bool IsSummary(const Json& json) {
  return IsNumberOrNull(json.at("rms")) &&
         IsNumberOrNull(json.at("normalized_rms"));
}

void ExpectParameter(const Json& p) {
  EXPECT_TRUE(p.at("name").is_string());
  EXPECT_TRUE(p.at("unit").is_string());
  for (const char* key : {"initial", "value", "std_error", "lower", "upper"}) {
    EXPECT_TRUE(IsNumberOrNull(p.at(key))) << key;
  }
  EXPECT_TRUE(p.at("at_bound").is_boolean());
  EXPECT_TRUE(p.at("identifiable").is_boolean());
  if (!p.at("ci95").is_null()) {
    ASSERT_EQ(p.at("ci95").size(), 2u);
    EXPECT_LT(p["ci95"][0], p["value"]);
    EXPECT_LT(p["value"], p["ci95"][1]);
  }
}

void ExpectError(const Json& error) {
  EXPECT_TRUE(IsSummary(error.at("train")));
  EXPECT_TRUE(error.at("holdout").is_null() || IsSummary(error["holdout"]));
  ASSERT_FALSE(error.at("channels").empty());
  for (const Json& channel : error["channels"]) {
    EXPECT_TRUE(channel.at("name").is_string());
    EXPECT_TRUE(IsSummary(channel));
  }
  ASSERT_FALSE(error.at("horizon").empty());
  for (const Json& horizon : error["horizon"]) {
    EXPECT_TRUE(horizon.at("horizon_s").is_number());
    EXPECT_TRUE(IsNumberOrNull(horizon.at("rms")));
    ASSERT_FALSE(horizon.at("channels").empty());
    EXPECT_TRUE(horizon["channels"][0].at("name").is_string());
    EXPECT_TRUE(IsNumberOrNull(horizon["channels"][0].at("rms")));
  }
  ASSERT_FALSE(error.at("open").empty());
  for (const Json& run : error["open"]) {
    EXPECT_TRUE(run.at("trajectory").is_string());
    EXPECT_TRUE(run.at("duration_s").is_number());
    for (const Json& channel : run.at("channels")) {
      EXPECT_TRUE(channel.at("name").is_string());
      EXPECT_TRUE(channel.at("unit").is_string());
      EXPECT_TRUE(IsNumberOrNull(channel.at("rms")));
    }
  }
}

// Every key of docs/interface.md section 6, by its type.
void ExpectFitJson(const Json& json) {
  EXPECT_EQ(json.at("schema"), "sysid.fit/1");
  for (const char* key : {"model", "solver", "termination", "integrator"}) {
    EXPECT_TRUE(json.at(key).is_string()) << key;
  }
  EXPECT_TRUE(json.at("converged").is_boolean());
  EXPECT_TRUE(json.at("iterations").is_number_integer());
  EXPECT_TRUE(json.at("samples").is_number_integer());
  EXPECT_TRUE(json.at("wall_time_s").is_number());
  for (const char* key : {"step_s", "segment_s", "noise"}) {
    EXPECT_TRUE(IsNumberOrNull(json.at(key))) << key;
  }
  for (const Json& parameter : json.at("parameters")) {
    ExpectParameter(parameter);
  }
  EXPECT_TRUE(json.at("not_identifiable").is_array());
  EXPECT_TRUE(json.at("effects").is_array());
  ExpectError(json.at("error"));
  EXPECT_TRUE(json.at("history").is_array());
  for (const Json& entry : json["history"]) {
    EXPECT_TRUE(entry.at("iteration").is_number_integer());
    EXPECT_TRUE(IsNumberOrNull(entry.at("cost")));
    EXPECT_TRUE(entry.at("time_s").is_number());
  }
}

class FitFilesTest : public ::testing::Test {
 protected:
  Json Fit(const Arguments& arguments) {
    const ProgramResult result =
        folder_.Run(SYSID_FIT, arguments + Arguments{"--out", "result"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(folder_.Read("result/fit.json"));
  }

  ProgramFolder folder_;
};

TEST_F(FitFilesTest, JsonOnStandardOutputIsAllThatIsThere) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "2"});
  for (const std::string name : {"-", "/dev/stdout"}) {
    const ProgramResult result = folder_.Run(
        SYSID_FIT,
        {"--model", "pendulum2_planar", "--traj", "run.csv", "--json", name});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    const Json json = Json::parse(result.out);
    ExpectFitJson(json);
    EXPECT_EQ(json["model"], "pendulum2_planar");
    EXPECT_EQ(json["solver"], "lm");
    EXPECT_EQ(json["samples"], 201);
    EXPECT_EQ(json["integrator"], "rk4");
    EXPECT_FALSE(json["history"].empty());
  }
}

TEST_F(FitFilesTest, JsonOfAFitThatFails) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "2"});
  const ProgramResult result = folder_.Run(
      SYSID_FIT, {"--model", "pendulum2_planar", "--traj", "run.csv", "--free",
                  "link1.izz", "--json", "-", "--out", "result"});
  EXPECT_EQ(result.exit_code, 1);
  const Json json = Json::parse(result.out);
  ExpectFitJson(json);
  EXPECT_EQ(json["converged"], false);
  EXPECT_EQ(folder_.Read("result/fit.json"), result.out);
}

TEST_F(FitFilesTest, TheFolderHoldsEverything) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum1", "--duration", "2"});
  folder_.Write("result.txt", "kept");
  Fit({"--model", "pendulum1", "--traj", "run.csv"});
  const auto contents = folder_.Contents();
  std::vector<std::string> names;
  for (const auto& [name, text] : contents) {
    if (name.rfind("result/", 0) == 0 && name != "result/") {
      names.push_back(name.substr(7));
    }
  }
  std::vector<std::string> expected{"fit.json",        "prediction.csv",
                                    "identified.urdf", "identified.sysid.yaml",
                                    "identified.xml",  "identified.sdf",
                                    "export.json"};
  if (NoReportNote().empty()) expected.push_back("report.html");
  // Nothing temporary is left.
  EXPECT_THAT(names, testing::UnorderedElementsAreArray(expected));
  ExpectReport(folder_, "result/report.html", "sysid_fit");
}

TEST_F(FitFilesTest, PredictionsFollowEachOtherInTime) {
  for (const std::string seed : {"1", "2", "3"}) {
    SimulateInto(folder_, seed + ".csv",
                 {"--model", "cartpole", "--duration", "1", "--seed", seed});
  }
  Fit({"--model", "cartpole", "--traj", "1.csv,2.csv", "--holdout", "3.csv"});
  CsvFile file(folder_.Path("result/prediction.csv"));
  const std::vector<std::string>& header = file.header();
  std::vector<int> all;
  for (size_t i = 0; i < header.size(); ++i) all.push_back(i);
  const Table table = ReadColumns(file, all);
  ASSERT_EQ(table.rows(), 3 * 101);
  ASSERT_GE(header.size(), 6u);
  EXPECT_EQ(header[0], "t");
  EXPECT_EQ(header[1], "run");
  EXPECT_EQ(header[2], "t_run");
  EXPECT_THAT(header[3], testing::EndsWith(".q.measured"));
  EXPECT_THAT(header[4], testing::EndsWith(".q.predicted"));
  EXPECT_THAT(header[5], testing::EndsWith(".q.residual"));
  for (int k = 0; k < table.rows(); ++k) {
    if (k > 0) {
      EXPECT_GT(table.columns[0][k], table.columns[0][k - 1]);
    }
    EXPECT_EQ(table.columns[1][k], k / 101);
    EXPECT_NEAR(table.columns[2][k], 0.01 * (k % 101), 1e-9);
    EXPECT_NEAR(table.columns[3][k] - table.columns[4][k], table.columns[5][k],
                1e-12);
    EXPECT_LT(std::abs(table.columns[5][k]), 0.02);
  }
}

constexpr char kTipped[] =
    "<robot name='tipped'><link name='base'/><link "
    "name='rod'><inertial><origin "
    "xyz='0 0 -0.5'/><mass value='1'/><inertia ixx='0.1' ixy='0' ixz='0' "
    "iyy='0.1' iyz='0' izz='0.01'/></inertial></link><joint name='joint1' "
    "type='continuous'><parent link='base'/><child link='rod'/><axis xyz='0 1 "
    "0'/></joint><link name='tip'/><joint name='end' type='fixed'><origin "
    "xyz='0 0 -0.9'/><parent link='rod'/><child link='tip'/></joint></robot>";

TEST_F(FitFilesTest, PredictionsOfRunsWithOtherAxes) {
  folder_.Write("3.csv",
                "t,tip.px,tip.py,tip.pz,joint1.q\n"
                "0,0.1,5,-0.9,0.11\n0.1,0.11,5.1,-0.91,0.1\n"
                "0.2,0.1,5,-0.9,0.09\n0.3,0.1,5,-0.9,0.05\n"
                "0.4,0.1,5,-0.9,0.02\n0.5,0.1,5,-0.9,0\n");
  folder_.Write("2.csv",
                "t,tip.px,tip.pz,joint1.q\n"
                "0,0.1,-0.9,0.11\n0.1,0.11,-0.91,0.1\n0.2,0.1,-0.92,0.09\n"
                "0.3,0.1,-0.93,0.05\n0.4,0.1,-0.94,0.02\n0.5,0.1,-0.95,0\n");
  folder_.Write("pendulum.urdf", kTipped);
  folder_.Run(SYSID_FIT, {"--model", "pendulum.urdf", "--traj", "2.csv,3.csv",
                          "--free", "none", "--check", "none", "--noise",
                          "0.01", "--out", "result"});
  CsvFile file(folder_.Path("result/prediction.csv"));
  const std::vector<std::string>& header = file.header();
  std::vector<int> all;
  for (size_t i = 0; i < header.size(); ++i) all.push_back(i);
  const Table table = ReadColumns(file, all);
  ASSERT_EQ(table.rows(), 12);
  const auto column = [&](const std::string& name) {
    return table.columns[std::find(header.begin(), header.end(), name) -
                         header.begin()];
  };
  EXPECT_TRUE(std::isnan(column("tip.py.measured")[2]));
  EXPECT_EQ(column("tip.pz.measured")[2], -0.92);
  EXPECT_EQ(column("tip.py.measured")[7], 5.1);
  EXPECT_EQ(column("tip.pz.measured")[7], -0.91);
  EXPECT_NEAR(column("tip.py.predicted")[7], 0.0, 1e-12);
}

// identified.urdf with the specification beside it is the fit's end, and a fit
// that starts there stays there.
TEST_F(FitFilesTest, AFitFromTheIdentifiedModelReproducesIt) {
  folder_.Write("rods.urdf", kRods);
  SimulateInto(folder_, "run.csv",
               {"--model", "rods.urdf", "--tilt", "1", "--duration", "6",
                "--set", "gravity=9.7,link1.inertia_scale=1.3", "--add",
                "viscous_damping@joint1=0.02,coulomb_friction@joint2=0.01,"
                "effort_bias@joint1=0.1,sensor_offset@joint2=0.02"});
  const Json first =
      Fit({"--model", "rods.urdf", "--traj", "run.csv", "--free",
           "gravity,link1.inertia_scale", "--add",
           "viscous_damping@joint1,coulomb_friction@joint2,effort_bias@joint1,"
           "sensor_offset@joint2"});
  const ProgramResult again =
      folder_.Run(SYSID_FIT, {"--model", "result/identified.urdf", "--traj",
                              "run.csv", "--json", "again.json"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  // Nobody asked for an integrator: that of the next fit is its own choice.
  EXPECT_EQ(folder_.Read("result/identified.sysid.yaml").find("integrator"),
            std::string::npos);
  const Json second = Json::parse(folder_.Read("again.json"));
  ASSERT_EQ(second["parameters"].size(), 6u);
  ASSERT_EQ(first["parameters"].size(), 6u);
  EXPECT_EQ(second["effects"], first["effects"]);
  for (size_t i = 0; i < 6; ++i) {
    const Json& a = first["parameters"][i];
    const Json& b = second["parameters"][i];
    SCOPED_TRACE(a.dump() + b.dump());
    EXPECT_EQ(a["name"], b["name"]);
    ASSERT_TRUE(a["std_error"].is_number());
    // A scale is of the inertia in the URDF, which is the fitted one.
    const bool scale = a["name"] == "link1.inertia_scale";
    const double start = scale ? 1.0 : a["value"].get<double>();
    const double sigma = b["std_error"];
    EXPECT_NEAR(b["initial"], start, 1e-12);
    EXPECT_NEAR(b["value"], start, 0.1 * sigma);
  }
  EXPECT_NEAR(second["error"]["train"]["normalized_rms"],
              first["error"]["train"]["normalized_rms"], 1e-3);
}

TEST_F(FitFilesTest, NamesMayHoldWhatYamlAndCsvUse) {
  std::string text = kRods;
  for (size_t at = 0; (at = text.find("joint1", at)) != std::string::npos;) {
    text.replace(at, 6, "it's: #1");
  }
  folder_.Write("a--b.urdf", text);
  SimulateInto(folder_, "run.csv", {"--model", "a--b.urdf", "--duration", "2"});
  Fit({"--model", "a--b.urdf", "--traj", "run.csv", "--free", "link1.length",
       "--add", "viscous_damping@it's: #1"});
  const Json again =
      Fit({"--model", "result/identified.urdf", "--traj", "run.csv"});
  EXPECT_EQ(again["parameters"][1]["name"], "it's: #1.damping");
}

// Bounds that come with a parameter are none of the user's: a body with bounds
// of its own is not kept possible as one.
TEST_F(FitFilesTest, TheIdentifiedSpecificationHasNoBoundsThatNobodyGave) {
  folder_.Write("rods.urdf", kRods);
  SimulateInto(folder_, "run.csv",
               {"--model", "rods.urdf", "--set", "link2.mass=0.6", "--excite",
                "multisine", "--rate", "200"});
  const Arguments fit{"--traj", "run.csv", "--solver", "inverse_dynamics"};
  Fit(fit + Arguments{"--model", "rods.urdf", "--free", "inertial"});
  const std::string kept = folder_.Read("result/identified.sysid.yaml");
  EXPECT_THAT(kept, HasSubstr("link2.mass: {initial: "));
  EXPECT_EQ(kept.find("lower"), std::string::npos) << kept;
  Fit(fit +
      Arguments{"--model", "result/identified.urdf", "--free", "inertial"});
}

TEST_F(FitFilesTest, TheIdentifiedSpecificationKeepsWhatWasAsked) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "2"});
  std::string text = folder_.Read("run.csv");
  text.replace(text.find("joint1.q"), 8, "it's a #1");
  folder_.Write("run.csv", text);
  folder_.Write("fit.yaml", R"(
free:
  link1.length: {initial: 0.4, lower: 0.1, upper: 1, prior: {mean: 0.5, std: 1}}
effects: [coulomb_friction@joint1]
fix: {joint1.friction: 0.0001}
columns: {joint1.q: "it's a #1"}
shift: joint2.q=0.001
ignore: joint1.q@0.5:0.6
noise: 0.001
segment: 1
residual: rotation
loss: {name: huber, scale: 2}
integrator: semi_implicit_euler
)");
  const Json first = Fit({"--model", "pendulum2_planar", "--traj", "run.csv",
                          "--spec", "fit.yaml"});
  const std::string kept = folder_.Read("result/identified.sysid.yaml");
  for (const std::string line :
       {"lower: 0.1, upper: 1, prior: {mean: 0.5, std: 1}",
        "joint1.friction: 1e-04", "shift: 'joint2.q=0.001'",
        "ignore: 'run.csv/joint1.q@0.5:0.6'", "noise: 0.001", "segment: 1",
        "residual: rotation", "loss: {name: huber, scale: 2}",
        "integrator: semi_implicit_euler"}) {
    EXPECT_THAT(kept, HasSubstr(line));
  }
  const Json second =
      Fit({"--model", "result/identified.urdf", "--traj", "run.csv"});
  const double sigma = second["parameters"][0]["std_error"];
  EXPECT_NEAR(second["parameters"][0]["value"], first["parameters"][0]["value"],
              0.1 * sigma);
}

// joint2 is held at 0.4; of a run of joint1 alone.
TEST_F(FitFilesTest, AHeldJointIsAJointAgainInTheIdentifiedModel) {
  std::string text = kRods;
  text.insert(text.find("<inertial>"),
              "<visual><geometry><mesh filename=\"rod.dae\"/></geometry>"
              "</visual>");
  folder_.Write("rods.urdf", text);
  SimulateInto(folder_, "run.csv",
               {"--model", "rods.urdf", "--lock", "joint2=0.4", "--set",
                "link1.inertia_scale=1.3", "--duration", "4"});
  EXPECT_THAT(folder_.Read("run.csv"), testing::Not(HasSubstr(",joint2")));
  const Json first = Fit({"--model", "rods.urdf", "--traj", "run.csv", "--free",
                          "link1.inertia_scale", "--lock", "joint[2-9]=0.4"});
  EXPECT_NEAR(first["parameters"][0]["value"], 1.3, 0.02);
  const std::string identified = folder_.Read("result/identified.urdf");
  EXPECT_THAT(identified, HasSubstr("<mesh filename=\"rod.dae\""));
  EXPECT_THAT(identified,
              HasSubstr("<joint name=\"joint2\" type=\"continuous\">"));
  EXPECT_THAT(folder_.Read("result/identified.sysid.yaml"),
              HasSubstr("lock:\n  joint2: 0.4\n"));
  const Json second =
      Fit({"--model", "result/identified.urdf", "--traj", "run.csv"});
  EXPECT_NEAR(second["parameters"][0]["value"], 1.0, 1e-3);
  // Without the lock one line says how to write it.
  const ProgramResult loose =
      folder_.Run(SYSID_FIT, {"--model", "rods.urdf", "--traj", "run.csv",
                              "--free", "link1.inertia_scale"});
  EXPECT_THAT(loose.err, HasSubstr("no column of joint2: its motion is "
                                   "estimated from the others; hold still by "
                                   "--lock 'joint2'"));
}

}  // namespace
}  // namespace sysid
