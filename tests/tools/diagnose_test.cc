// sysid_diagnose as its users run it: what it finds, how it says it, and what
// it refuses.

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::Contains;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using Json = nlohmann::json;

// That a JSON object has these keys, and maybe others.
void ExpectKeys(const Json& object, const std::vector<std::string>& keys) {
  ASSERT_TRUE(object.is_object()) << object;
  for (const std::string& key : keys) {
    EXPECT_TRUE(object.contains(key)) << key << " in " << object.dump(1);
  }
}

void ExpectNumberOrNull(const Json& value) {
  EXPECT_TRUE(value.is_null() ||
              (value.is_number() && std::isfinite(value.get<double>())))
      << value;
}

std::string LastLine(const std::string& text) {
  const std::string body = text.substr(0, text.size() - 1);
  return body.substr(body.rfind('\n') + 1);
}

// The words of a command that quotes nothing, without the program's name.
Arguments WordsOf(const std::string& command) {
  std::istringstream words(command);
  Arguments all;
  for (std::string word; words >> word;) all.push_back(word);
  all.erase(all.begin());
  return all;
}

class DiagnoseTest : public ::testing::Test {
 protected:
  // Three runs of a damped pendulum.
  static void SetUpTestSuite() {
    folder_ = new ProgramFolder;
    for (const std::string seed : {"1", "2", "3"}) {
      SimulateInto(*folder_, seed + ".csv",
                   {"--model", "pendulum2_planar", "--duration", "4", "--seed",
                    seed, "--add", "viscous_damping@joint1=0.05"});
    }
  }
  static void TearDownTestSuite() { delete folder_; }

  ProgramResult Diagnose(const Arguments& arguments) {
    return folder_->Run(SYSID_DIAGNOSE, arguments);
  }
  static Arguments Damped() {
    return {"--model",     "pendulum2_planar", "--traj",
            "1.csv,2.csv", "--holdout",        "3.csv"};
  }
  // As above, asked for every output; nothing may be written.
  void ExpectDiagnosisRefused(const Arguments& arguments,
                              const std::string& place, const std::string& what,
                              const std::string& hint) {
    ExpectRefused(
        *folder_, SYSID_DIAGNOSE,
        arguments + Arguments{"--json", "refused.json", "--out", "refused"},
        place, what, hint);
  }

  static ProgramFolder* folder_;
};

ProgramFolder* DiagnoseTest::folder_ = nullptr;

// The whole promise in one run: the verdict, the effect, its value; and off a
// terminal neither progress nor colours.
TEST_F(DiagnoseTest, SaysWhatIsMissing) {
  const ProgramResult result = Diagnose(Damped());
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, StartsWith("pendulum2_planar: missing_effect\n"));
  EXPECT_THAT(result.out, HasSubstr("viscous_damping@joint1 is missing"));
  EXPECT_THAT(result.out, HasSubstr("joint1.damping 0.05"));
  EXPECT_EQ(result.out.find('\033'), std::string::npos);
  EXPECT_EQ(result.out.find('\r'), std::string::npos);
  EXPECT_EQ(result.out.find("nan"), std::string::npos);
  EXPECT_EQ(result.out.find("inf "), std::string::npos);
}

// docs/interface.md section 6, key by key; and on standard output nothing else.
TEST_F(DiagnoseTest, WritesTheJsonOfTheContract) {
  const ProgramResult result = Diagnose(Damped() + Arguments{"--json", "-"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  const Json json = Json::parse(result.out);  // throws on anything else
  ExpectKeys(json, {"schema", "model", "noise", "verdict", "baseline", "where",
                    "candidates", "added", "next_command"});
  EXPECT_EQ(json["schema"], "sysid.diagnosis/1");
  EXPECT_EQ(json["model"], "pendulum2_planar");
  EXPECT_NEAR(json["noise"], 1e-3, 2e-4);
  EXPECT_EQ(json["verdict"], "missing_effect");
  for (const char* part : {"train", "holdout"}) {
    ExpectKeys(json["baseline"][part], {"rms", "normalized_rms"});
    EXPECT_GT(json["baseline"][part]["normalized_rms"], 5.0);
  }
  ExpectKeys(json["where"], {"channels", "segments", "force"});
  ASSERT_EQ(json["where"]["channels"].size(), 2u);
  for (const Json& channel : json["where"]["channels"]) {
    ExpectKeys(channel, {"name", "rms", "normalized_rms"});
  }
  ASSERT_GE(json["where"]["segments"].size(), 2u);
  for (const Json& segment : json["where"]["segments"]) {
    ExpectKeys(segment, {"trajectory", "t_start", "t_end", "normalized_rms"});
    EXPECT_LT(segment["t_start"], segment["t_end"]);
  }
  for (const Json& curve : json["where"]["force"]) {
    ExpectKeys(curve, {"joint", "t", "value"});
    EXPECT_EQ(curve["t"].size(), curve["value"].size());
    for (const Json& value : curve["value"]) ExpectNumberOrNull(value);
  }
  ASSERT_GE(json["candidates"].size(), 20u);
  for (const Json& candidate : json["candidates"]) {
    ExpectKeys(candidate, {"effect", "target", "score", "dof", "p_value",
                           "predicted_error", "expected_parameters",
                           "confirmed", "indistinguishable_from"});
    ExpectNumberOrNull(candidate["score"]);
    ExpectNumberOrNull(candidate["p_value"]);
    ExpectNumberOrNull(candidate["predicted_error"]);
    EXPECT_GE(candidate["dof"], 1);
    EXPECT_FALSE(candidate["expected_parameters"].empty());
    for (const Json& value : candidate["expected_parameters"]) {
      ExpectNumberOrNull(value);
    }
    EXPECT_TRUE(candidate["indistinguishable_from"].is_array());
    if (candidate["confirmed"].is_null()) continue;
    ExpectKeys(candidate["confirmed"], {"train", "holdout", "parameters"});
    ExpectNumberOrNull(candidate["confirmed"]["train"]);
  }
  const Json& first = json["candidates"][0];
  EXPECT_EQ(first["effect"], "viscous_damping");
  EXPECT_EQ(first["target"], "joint1");
  EXPECT_NEAR(first["expected_parameters"]["joint1.damping"], 0.05, 0.005);
  EXPECT_NEAR(first["confirmed"]["parameters"]["joint1.damping"], 0.05, 0.001);
  EXPECT_NEAR(first["confirmed"]["holdout"], 1.0, 0.1);
  EXPECT_EQ(json["added"], Json::array());
}

// Whoever follows the last line gets what was promised.
TEST_F(DiagnoseTest, EndsWithTheCommandThatAddsTheFirstCandidate) {
  const ProgramResult result =
      Diagnose(Damped() + Arguments{"--json", "next.json"});
  const Json json = Json::parse(folder_->Read("next.json"));
  const std::string next = json["next_command"];
  EXPECT_THAT(LastLine(result.out), ::testing::StrEq(next));
  EXPECT_EQ(next,
            "sysid_fit --model pendulum2_planar --traj 1.csv,2.csv --holdout "
            "3.csv --add viscous_damping@joint1");
  const ProgramResult fit = folder_->Run(
      SYSID_FIT, WordsOf(next) + Arguments{"--json", "next_fit.json"});
  EXPECT_EQ(fit.exit_code, 0) << fit.err;
  const Json fitted = Json::parse(folder_->Read("next_fit.json"));
  const Json& promised = json["candidates"][0]["confirmed"];
  EXPECT_NEAR(fitted["error"]["train"]["normalized_rms"],
              promised["train"].get<double>(), 0.05);
  EXPECT_NEAR(fitted["error"]["holdout"]["normalized_rms"],
              promised["holdout"].get<double>(), 0.05);
}

// Two effects: added in order, each lowering both errors, and the model that
// comes of it in every file.
TEST_F(DiagnoseTest, AddsUntilNothingIsMissing) {
  for (const std::string seed : {"1", "2", "3"}) {
    SimulateInto(
        *folder_, "two" + seed + ".csv",
        {"--model", "pendulum2_planar", "--duration", "4", "--seed", seed,
         "--add", "viscous_damping@joint1=0.02,sensor_offset@joint2=0.03"});
  }
  const ProgramResult result =
      Diagnose({"--model", "pendulum2_planar", "--traj", "two1.csv,two2.csv",
                "--holdout", "two3.csv", "--auto", "--out", "two"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, NoReportNote());
  const Json json = Json::parse(folder_->Read("two/diagnosis.json"));
  std::vector<std::string> effects;
  double train = json["baseline"]["train"]["normalized_rms"];
  double holdout = json["baseline"]["holdout"]["normalized_rms"];
  for (const Json& added : json["added"]) {
    ExpectKeys(added, {"effect", "target", "train_before", "train_after",
                       "holdout_before", "holdout_after"});
    effects.push_back(added["effect"].get<std::string>() + "@" +
                      added["target"].get<std::string>());
    EXPECT_LE(added["train_before"], train * 1.001);
    EXPECT_LE(added["holdout_before"], holdout * 1.001);
    EXPECT_LT(added["train_after"], added["train_before"]);
    EXPECT_LT(added["holdout_after"], added["holdout_before"]);
    train = added["train_after"];
    holdout = added["holdout_after"];
  }
  EXPECT_THAT(effects, ::testing::UnorderedElementsAre("viscous_damping@joint1",
                                                       "sensor_offset@joint2"));
  EXPECT_LT(train, 1.1);
  EXPECT_LT(holdout, 1.1);
  EXPECT_THAT(result.out, HasSubstr(": adequate\n"));
  // The files: the fit with the effects, what it predicts, and a model that
  // begins where it ended.
  const Json fit = Json::parse(folder_->Read("two/fit.json"));
  EXPECT_EQ(fit["schema"], "sysid.fit/1");
  EXPECT_THAT(fit["effects"].get<std::vector<std::string>>(),
              ::testing::UnorderedElementsAreArray(effects));
  EXPECT_LT(fit["error"]["holdout"]["normalized_rms"], 1.1);
  EXPECT_THAT(folder_->Read("two/prediction.csv"), HasSubstr("joint1"));
  ExpectReport(*folder_, "two/report.html", "sysid_diagnose");
  const ProgramResult again =
      folder_->Run(SYSID_FIT, {"--model", "two/identified.urdf", "--traj",
                               "two1.csv,two2.csv", "--json", "again.json"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const Json same = Json::parse(folder_->Read("again.json"));
  EXPECT_THAT(same["effects"].get<std::vector<std::string>>(),
              ::testing::UnorderedElementsAreArray(effects));
  EXPECT_NEAR(same["error"]["train"]["normalized_rms"],
              fit["error"]["train"]["normalized_rms"].get<double>(), 1e-3);
  // And nothing is missing from that.
  const ProgramResult complete =
      Diagnose({"--model", "two/identified.urdf", "--traj", "two1.csv,two2.csv",
                "--holdout", "two3.csv"});
  EXPECT_THAT(complete.out, StartsWith("identified: adequate\n"));
  EXPECT_THAT(complete.out,
              HasSubstr("smallest detectable parameters with this data"));
  EXPECT_THAT(LastLine(complete.out), Not(HasSubstr("--add")));
}

// What it does unasked it says.
TEST_F(DiagnoseTest, HoldsOutTheLastQuarterAndSaysSo) {
  const ProgramResult result =
      Diagnose({"--model", "pendulum2_planar", "--traj", "1.csv,2.csv",
                "--json", "quarter.json"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err,
            "note: no --holdout: the last quarter of every run is held out to "
            "judge by\n");
  const Json json = Json::parse(folder_->Read("quarter.json"));
  EXPECT_EQ(json["notices"].size(), 1u);
  EXPECT_TRUE(json["baseline"]["holdout"]["normalized_rms"].is_number());
  for (const Json& segment : json["where"]["segments"]) {
    EXPECT_LE(segment["t_end"], 3.01);
  }
  EXPECT_EQ(json["candidates"][0]["effect"], "viscous_damping");
}

// 45 samples are a recording. A rotor and an inertia about the same fixed axis
// are one answer with two names: no motion would decide.
TEST_F(DiagnoseTest, JudgesAShortRecording) {
  SimulateInto(*folder_, "short.csv",
               {"--model", "pendulum2_planar", "--duration", "0.22", "--rate",
                "200", "--noise", "5e-5", "--seed", "4", "--tilt", "1.2",
                "--add", "armature@joint1=0.05"});
  const ProgramResult result =
      Diagnose({"--model", "pendulum2_planar", "--traj", "short.csv", "--auto",
                "--json", "short.json"});
  EXPECT_EQ(result.exit_code, 0);
  const Json json = Json::parse(folder_->Read("short.json"));
  EXPECT_EQ(json["verdict"], "missing_effect") << json["sentence"];
  EXPECT_TRUE(std::any_of(
      json["rivals"].begin(), json["rivals"].end(), [](const Json& rival) {
        return rival["effects"] == Json({"armature@joint1"}) &&
               rival["same_force"] == true;
      }));
  EXPECT_LT(json["segment_s"], 0.06);
  EXPECT_TRUE(json["next_experiment"].is_null());
  EXPECT_THAT(result.out, HasSubstr("the same force as "));
}

// Where the data do not decide, it says which recording would, as a command.
TEST_F(DiagnoseTest, SaysWhichRecordingWouldDecide) {
  SimulateInto(*folder_, "slow.csv",
               {"--model", "pendulum2_planar", "--duration", "1", "--seed", "3",
                "--tilt", "0.4", "--add", "viscous_damping@joint1=0.05"});
  const ProgramResult result =
      Diagnose({"--model", "pendulum2_planar", "--traj", "slow.csv", "--auto",
                "--candidates", "viscous_damping,quadratic_drag", "--json",
                "slow.json"});
  EXPECT_EQ(result.exit_code, 0);
  const Json json = Json::parse(folder_->Read("slow.json"));
  EXPECT_EQ(json["verdict"], "undecided") << json["sentence"];
  ASSERT_TRUE(json["next_experiment"].is_string());
  const std::string command = json["next_experiment"];
  EXPECT_THAT(result.out, HasSubstr("\n" + command + "\n"));
  EXPECT_THAT(command, StartsWith("sysid_simulate --model pendulum2_planar "
                                  "--add viscous_damping@joint1 --set "
                                  "link1.length="));
  // Lengths scale the rest of their links.
  EXPECT_THAT(command, Not(HasSubstr("com_z")));
  const std::string flags = command.substr(command.find("--model"));
  std::istringstream words(flags.substr(0, flags.find("--out_csv")));
  Arguments arguments;
  for (std::string word; words >> word;) arguments.push_back(word);
  SimulateInto(*folder_, "planned_motion.csv", arguments);
  EXPECT_FALSE(folder_->Read("planned_motion.csv").empty());

  // The same of a model that the specification names.
  folder_->Write("slow.yaml",
                 "model: pendulum2_planar\n"
                 "free: [link1.length, link2.length]\n");
  const ProgramResult by_spec =
      Diagnose({"--spec", "slow.yaml", "--traj", "slow.csv", "--auto",
                "--candidates", "viscous_damping,quadratic_drag"});
  EXPECT_EQ(by_spec.exit_code, 0);
  EXPECT_THAT(by_spec.out, HasSubstr("sysid_simulate --model /"));
}

TEST_F(DiagnoseTest, ConsidersWhatItIsToldTo) {
  const ProgramResult result =
      Diagnose(Damped() + Arguments{"--candidates",
                                    "coulomb_friction,effort_bias@joint1",
                                    "--json", "few.json"});
  EXPECT_EQ(result.exit_code, 0);
  const Json json = Json::parse(folder_->Read("few.json"));
  std::vector<std::string> names;
  for (const Json& candidate : json["candidates"]) {
    names.push_back(candidate["effect"].get<std::string>() + "@" +
                    candidate["target"].get<std::string>());
  }
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("coulomb_friction@joint1",
                                                     "coulomb_friction@joint2",
                                                     "effort_bias@joint1"));
}

// Doubts come first: what follows rests on a fit that is at its bound.
TEST_F(DiagnoseTest, SaysFirstThatTheFitIsNotToBeTrusted) {
  folder_->Write("bound.yaml",
                 "free:\n  link1.length: {initial: 0.4, lower: 0.1, upper: "
                 "0.45}\n");
  const ProgramResult result = Diagnose(
      Damped() + Arguments{"--spec", "bound.yaml", "--json", "b.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const size_t doubt =
      result.out.find("unreliable fit: link1.length ended at its bound");
  ASSERT_NE(doubt, std::string::npos) << result.out;
  EXPECT_LT(doubt, result.out.find("The error is"));
  EXPECT_THAT(Json::parse(folder_->Read("b.json"))["doubts"],
              Contains("link1.length ended at its bound"));
}

// What is fixed by name was measured otherwise: nothing moves it.
TEST_F(DiagnoseTest, LeavesWhatIsFixed) {
  SimulateInto(*folder_, "heavy.csv",
               {"--model", "pendulum2_planar", "--duration", "6", "--set",
                "link2.mass=1.3"});
  const Arguments heavy{"--model", "pendulum2_planar", "--traj", "heavy.csv"};
  // Without efforts the ratio of the masses is all that shows.
  EXPECT_THAT(Diagnose(heavy).out,
              ::testing::ContainsRegex("mass@link[12] is indistinguishable "
                                       "from mass@link[12] in this data"));
  const ProgramResult fixed = Diagnose(
      heavy + Arguments{"--fix", "link1.mass,link2.mass", "--json", "f.json"});
  EXPECT_EQ(fixed.exit_code, 0) << fixed.err;
  for (const Json& candidate :
       Json::parse(folder_->Read("f.json"))["candidates"]) {
    EXPECT_NE(candidate["effect"], "mass");
  }
  // The next command keeps them fixed.
  EXPECT_THAT(LastLine(fixed.out), HasSubstr("--fix link1.mass,link2.mass"));
}

TEST_F(DiagnoseTest, HelpFitsAScreenAndItsExampleWorks) {
  const ProgramFolder folder;
  const Arguments swing{"--model", "pendulum2_planar", "--duration", "4"};
  SimulateInto(folder, "a.csv", swing);
  SimulateInto(folder, "b.csv", swing + Arguments{"--seed", "2"});
  SimulateInto(folder, "c.csv", swing + Arguments{"--seed", "3"});
  ExpectHelp(folder, SYSID_DIAGNOSE, "sysid_diagnose");
  EXPECT_TRUE(folder.Has("result/diagnosis.json"));
}

TEST_F(DiagnoseTest, RefusesBadFlags) {
  ExpectDiagnosisRefused({}, "--model", "is missing", "pendulum3_planar");
  ExpectDiagnosisRefused({"--model", "pendulum2_planar"}, "--traj",
                         "is missing", "--traj run1.csv,run2.csv");
  ExpectDiagnosisRefused(Damped() + Arguments{"--candidate", "x"},
                         "--candidate", "unknown flag",
                         "did you mean 'candidates'?");
  ExpectDiagnosisRefused(Damped() + Arguments{"--auto=maybe"}, "--auto",
                         "cannot be 'maybe'", "true or false");
  ExpectDiagnosisRefused(Damped() + Arguments{"--auto", "yes"},
                         "argument 'yes'", "belongs to no flag", "--help");
  ExpectRefused(*folder_, SYSID_DIAGNOSE,
                Damped() + Arguments{"--json", "1.csv"}, "--json",
                "'1.csv' is read too", "another file");
}

TEST_F(DiagnoseTest, RefusesCandidatesThatAreNone) {
  ExpectDiagnosisRefused(
      Damped() + Arguments{"--candidates", "viscous_dampin@joint1"},
      "--candidates", "unknown effect 'viscous_dampin'",
      "did you mean 'viscous_damping'?");
  ExpectDiagnosisRefused(
      Damped() + Arguments{"--candidates", "viscous_damping@joint3"},
      "--candidates", "unknown target 'joint3'", "joint1");
  ExpectDiagnosisRefused(Damped() + Arguments{"--candidates", "mass@joint1"},
                         "--candidates", "unknown target 'joint1'", "link1");
  ExpectDiagnosisRefused(
      Damped() + Arguments{"--candidates", "viscous_damping@base"},
      "--candidates", "unknown target 'base'", "joint1");
  ExpectDiagnosisRefused({"--model", "pendulum2_planar", "--traj", "1.csv",
                          "--candidates", "viscous"},
                         "--candidates", "unknown effect 'viscous'", "");
}

TEST_F(DiagnoseTest, RefusesRunsThatDoNotFit) {
  SimulateInto(*folder_, "cart.csv",
               {"--model", "cartpole", "--duration", "2"});
  const Arguments fitted{"--model", "pendulum2_planar", "--traj", "1.csv"};
  ExpectDiagnosisRefused(
      fitted + Arguments{"--holdout", "cart.csv"}, "cart.csv:2:1",
      "no column measures anything of pendulum2_planar", "joint1.q, joint2.q");
  ExpectDiagnosisRefused(fitted + Arguments{"--holdout", "1.csv"}, "--holdout",
                         "'1.csv' is fitted too", "not in --traj");
  ExpectDiagnosisRefused(fitted + Arguments{"--holdout", "nowhere.csv"},
                         "nowhere.csv", "there is no such file",
                         "check the name");
}

// A verdict on nothing would be a lie: it is said what is lacking.
TEST_F(DiagnoseTest, RefusesRunsThatDecideNothing) {
  SimulateInto(*folder_, "short.csv",
               {"--model", "pendulum2_planar", "--duration", "0.15"});
  ExpectDiagnosisRefused(
      {"--model", "pendulum2_planar", "--traj", "short.csv", "--holdout",
       "1.csv"},
      "--traj",
      "too short to decide anything: the longest run has 16 samples to fit, "
      "and 20 are the fewest",
      "record some seconds of motion");
  SimulateInto(*folder_, "quarter.csv",
               {"--model", "pendulum2_planar", "--duration", "0.22"});
  ExpectDiagnosisRefused(
      {"--model", "pendulum2_planar", "--traj", "quarter.csv"}, "--traj",
      "too short to decide anything", "hold out another run (--holdout)");
  SimulateInto(
      *folder_, "still.csv",
      {"--model", "pendulum2_planar", "--duration", "4", "--tilt", "0.001"});
  ExpectDiagnosisRefused({"--model", "pendulum2_planar", "--traj", "still.csv"},
                         "--traj",
                         "too still to decide anything: the widest motion is ",
                         "record motion that is wide beside the noise");
  const Arguments fitted = {"--model", "pendulum2_planar", "--traj", "1.csv"};
  ExpectDiagnosisRefused(fitted + Arguments{"--holdout", "short.csv"},
                         "--holdout",
                         "short.csv is too short to judge by: it has 16 "
                         "samples, and 20 are the fewest",
                         "then the last quarter of every run is");
  ExpectDiagnosisRefused(fitted + Arguments{"--holdout", "still.csv"},
                         "--holdout", "still.csv is too still to judge by",
                         "hold out motion");
}

}  // namespace
}  // namespace sysid
