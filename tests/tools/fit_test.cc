// sysid_fit as its users run it: what it finds and how it says it.

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::UnorderedElementsAre;
using Json = nlohmann::json;

// The rows of a run of one joint, with a second one that goes from
// `begin` to `end`.
std::string Rows(const std::string& run, double begin, double end) {
  std::istringstream lines(run);
  std::vector<std::string> rows;
  std::string line;
  while (std::getline(lines, line)) {
    if (line[0] == '#' || line[0] == 't') continue;
    const size_t second = line.find(',', line.find(',') + 1);
    rows.push_back(line.substr(0, second));
  }
  std::string text;
  for (size_t i = 0; i < rows.size(); ++i) {
    const double share =
        static_cast<double>(i) / static_cast<double>(rows.size() - 1);
    text +=
        rows[i] + "," + std::to_string(begin + share * (end - begin)) + "\n";
  }
  return text;
}

class FitTest : public ::testing::Test {
 protected:
  // The result of a fit that must end with this exit code.
  Json Fit(const Arguments& arguments, int exit_code = 0) {
    result_ =
        folder_.Run(SYSID_FIT, arguments + Arguments{"--json", "fit.json"});
    EXPECT_EQ(result_.exit_code, exit_code) << result_.err;
    const Json json = Json::parse(folder_.Read("fit.json"));
    EXPECT_EQ(json["converged"], exit_code == 0);
    return json;
  }

  static Json Parameter(const Json& fit, const std::string& name) {
    for (const Json& parameter : fit["parameters"]) {
      if (parameter["name"] == name) return parameter;
    }
    ADD_FAILURE() << "no parameter " << name;
    return {};
  }

  // That the truth is within `sigmas` standard errors.
  static void ExpectNear(const Json& fit, const std::string& name, double truth,
                         double sigmas = 4) {
    const Json parameter = Parameter(fit, name);
    ASSERT_TRUE(parameter["std_error"].is_number()) << parameter;
    EXPECT_NEAR(parameter["value"], truth,
                sigmas * parameter["std_error"].get<double>())
        << parameter;
  }

  ProgramFolder folder_;
  ProgramResult result_;
};

TEST_F(FitTest, SaysNothingOfProgressAndNoColoursOffATerminal) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum1"});
  Fit({"--model", "pendulum1", "--traj", "run.csv"});
  EXPECT_EQ(result_.err, "");
  EXPECT_THAT(result_.out, HasSubstr("link1.length"));
  EXPECT_THAT(result_.out, HasSubstr("at the noise floor"));
  EXPECT_EQ(result_.out.find('\033'), std::string::npos);
  EXPECT_EQ(result_.out.find('\r'), std::string::npos);
}

TEST_F(FitTest, HelpFitsAScreenAndItsExampleWorks) {
  ExpectHelp(folder_, SYSID_FIT, "sysid_fit");
  EXPECT_TRUE(folder_.Has("result/fit.json"));
}

TEST_F(FitTest, NamesAParameterWithoutInfluence) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "2"});
  // The joints turn about y.
  const Json fit = Fit({"--model", "pendulum2_planar", "--traj", "run.csv",
                        "--free", "link1.izz"},
                       1);
  EXPECT_THAT(result_.err, HasSubstr("error: no usable result: parameter "
                                     "'link1.izz' without any influence"));
  EXPECT_THAT(fit["termination"].get<std::string>(), HasSubstr("'link1.izz'"));
  EXPECT_EQ(Parameter(fit, "link1.izz")["identifiable"], false);
  EXPECT_TRUE(Parameter(fit, "link1.izz")["std_error"].is_null());
}

TEST_F(FitTest, TellsAMassFromALengthThatShows) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum1", "--seed", "2"});
  const Json fit = Fit({"--model", "pendulum1", "--traj", "run.csv", "--free",
                        "link1.mass,link1.length"});
  EXPECT_THAT(result_.out,
              HasSubstr("link1.mass is not identifiable from this data"));
  EXPECT_EQ(fit["not_identifiable"], Json::parse(R"([["link1.mass"]])"));
  EXPECT_TRUE(Parameter(fit, "link1.mass")["std_error"].is_null());
  EXPECT_TRUE(Parameter(fit, "link1.mass")["ci95"].is_null());
  // A bob of another mass swings a little differently: its disc stays.
  EXPECT_NEAR(Parameter(fit, "link1.length")["value"], 0.5, 5e-4);
}

TEST_F(FitTest, NamesMassesThatCannotBeToldApart) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum3", "--seed", "4", "--tilt", "0.3"});
  const Json fit = Fit({"--model", "pendulum3", "--traj", "run.csv", "--free",
                        "gravity,link1.mass,link2.mass,link3.mass"});
  ASSERT_EQ(fit["not_identifiable"].size(), 1u);
  EXPECT_THAT(fit["not_identifiable"][0].get<std::vector<std::string>>(),
              UnorderedElementsAre("link1.mass", "link2.mass", "link3.mass"));
  EXPECT_THAT(result_.out,
              HasSubstr("link1.mass, link2.mass, link3.mass are not separately "
                        "identifiable from this data: fix one of them"));
  ExpectNear(fit, "gravity", 9.81);
}

TEST_F(FitTest, ComparesAModelAsItStands) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum1", "--seed", "3"});
  const Arguments compare{"--model", "pendulum1", "--traj", "run.csv",
                          "--free",  "none",      "--fix"};
  // The truth leaves noise; a wrong length does not. Nothing is fitted.
  const Json truth = Fit(compare + Arguments{"link1.length=0.5"});
  EXPECT_THAT(result_.out, HasSubstr("no free parameters: compared "
                                     "with 1 run"));
  EXPECT_THAT(result_.out, HasSubstr("this model has link1.length, "));
  EXPECT_EQ(truth["parameters"], Json::array());
  EXPECT_NEAR(truth["error"]["train"]["normalized_rms"], 1.0, 0.1);
  EXPECT_GT(truth["error"]["train"]["fit_percent"], 99.0);
  EXPECT_GT(truth["error"]["open"][0]["channels"][0]["fit_percent"], 99.0);
  const Json wrong = Fit(compare + Arguments{"link1.length=0.6"});
  EXPECT_GT(wrong["error"]["train"]["normalized_rms"], 3.0);
  EXPECT_LT(wrong["error"]["open"][0]["channels"][0]["fit_percent"], 50.0);
  // Whatever a specification frees, or none there is.
  EXPECT_EQ(Fit({"--model", "pendulum1", "--traj", "run.csv", "--fix",
                 "link1.length=0.5"})["parameters"],
            Json::array());
}

TEST_F(FitTest, HasSomethingToFitByOtherSolvers) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum1"});
  for (const std::string solver : {"adam", "gmm"}) {
    ExpectRefused(folder_, SYSID_FIT,
                  {"--model", "pendulum1", "--traj", "run.csv", "--free",
                   "none", "--solver", solver},
                  "--solver", solver + " has nothing to fit", "--solver lm");
  }
}

TEST_F(FitTest, ComparesTheEffortsOfAModelAsItStands) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--excite", "multisine",
                "--rate", "200", "--noise", "1e-5"});
  const Arguments compare{"--model",  "pendulum2_planar", "--traj",
                          "run.csv",  "--free",           "none",
                          "--solver", "inverse_dynamics"};
  const Json truth = Fit(compare);
  EXPECT_THAT(result_.out, HasSubstr("no free parameters: compared "
                                     "with 1 run"));
  EXPECT_THAT(result_.out,
              HasSubstr("inverse-dynamics residual, % of the rms effort"));
  EXPECT_EQ(truth["parameters"], Json::array());
  const Json wrong = Fit(compare + Arguments{"--fix", "link2.mass=2"});
  ASSERT_EQ(truth["error"]["effort"].size(), 2u);
  for (const int joint : {0, 1}) {
    EXPECT_LT(truth["error"]["effort"][joint]["percent"], 6.0);
    EXPECT_GT(wrong["error"]["effort"][joint]["percent"], 20.0);
  }
}

TEST_F(FitTest, SaysOfAFreeSwingThatOnlyRatiosAreIdentifiable) {
  folder_.Write("rods.urdf", kRods);
  SimulateInto(folder_, "run.csv",
               {"--model", "rods.urdf", "--rate", "200", "--noise", "1e-5"});
  Fit({"--model", "rods.urdf", "--traj", "run.csv", "--free", "inertial",
       "--solver", "inverse_dynamics"});
  EXPECT_THAT(result_.out, HasSubstr("\n  no efforts were measured (equations "
                                     "of motion up to "));
  EXPECT_THAT(result_.out,
              HasSubstr(" Hz): only ratios of inertias, frictions and other "
                        "forces are identifiable; all values and intervals "
                        "hold for the scale of the starting values, which is "
                        "held\n"));
}

// What an arm is judged by: efforts of every joint and positions ahead, of the
// fitted run and of others; and which combinations show, whatever the solver.
TEST_F(FitTest, SaysWhatIsLeftOfEffortsAndPositionsOfAnArm) {
  folder_.Write("rods.urdf", kRods);
  for (const std::string seed : {"1", "2"}) {
    SimulateInto(folder_, seed + ".csv",
                 {"--model", "rods.urdf", "--excite", "multisine", "--rate",
                  "200", "--noise", "1e-5", "--seed", seed});
  }
  const Arguments fit{"--model",   "rods.urdf", "--traj", "1.csv",
                      "--holdout", "2.csv",     "--free", "inertial"};
  const Json equations = Fit(fit + Arguments{"--solver", "inverse_dynamics"});
  EXPECT_THAT(result_.out, HasSubstr("  error of predicted positions, rad: "));
  EXPECT_THAT(result_.out, HasSubstr(" after 0.1 s, "));
  EXPECT_THAT(result_.out, HasSubstr(" after 0.5 s\n"));
  EXPECT_THAT(result_.out, HasSubstr(" Hz)\n"));
  EXPECT_THAT(result_.out, HasSubstr("  held out: inverse-dynamics residual"));
  EXPECT_GT(equations["error"]["effort_cut_off_hz"], 0.5);
  EXPECT_EQ(equations["error"]["holdout_effort"].size(), 2u);
  EXPECT_EQ(equations["error"]["horizon"].back()["horizon_s"], 0.5);
  const Json segments = Fit(fit);
  EXPECT_THAT(result_.out, HasSubstr("  base parameter "));
  ASSERT_EQ(segments["base_parameters"].size(),
            equations["base_parameters"].size());
  for (size_t i = 0; i < segments["base_parameters"].size(); ++i) {
    const Json& a = segments["base_parameters"][i];
    const Json& b = equations["base_parameters"][i];
    EXPECT_EQ(a["terms"][0]["name"], b["terms"][0]["name"]);
    const double error = a["std_error"].get<double>();
    EXPECT_GT(error, 0.0);
    EXPECT_LT(std::abs(a["value"].get<double>() - b["value"].get<double>()),
              5.0 * std::hypot(error, b["std_error"].get<double>()));
  }
}

TEST_F(FitTest, SaysFirstOfWhichJointNoEffortIsRecorded) {
  folder_.Write("chain.urdf", R"(<robot name="chain"><link name="base"/>
<joint name="a" type="revolute"><parent link="base"/><child link="la"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9" velocity="9"/>
</joint><link name="la"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.001"/>
</inertial></link><joint name="b" type="revolute">
<origin xyz="0 0 -0.4"/><parent link="la"/><child link="lb"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9" velocity="9"/>
</joint><link name="lb"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.001"/>
</inertial></link></robot>)");
  SimulateInto(folder_, "run.csv",
               {"--model", "chain.urdf", "--excite", "multisine"});
  std::string text = folder_.Read("run.csv");
  text.replace(text.find("b.tau"), 5, "x.tau");
  folder_.Write("run.csv", text);
  Fit({"--model", "chain.urdf", "--traj", "run.csv", "--free", "lb.mass",
       "--check", "none", "--solver", "inverse_dynamics"});
  EXPECT_THAT(result_.err,
              HasSubstr("note: no effort is recorded of b, but of a: right "
                        "only if no motor acts there; else map the columns "
                        "b.tau\n"));
}

TEST_F(FitTest, StartsAtTheSizeOfANegativeMass) {
  std::string urdf = kRods;
  const size_t last = urdf.rfind("<mass value=\"1\"/>");
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--excite", "multisine"});
  folder_.Write("rods.urdf", urdf.replace(last, 17, "<mass value=\"-0.7\"/>"));
  const Json fit =
      Fit({"--model", "rods.urdf", "--traj", "run.csv", "--free", "link2.mass",
           "--check", "none", "--solver", "inverse_dynamics"});
  EXPECT_THAT(result_.err, HasSubstr("note: the mass of link2 is free and "
                                     "negative: the fit starts from its "
                                     "size\n"));
  EXPECT_EQ(Parameter(fit, "link2.mass")["initial"], 0.7);
}

// A specification of the whole arm serves one of whose joints is locked.
TEST_F(FitTest, LocksAJointThatColumnsAndEffectsName) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--lock", "joint2"});
  folder_.Write("still.csv",
                "t,p1,p2\n" + Rows(folder_.Read("run.csv"), 0.0, 0.0));
  folder_.Write("moves.csv",
                "t,p1,p2\n" + Rows(folder_.Read("run.csv"), 0.0, 0.5));
  folder_.Write("spec.yaml",
                "free: [link1.mass, joint2.damping]\n"
                "effects: [viscous_damping@joint2]\n"
                "columns: {joint1.q: p1, joint2.q: p2}\n");
  const Arguments fit{"--model", "pendulum2_planar", "--spec",  "spec.yaml",
                      "--lock",  "joint2",           "--check", "none",
                      "--add",   "armature@joint2"};
  const Json still = Fit(fit + Arguments{"--traj", "still.csv"});
  EXPECT_THAT(result_.err,
              HasSubstr("note: still.csv: joint2.q is not used: --lock holds "
                        "the joint still\n"));
  EXPECT_THAT(result_.err,
              HasSubstr("note: not in the model, since --lock holds the joint "
                        "still: viscous_damping@joint2\n"));
  EXPECT_THAT(result_.err, HasSubstr("still: armature@joint2\n"));
  EXPECT_THAT(result_.err, HasSubstr("still: joint2.damping\n"));
  EXPECT_THAT(result_.err, Not(HasSubstr("although")));
  EXPECT_EQ(still["effects"], Json::array());
  Fit(fit + Arguments{"--traj", "moves.csv"});
  EXPECT_THAT(result_.err,
              HasSubstr("note: moves.csv: joint 'joint2' is held still at 0, "
                        "although its column moves by 0.5 rad, from 0 to "
                        "0.5\n"));
  folder_.Write("bent.csv",
                "t,p1,p2\n" + Rows(folder_.Read("run.csv"), 0.3, 0.3));
  Fit(fit + Arguments{"--traj", "bent.csv"});
  EXPECT_THAT(result_.err,
              HasSubstr("note: bent.csv: joint 'joint2' is held still at 0, "
                        "although its column is at 0.3 rad: --lock "
                        "joint2=0.3\n"));
  ExpectRefused(
      folder_, SYSID_FIT,
      fit + Arguments{"--traj", "still.csv", "--shift", "joint2.q=0.01"},
      "--shift",
      "joint 'joint2' is held still (--lock) and has no column "
      "'joint2.q'",
      "leave the column out, or do not lock the joint");
  ExpectRefused(folder_, SYSID_SIMULATE,
                {"--model", "pendulum2_planar", "--lock", "joint2", "--add",
                 "viscous_damping@joint2=0.1", "--out_csv", "x.csv"},
                "--add",
                "effect 'viscous_damping' has no meaning on joint 'joint2', "
                "which is held still (--lock)",
                "leave the effect out, or do not lock the joint");
}

TEST_F(FitTest, SaysWhichJointMovesNoInertia) {
  std::string urdf = kRods;
  const size_t last = urdf.rfind("<inertial>");
  const size_t end = urdf.rfind("</inertial>") + 11;
  folder_.Write("rods.urdf", urdf.erase(last, end - last));
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "4"});
  const ProgramResult fit = folder_.Run(
      SYSID_FIT, {"--model", "rods.urdf", "--traj", "run.csv", "--free",
                  "inertial", "--solver", "inverse_dynamics"});
  EXPECT_THAT(fit.err, HasSubstr("note: no_inertia: rods.urdf: joint2: the "
                                 "links that it moves have no inertia in the "
                                 "file\n"));
}

TEST_F(FitTest, GivesTheSameForOneThreadAndTwo) {
  for (const std::string seed : {"1", "2", "3"}) {
    SimulateInto(
        folder_, seed + ".csv",
        {"--model", "pendulum2_planar", "--duration", "2", "--seed", seed});
  }
  const Arguments fit{"--model", "pendulum2_planar", "--traj",
                      "1.csv,2.csv,3.csv"};
  const Json one = Fit(fit + Arguments{"--threads", "1"});
  const Json two = Fit(fit + Arguments{"--threads", "2"});
  for (const Json& parameter : one["parameters"]) {
    ExpectNear(two, parameter["name"], parameter["value"], 1e-3);
  }
}

TEST_F(FitTest, AddsEffectsAndFindsTheirParameters) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "4", "--add",
                "viscous_damping@joint1=0.1,sensor_offset@joint2=0.05"});
  const Json fit =
      Fit({"--model", "pendulum2_planar", "--traj", "run.csv", "--add",
           "viscous_damping@joint1,sensor_offset@joint2"});
  EXPECT_EQ(
      fit["effects"],
      Json::parse(R"(["viscous_damping@joint1", "sensor_offset@joint2"])"));
  ExpectNear(fit, "joint1.damping", 0.1);
  ExpectNear(fit, "joint2.sensor_offset", 0.05);
  ExpectNear(fit, "link1.length", 0.5);
}

TEST_F(FitTest, ReadsForeignColumns) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "2"});
  const Json fit = Fit({"--model", "pendulum2_planar", "--traj", "run.csv"});
  // The same in milliseconds and degrees, under other names.
  std::istringstream lines(folder_.Read("run.csv"));
  std::string foreign = "time_ms,a1,a2\n", line;
  std::getline(lines, line);
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    double t = 0, a = 0, b = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &t, &a, &b), 3);
    char row[128];
    std::snprintf(row, sizeof(row), "%.17g,%.17g,%.17g\n", 1000 * t,
                  a * 180 / M_PI, b * 180 / M_PI);
    foreign += row;
  }
  folder_.Write("foreign.csv", foreign);
  const Json same =
      Fit({"--model", "pendulum2_planar", "--traj", "foreign.csv", "--columns",
           "t=time_ms*0.001,joint1.q=a1*0.017453292519943295,"
           "joint2.q=a2*0.017453292519943295"});
  for (const Json& parameter : fit["parameters"]) {
    ExpectNear(same, parameter["name"], parameter["value"], 1e-2);
  }
}

TEST_F(FitTest, SkipsMissingCells) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum2_planar"});
  std::istringstream lines(folder_.Read("run.csv"));
  std::string gaps, line;
  for (int k = 0; std::getline(lines, line); ++k) {
    const size_t first = line.find(','), second = line.find(',', first + 1);
    if (k > 5 && k % 4 == 0) line = line.substr(0, second) + ",nan";
    if (k > 5 && k % 7 == 0) {
      line = line.substr(0, first) + "," + line.substr(second);
    }
    gaps += line + "\n";
  }
  folder_.Write("gaps.csv", gaps);
  const Json fit = Fit({"--model", "pendulum2_planar", "--traj", "gaps.csv"});
  ExpectNear(fit, "link1.length", 0.5);
  ExpectNear(fit, "link2.length", 0.5);
  EXPECT_NEAR(fit["error"]["train"]["normalized_rms"], 1.0, 0.15);
}

TEST_F(FitTest, PredictsWhatIsHeldOut) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "4"});
  SimulateInto(
      folder_, "held.csv",
      {"--model", "pendulum2_planar", "--duration", "3", "--seed", "2"});
  const Arguments alone{"--model", "pendulum2_planar", "--traj", "run.csv"};
  const Json without = Fit(alone);
  EXPECT_TRUE(without["error"]["holdout"].is_null());
  const Json with = Fit(alone + Arguments{"--holdout", "held.csv"});
  EXPECT_NEAR(with["error"]["holdout"]["normalized_rms"], 1.0, 0.2);
  EXPECT_EQ(with["samples"], without["samples"]);
  EXPECT_THAT(result_.out, HasSubstr("held out: error"));
  for (const Json& parameter : without["parameters"]) {
    ExpectNear(with, parameter["name"], parameter["value"], 1e-3);
  }
  ASSERT_EQ(with["error"]["open"].size(), 2u);
  EXPECT_EQ(with["error"]["open"][1]["trajectory"], "held.csv");
}

TEST_F(FitTest, CutsAStepThatIsLongerThanTheSamplesAreApart) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum1", "--duration", "2"});
  const Json fit =
      Fit({"--model", "pendulum1", "--traj", "run.csv", "--step", "1"});
  EXPECT_EQ(result_.err,
            "note: --step: 1 s is longer than the samples are apart: a step "
            "ends at every sample\n");
  EXPECT_NEAR(fit["step_s"], 0.01, 1e-9);
  EXPECT_EQ(fit["linearization"], "structured");
}

TEST_F(FitTest, SaysWhereSegmentsAreTooShortToSayAnything) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum1", "--duration", "2"});
  const std::string said = "too short to say anything";
  Fit({"--model", "pendulum1", "--traj", "run.csv", "--segment", "0.001"});
  EXPECT_THAT(result_.out, HasSubstr(said));
  Fit({"--model", "pendulum1", "--traj", "run.csv", "--segment", "0.5"});
  EXPECT_THAT(result_.out, Not(HasSubstr(said)));
}

TEST_F(FitTest, SaysWhichRunDoesNotDriveAJoint) {
  const Arguments driven{"--model",  "cartpole",  "--duration", "2",
                         "--excite", "multisine", "--seed",     "1"};
  SimulateInto(folder_, "driven.csv", driven);
  SimulateInto(folder_, "still.csv",
               {"--model", "cartpole", "--duration", "2"});
  const std::string said = "no effort acts on joint 'slider'";
  Fit({"--model", "cartpole", "--traj", "driven.csv,still.csv"});
  EXPECT_THAT(result_.err, HasSubstr("still.csv: " + said));
  Fit({"--model", "cartpole", "--traj", "driven.csv"});
  EXPECT_THAT(result_.err, Not(HasSubstr(said)));
}

TEST_F(FitTest, TakesStartsAndValuesFromFlags) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "4", "--set",
                "link1.length=0.4,link2.mass=2"});
  const Json fit =
      Fit({"--model=pendulum2_planar", "--traj=run.csv", "--free",
           "link1.length=0.7, link2.length", "--fix", "link2.mass=2"});
  EXPECT_EQ(Parameter(fit, "link1.length")["initial"], 0.7);
  ExpectNear(fit, "link1.length", 0.4);
  ExpectNear(fit, "link2.length", 0.5);
}

}  // namespace
}  // namespace sysid
