// sysid_fit --solver adam|gmm and sysid_compare as users run them.

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;

const std::string kDamped =
    std::string(SYSID_SOURCE) + "/data/runs/figure1_damped.csv";
const std::string kRun = std::string(SYSID_SOURCE) + "/data/runs/figure1.csv";
const Arguments kFigure1{
    "--model",     "pendulum2", "--traj",
    kRun,          "--free",    "link1.length=1,link2.length=1",
    "--from_rest", "--noise",   "1e-3"};

const Arguments kRodAndBob{
    "--model", "rod_and_bob",
    "--traj",  std::string(SYSID_SOURCE) + "/data/runs/rod_and_bob.csv",
    "--noise", "1e-3"};

double Value(const Json& json, const std::string& name) {
  for (const Json& p : json.at("parameters")) {
    if (p.at("name") == name) return p.at("value");
  }
  return std::nan("");
}

void ExpectFiniteOrNull(const Json& json) {
  if (json.is_number_float()) {
    EXPECT_TRUE(std::isfinite(json.get<double>()));
  }
  if (!json.is_structured()) return;
  for (const auto& item : json.items()) ExpectFiniteOrNull(item.value());
}

TEST(Adam, FitsAndReports) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_FIT, kFigure1 + Arguments{"--solver", "adam", "--out", "result",
                                      "--json", "fit.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("150 epochs"));
  const Json json = Json::parse(folder.Read("fit.json"));
  ExpectFiniteOrNull(json);
  EXPECT_EQ(json["schema"], "sysid.fit/1");
  EXPECT_EQ(json["solver"], "adam");
  EXPECT_EQ(json["converged"], true);
  EXPECT_EQ(json["iterations"], 150);
  EXPECT_EQ(json["history"].size(), 151u);
  EXPECT_FALSE(json.contains("mixture"));
  EXPECT_NEAR(Value(json, "link1.length"), 0.81, 0.02 * 0.81);
  EXPECT_NEAR(Value(json, "link2.length"), 0.304, 0.02 * 0.304);
  for (const char* file : {"fit.json", "prediction.csv", "identified.urdf",
                           "identified.sysid.yaml"}) {
    EXPECT_NE(folder.Read(std::string("result/") + file), "") << file;
  }
}

TEST(Adam, IsChosenByASpecificationToo) {
  const ProgramFolder folder;
  folder.Write("fit.yaml",
               "free: {link1.length: {initial: 1}, link2.length: {initial: "
               "1}}\nsolver: adam\n");
  const ProgramResult result =
      folder.Run(SYSID_FIT, {"--model", "pendulum2", "--traj", kRun, "--spec",
                             "fit.yaml", "--from_rest", "--json", "-"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Json::parse(result.out)["solver"], "adam");
}

TEST(Adam, SaysWhereItMovesAStart) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_FIT,
      kFigure1 + Arguments{"--solver", "adam", "--epochs", "2", "--add",
                           "viscous_damping@joint1", "--json", "fit.json"});
  EXPECT_THAT(result.err, HasSubstr("note: joint1.damping starts at its bound, "
                                    "where Adam has no slope: moved to 0.01"));
  EXPECT_THAT(result.out, ContainsRegex("joint1.damping +0\\.01 "));
  EXPECT_EQ(Json::parse(folder.Read("fit.json"))["parameters"][2]["initial"],
            0.01);
}

// The model is complete: what is left is due to first velocities that the data
// only tells roughly.
TEST(Adam, DoesNotBlameTheModelForTheFirstStates) {
  const ProgramFolder folder;
  const Arguments arguments{"--model",  "pendulum2",
                            "--traj",   kRun,
                            "--free",   "link1.length=1,link2.length=1",
                            "--solver", "adam"};
  EXPECT_THAT(
      folder.Run(SYSID_FIT, arguments + Arguments{"--noise", "1e-3"}).out,
      HasSubstr(
          "the model does not explain the data, or the first states, which are "
          "given by the data here, are off (--solver lm estimates them)"));
  // Beside a noise that 11 samples told, it may as well be nothing.
  EXPECT_THAT(folder.Run(SYSID_FIT, arguments).out,
              HasSubstr("at the noise floor, as far as the noise can be "
                        "estimated from 11 samples"));
}

TEST(Adam, SaysHowLongItsRolloutsAre) {
  const ProgramFolder folder;
  SimulateInto(folder, "long.csv",
               {"--model", "pendulum2", "--duration", "0.8", "--rate", "25"});
  const ProgramResult result = folder.Run(
      SYSID_FIT, {"--model", "pendulum2", "--traj", kRun + ",long.csv",
                  "--free", "link1.length=1", "--solver", "adam", "--epochs",
                  "2", "--noise", "1e-3"});
  EXPECT_THAT(result.out, HasSubstr("segments of 0.4 to 0.8 s,"));
}

TEST(Adam, SaysWhyItHasNoUsableResult) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_FIT, kFigure1 + Arguments{"--solver", "adam", "--epochs", "3"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, AllOf(HasSubstr("no usable result: after 3 epochs"),
                                HasSubstr("more --epochs")));
}

TEST(Mixture, IsWrittenAsAPosteriorWithItsHistory) {
  const ProgramFolder folder;
  const Arguments arguments =
      kFigure1 + Arguments{"--solver", "gmm", "--json", "-", "--seed", "3"};
  const ProgramResult result = folder.Run(SYSID_FIT, arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  ExpectFiniteOrNull(json);
  EXPECT_EQ(json["solver"], "gmm");
  const Json& mixture = json.at("mixture");
  EXPECT_EQ(mixture.at("weights").size(), 3u);
  ASSERT_EQ(mixture.at("means").size(), 3u);
  EXPECT_EQ(mixture["means"][0].size(), 2u);
  EXPECT_EQ(mixture.at("stds").size(), 3u);
  // The value is the weighted sum of the kernels.
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    sum += mixture["weights"][k].get<double>() *
           mixture["means"][k][0].get<double>();
  }
  EXPECT_NEAR(Value(json, "link1.length"), sum, 1e-12);
  ASSERT_EQ(json["history"].size(), 151u);
  for (const Json& epoch : json["history"]) {
    EXPECT_EQ(epoch.at("weights").size(), 3u);
    EXPECT_EQ(epoch.at("means").size(), 3u);
    EXPECT_EQ(epoch.at("stds")[2].size(), 2u);
    EXPECT_TRUE(epoch.contains("iteration") && epoch.contains("cost") &&
                epoch.contains("time_s"));
  }
  // The same command, the same numbers.
  Json again = Json::parse(folder.Run(SYSID_FIT, arguments).out);
  EXPECT_EQ(again["mixture"], mixture);
}

TEST(Mixture, SamplesIdentifiedModels) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_FIT, kFigure1 + Arguments{"--solver", "gmm", "--epochs", "100",
                                      "--sample", "3", "--out", "result"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("kernel"), HasSubstr("weight"),
                                HasSubstr("report.html, samples.csv, "
                                          "sample_1.urdf to sample_3.urdf\n"),
                                Not(HasSubstr("not converged"))));
  EXPECT_THAT(folder.Read("result/samples.csv"),
              testing::StartsWith("sample,link1.length,link2.length\n1,0."));
  std::string before;
  for (const char* number : {"1", "2", "3"}) {
    const std::string file = std::string("result/sample_") + number + ".urdf";
    const std::string urdf = folder.Read(file);
    EXPECT_THAT(urdf, HasSubstr(std::string("draw ") + number + " of 3"));
    EXPECT_NE(urdf, before);
    before = urdf;
    const ProgramResult simulated = folder.Run(
        SYSID_SIMULATE,
        {"--model", file, "--duration", "0.1", "--out_csv", "run.csv"});
    EXPECT_EQ(simulated.exit_code, 0) << simulated.err;
  }
}

TEST(Mixture, SaysThatItsSamplesAreOfNoUsableResult) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_FIT, kFigure1 + Arguments{"--solver", "gmm", "--epochs", "3",
                                      "--sample", "1", "--out", "result"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("samples.csv, sample_1.urdf\n"),
                    HasSubstr("samples are drawn from a fit that has not "
                              "converged")));
  EXPECT_THAT(folder.Read("result/sample_1.urdf"),
              HasSubstr("not converged: the mean has not settled"));
}

TEST(Mixture, SaysTheSameOfWhatIsNotIdentifiableInWordsAndInJson) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_FIT, kRodAndBob + Arguments{"--solver", "gmm", "--from_rest",
                                        "--json", "fit.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(
      result.out,
      AllOf(HasSubstr("rod.length, bob.com_z are not separately identifiable"),
            HasSubstr("kernels lead to different rod.length, bob.com_z "
                      "that fit equally well")));
  const Json json = Json::parse(folder.Read("fit.json"));
  EXPECT_EQ(json["not_identifiable"],
            Json::parse(R"([["rod.length", "bob.com_z"]])"));
  for (const Json& p : json["parameters"]) {
    EXPECT_TRUE(p["std_error"].is_null());
    EXPECT_EQ(p["identifiable"], false);
  }
}

TEST(Flags, OfAnotherSolverAreRefused) {
  const ProgramFolder folder;
  const auto expect = [&](const Arguments& arguments, const std::string& place,
                          const std::string& what, const std::string& hint) {
    ExpectFitRefused(
        folder, Arguments{"--model", "pendulum2", "--traj", kRun} + arguments,
        place, what, hint);
  };
  expect({"--epochs", "10"}, "--epochs", "no meaning for --solver lm",
         "adam and gmm");
  expect({"--solver", "adam", "--kernels", "2"}, "--kernels",
         "no meaning for --solver adam", "gmm");
  expect({"--solver", "adam", "--loss", "huber"}, "--loss",
         "no meaning for --solver adam", "--huber");
  expect({"--solver", "gmm", "--sample", "0"}, "--sample", "cannot be 0",
         "between 1");
  expect({"--solver", "gmm", "--kernels", "0"}, "--kernels", "cannot be 0",
         "above 0");
  expect({"--solver", "adam", "--learning_rate", "-1"}, "--learning_rate",
         "cannot be -1", "above 0");
  expect({"--solver", "adam", "--learning_rate", "nan"}, "--learning_rate",
         "cannot be nan", "above 0");
  expect({"--solver", "adam", "--schedule", "cosin"}, "--schedule",
         "unknown schedule 'cosin'", "cosine");
  expect({"--solver", "gmm", "--online", "--epochs", "10"}, "--epochs",
         "no meaning with --online", "15 epochs");
  folder.Write("fit.json", "");
  ExpectRefused(folder, SYSID_FIT,
                kFigure1 + Arguments{"--solver", "gmm", "--sample", "2"},
                "--sample", "nowhere to write", "--out DIR");
  ExpectRefused(folder, SYSID_DIAGNOSE,
                {"--model", "pendulum2", "--traj", kRun, "--solver", "adam"},
                "--solver", "this program has no solver 'adam'", "sysid_fit");
}

TEST(Compare, WritesATableJsonAndAFigure) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_COMPARE,
      kFigure1 + Arguments{"--truth", "link1.length=0.81,link2.length=0.304",
                           "--json", "comparison.json", "--figure",
                           "figure.svg", "--repeat", "2", "--out", "result"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("farthest from truth"),
                    HasSubstr("over 2 starts"), HasSubstr("settled at")));
  const Json json = Json::parse(folder.Read("comparison.json"));
  ExpectFiniteOrNull(json);
  EXPECT_EQ(json["schema"], "sysid.comparison/1");
  ASSERT_EQ(json["solvers"].size(), 3u);
  for (const Json& solver : json["solvers"]) {
    EXPECT_LT(solver.at("distance"), 0.02) << solver["solver"];
    EXPECT_FALSE(solver.at("path").empty());
    EXPECT_GT(solver.at("evaluations"), 0);
  }
  EXPECT_EQ(json["trials"].size(), 2u);
  EXPECT_EQ(json["uncertainty"].size(), 2u);
  EXPECT_EQ(json["landscape"]["deviance"].size(),
            json["landscape"]["y"].size());
  const std::string figure = folder.Read("figure.svg");
  EXPECT_THAT(figure,
              AllOf(testing::StartsWith("<svg "), testing::EndsWith("</svg>\n"),
                    HasSubstr("Loss against time")));
  EXPECT_EQ(figure.find("nan"), std::string::npos);
  EXPECT_EQ(figure.find("inf"), std::string::npos);
  EXPECT_NE(folder.Read("result/comparison.svg"), "");
  EXPECT_NE(folder.Read("result/comparison.json"), "");
}

TEST(Compare, GivesNoDistanceFromWhatIsNotDetermined) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      SYSID_COMPARE, kRodAndBob + Arguments{"--repeat", "2", "--epochs", "20",
                                            "--json", "comparison.json"});
  EXPECT_THAT(result.out,
              AllOf(ContainsRegex("farthest from lm +- +- +-\n"),
                    HasSubstr("no distance from lm in rod.length, bob.com_z: "
                              "not identifiable\n"),
                    ContainsRegex("farthest, % +- +- +-\n")));
  const Json json = Json::parse(folder.Read("comparison.json"));
  ExpectFiniteOrNull(json);
  EXPECT_TRUE(json["reference"][0].is_null());
  for (const Json& solver : json["solvers"]) {
    EXPECT_TRUE(solver["distance"].is_null());
  }
}

// All solvers minimise the same, whatever a specification says of one. The loss
// of this one doubles lm's standard error.
TEST(Compare, LeavesTheLossOfASpecificationOut) {
  const ProgramFolder folder;
  std::vector<Json> of_lm;
  for (const std::string loss : {"", "loss: {name: huber, scale: 0.1}\n"}) {
    folder.Write("spec.yaml", "free: [rod.length]\n" + loss);
    folder.Run(SYSID_COMPARE,
               kRodAndBob + Arguments{"--spec", "spec.yaml", "--epochs", "3",
                                      "--json", "comparison.json"});
    const Json json = Json::parse(folder.Read("comparison.json"));
    ASSERT_EQ(json["solvers"][0]["solver"], "lm");
    of_lm.push_back(json["solvers"][0]["parameters"]);
  }
  ASSERT_EQ(of_lm[0].size(), 1u);
  EXPECT_GT(of_lm[0][0]["std_error"], 0.0);
  EXPECT_NEAR(of_lm[1][0]["std_error"], of_lm[0][0]["std_error"],
              1e-6 * of_lm[0][0]["std_error"].get<double>());
}

TEST(Compare, SaysWhereOnlineCutsTheRuns) {
  const ProgramFolder folder;
  const ProgramResult result =
      folder.Run(SYSID_COMPARE, kRodAndBob + Arguments{"--online"});
  EXPECT_THAT(result.out,
              AllOf(ContainsRegex("segments of +2 s +2 s +0.2 s"),
                    HasSubstr("gmm: --online cut the runs into 10 rollouts of "
                              "about 0.2 s, with first states from the data")));
}

TEST(Compare, RefusesWhatItCannotUse) {
  const ProgramFolder folder;
  const auto expect = [&](const Arguments& arguments, const std::string& place,
                          const std::string& what, const std::string& hint) {
    ExpectRefused(folder, SYSID_COMPARE, kFigure1 + arguments, place, what,
                  hint);
  };
  expect({"--solver", "lm"}, "--solver", "no meaning here", "all three");
  expect({"--holdout", kDamped}, "--holdout", "no meaning here", "sysid_fit");
  expect({"--loss", "huber"}, "--loss", "no meaning here", "--huber");
  expect({"--truth", "link1.length=0.8"}, "--truth",
         "says nothing of 'link2.length'", "all of");
  expect({"--truth", "link1.lenght=0.8"}, "--truth",
         "'link1.lenght' is not free", "link1.length");
  expect({"--truth", "link1.length,link2.length"}, "--truth", "has no value",
         "link1.length=value");
  expect({"--truth", "link1.length=-1,link2.length=1"}, "--truth",
         "'link1.length' cannot be -1", "between");
  expect({"--repeat", "0"}, "--repeat", "cannot be 0", "between 1");
  expect({"--start_spread", "-1"}, "--start_spread", "cannot be -1", "above 0");
  expect({"--figure", "nowhere/figure.svg"}, "nowhere/figure.svg", "", "");
  expect({"--figure", "figure.png"}, "--figure", "is no .svg",
         "name it figure.svg");
}

TEST(Compare, HelpIsTrue) {
  const ProgramFolder folder;
  ExpectHelp(folder, SYSID_COMPARE, "sysid_compare");
}

}  // namespace
}  // namespace sysid
