#include "sysid/fleet/read_fleet.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support/error_text.h"
#include "tests/support/program_folder.h"

namespace sysid {
namespace {

using Json = nlohmann::json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr char kHint[] =
    "\n  hint: sysid_diagnose --out FOLDER and sysid_fit --out FOLDER write it";

Json Parameter(const std::string& name, double value) {
  return {{"name", name},      {"unit", "kg"},      {"value", value},
          {"std_error", 0.01}, {"at_bound", false}, {"identifiable", true}};
}

Json FitOf(double mass) {
  return {{"schema", "sysid.fit/1"},
          {"model", "arm"},
          {"converged", true},
          {"termination", "done"},
          {"parameters", {Parameter("link2.mass", mass)}},
          {"skipped_runs", Json::array()},
          {"error",
           {{"train", {{"normalized_rms", 1.01}}},
            {"holdout", nullptr},
            {"segments", Json::array()}}}};
}

Json DiagnosisOf(const std::string& verdict) {
  Json diagnosis = {
      {"schema", "sysid.diagnosis/1"},
      {"model", "arm"},
      {"verdict", verdict},
      {"interrupted", nullptr},
      {"added", Json::array()},
      {"candidates", Json::array()},
      {"rivals", Json::array()},
      {"skipped_runs", Json::array()},
      {"where",
       {{"segments",
         {{{"trajectory", "run.csv"}, {"t_start", 0.0}, {"t_end", 1.0}}}}}},
      {"final_fit",
       {{"verdict", verdict},
        {"train", {{"normalized_rms", 1.02}}},
        {"holdout", {{"normalized_rms", 1.04}}}}}};
  diagnosis["baseline"] = {{"train", {{"normalized_rms", 3.0}}},
                           {"holdout", {{"normalized_rms", 3.1}}}};
  return diagnosis;
}

class ReadFleetTest : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) const {
    const std::filesystem::path path = folder_.Path(name);
    std::filesystem::create_directories(path.parent_path());
    folder_.Write(name, text);
  }
  void WriteJson(const std::string& name, const Json& json) const {
    Write(name, json.dump());
  }
  std::string At(const std::string& name) const { return folder_.Path(name); }
  std::vector<Robot> Read(const std::string& pattern) const {
    return ReadFleet({At(pattern)});
  }
  std::string Error(const std::string& fits) const {
    return ErrorText([&] { ReadFleet({fits}); });
  }

  ProgramFolder folder_;
};

TEST_F(ReadFleetTest, ARobotHasItsDiagnosisAndTheFitBesideIt) {
  Json diagnosis = DiagnosisOf("missing_effect");
  diagnosis["added"] = {{{"effect", "spring"}, {"target", "joint1"}}};
  diagnosis["skipped_runs"] = {{{"run", "b.csv"}, {"reason", "is empty"}}};
  WriteJson("fleet/r1/diagnosis.json", diagnosis);
  WriteJson("fleet/r1/fit.json", FitOf(1.5));
  const std::vector<Robot> robots = Read("fleet/*/diagnosis.json");
  ASSERT_EQ(robots.size(), 1u);
  const Robot& robot = robots[0];
  EXPECT_EQ(robot.name, "r1");
  EXPECT_EQ(robot.broken, "");
  EXPECT_EQ(robot.verdict, "missing_effect");
  EXPECT_THAT(robot.missing, ElementsAre("spring@joint1"));
  EXPECT_EQ(robot.train, 1.02);
  EXPECT_THAT(robot.skipped_runs, ElementsAre("b.csv: is empty"));
  ASSERT_EQ(robot.parameters.size(), 1u);
  EXPECT_EQ(robot.parameters[0].estimate.value, 1.5);
  EXPECT_EQ(robot.parameters[0].unusable, "");
  EXPECT_EQ(robot.not_compared, "");
  EXPECT_FALSE(robot.recorded);
}

TEST_F(ReadFleetTest, WithoutAutoTheConfirmedCandidateIsMissing) {
  Json diagnosis = DiagnosisOf("missing_effect");
  const Json refused = {{"effect", "armature"},
                        {"target", "joint1"},
                        {"confirmed", {{"accepted", false}}}};
  const Json accepted = {{"effect", "spring"},
                         {"target", "joint2"},
                         {"confirmed", {{"accepted", true}}}};
  diagnosis["candidates"] = {refused, accepted};
  diagnosis["final_fit"] = nullptr;
  WriteJson("fleet/r1/diagnosis.json", diagnosis);
  const Robot robot = Read("fleet/*/diagnosis.json")[0];
  EXPECT_THAT(robot.missing, ElementsAre("spring@joint2"));
  EXPECT_EQ(robot.train, 3.0);
  EXPECT_EQ(robot.not_compared, "there is no fit.json beside its diagnosis");
}

TEST_F(ReadFleetTest, AFitAloneHasParametersAndNoVerdict) {
  WriteJson("fleet/r1/diagnosis.json", DiagnosisOf("adequate"));
  Json fit = FitOf(2.0);
  fit["added"] = {{"effects", {"spring@joint1"}}};
  WriteJson("fleet/r2/fit.json", fit);
  const std::vector<Robot> robots = Read("fleet/*/diagnosis.json");
  ASSERT_EQ(robots.size(), 2u);
  EXPECT_EQ(robots[1].verdict, "");
  EXPECT_THAT(robots[1].missing, ElementsAre("spring@joint1"));
  EXPECT_EQ(robots[1].parameters.size(), 1u);
}

TEST_F(ReadFleetTest, EstimatesThatMeanNothingAreNotCompared) {
  Json fit = FitOf(2.0);
  Json at_bound = Parameter("a", 1), unknown = Parameter("b", 1),
       without = Parameter("c", 1);
  at_bound["at_bound"] = true;
  unknown["identifiable"] = false;
  unknown["std_error"] = nullptr;
  without["std_error"] = nullptr;
  fit["parameters"] = {at_bound, unknown, without};
  WriteJson("fleet/r1/fit.json", fit);
  fit["converged"] = false;
  WriteJson("fleet/r2/fit.json", fit);
  WriteJson("fleet/r3/diagnosis.json", DiagnosisOf("unexplained"));
  WriteJson("fleet/r3/fit.json", FitOf(2.0));
  const std::vector<Robot> robots = Read("fleet/*/fit.json");
  EXPECT_EQ(robots[0].parameters[0].unusable, "at a bound");
  EXPECT_EQ(robots[0].parameters[1].unusable, "not identifiable");
  EXPECT_EQ(robots[0].parameters[2].unusable, "without a standard error");
  EXPECT_EQ(robots[1].not_compared, "the fit has not converged: done");
  EXPECT_EQ(Read("fleet/r[3]/diagnosis.json")[0].not_compared,
            "the verdict is unexplained");
}

TEST_F(ReadFleetTest, ABrokenRobotIsNamedWithTheReason) {
  WriteJson("fleet/good/diagnosis.json", DiagnosisOf("adequate"));
  Write("fleet/r1/other.txt", "");
  Write("fleet/r2/error.txt",
        "note: x\nerror: run.csv:3:2: 'x' is not a number\n  hint: y\n");
  Write("fleet/r3/diagnosis.json", "{\"schema\": \"sysid.dia");
  Json diagnosis = DiagnosisOf("adequate");
  diagnosis["added"] = 3;
  WriteJson("fleet/r4/diagnosis.json", diagnosis);
  diagnosis.erase("verdict");
  WriteJson("fleet/r5/diagnosis.json", diagnosis);
  diagnosis["schema"] = "sysid.check/1";
  WriteJson("fleet/r6/diagnosis.json", diagnosis);
  Write("fleet/r7/diagnosis.json", "");
  Json twice = FitOf(2.0);
  twice["parameters"].push_back(Parameter("link2.mass", 2.0));
  WriteJson("fleet/r8/diagnosis.json", DiagnosisOf("adequate"));
  WriteJson("fleet/r8/fit.json", twice);
  const std::vector<Robot> robots = Read("fleet/*/diagnosis.json");
  ASSERT_EQ(robots.size(), 9u);
  const auto at = [&](const std::string& robot) {
    return At("fleet/" + robot + "/diagnosis.json");
  };
  EXPECT_EQ(robots[0].broken, "");
  EXPECT_EQ(robots[1].name, "r1");
  EXPECT_EQ(robots[1].broken, "has no diagnosis.json and no fit.json");
  EXPECT_EQ(robots[2].broken, "run.csv:3:2: 'x' is not a number");
  EXPECT_EQ(robots[3].broken, at("r3") + ": is no JSON; is it cut off?");
  EXPECT_EQ(robots[4].broken, at("r4") + ": key added is no list");
  EXPECT_EQ(robots[5].broken, at("r5") + ": key verdict is missing");
  EXPECT_EQ(robots[6].broken,
            at("r6") +
                ": key schema is 'sysid.check/1', not sysid.diagnosis/1 or "
                "sysid.fit/1");
  EXPECT_EQ(robots[7].broken, at("r7") + ": cannot be read, or is empty");
  EXPECT_EQ(robots[8].broken,
            At("fleet/r8/fit.json") + ": has the parameter 'link2.mass' twice");
}

TEST_F(ReadFleetTest, AFileThatIsNamedMustBeGood) {
  EXPECT_EQ(Error(At("no/fit.json")),
            At("no/fit.json") + ": there is no such file" + kHint);
  EXPECT_EQ(Error(At(".")),
            At(".") + ": is a folder, not a file\n  hint: name the file in it");
  Json fit = FitOf(1.0);
  fit["parameters"][0]["value"] = "heavy";
  WriteJson("fleet/r1/fit.json", fit);
  EXPECT_EQ(Error(At("fleet/r1/fit.json")),
            At("fleet/r1/fit.json") + ": key parameters[0].value is no number" +
                kHint);
}

TEST_F(ReadFleetTest, AFleetWithoutAGoodRobotIsAnError) {
  EXPECT_EQ(Error("nowhere/*/fit.json"),
            "--fits: no folder matches 'nowhere/*/fit.json'\n  hint: name the "
            "results of each robot, in a folder each: --fits "
            "'fleet/*/diagnosis.json'");
  Write("fleet/r1/other.txt", "");
  EXPECT_EQ(Error(At("fleet/*/fit.json")),
            std::string("--fits: no robot is left: each of 1 is broken; r1: "
                        "has no fit.json") +
                kHint);
}

TEST_F(ReadFleetTest, RobotsOfOneNameAreToldApart) {
  WriteJson("north/r1/fit.json", FitOf(1.0));
  WriteJson("south/r1/fit.json", FitOf(1.0));
  WriteJson("south/r2/fit.json", FitOf(1.0));
  const std::vector<Robot> robots = Read("*/*/fit.json");
  EXPECT_EQ(robots[0].name, At("north/r1"));
  EXPECT_EQ(robots[1].name, At("south/r1"));
  EXPECT_EQ(robots[2].name, "r2");
}

TEST_F(ReadFleetTest, TheDateIsThatOfTheTimesTheRecordingOrTheFolder) {
  Json diagnosis = DiagnosisOf("adequate");
  Json& segment = diagnosis["where"]["segments"][0];
  WriteJson("fleet/2026-03-01/diagnosis.json", diagnosis);
  segment["trajectory"] = "runs/20260215_a.csv";
  WriteJson("fleet/2026-03-02/diagnosis.json", diagnosis);
  segment["t_start"] = 1767225600.0;  // 2026-01-01
  WriteJson("fleet/2026-03-03/diagnosis.json", diagnosis);
  const std::vector<Robot> robots = Read("fleet/*/diagnosis.json");
  EXPECT_EQ(robots[0].recorded_from, "folder");
  EXPECT_EQ(DateText(*robots[0].recorded), "2026-03-01");
  EXPECT_EQ(robots[1].recorded_from, "recording");
  EXPECT_EQ(DateText(*robots[1].recorded), "2026-02-15");
  EXPECT_EQ(robots[2].recorded_from, "times");
  EXPECT_EQ(DateText(*robots[2].recorded), "2026-01-01");
}

TEST(DateIn, ReadsDatesAndNoOtherNumbers) {
  EXPECT_EQ(DateIn("1970-01-02"), 86400.0);
  EXPECT_EQ(DateIn("a/run_20260101.csv"), 1767225600.0);
  EXPECT_EQ(DateIn("x2026-01-01T10"), 1767225600.0);
  for (const char* const none :
       {"", "2026-13-01", "202601011", "2026-1-1", "12026-01-01", "99999999",
        "2026-0101", "run_12345678"}) {
    EXPECT_FALSE(DateIn(none)) << none;
  }
}

}  // namespace
}  // namespace sysid
