#include "sysid/fleet/fleet.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

namespace sysid {
namespace {

using Json = nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Twenty robots that differ in mass: the third weighs more, the fifth misses
// friction, the seventh is broken. Damping rises from year to year.
std::vector<Robot> Robots() {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<Robot> robots(20);
  for (size_t i = 0; i < robots.size(); ++i) {
    Robot& robot = robots[i];
    robot.name = "r" + std::to_string(i + 1);
    robot.file = robot.name + "/diagnosis.json";
    robot.model = "arm";
    robot.verdict = robot.final_verdict = "adequate";
    robot.train = robot.holdout = 1.0;
    robot.recorded = 1.6e9 + 31557600.0 * static_cast<double>(i) / 4;
    robot.recorded_from = "times";
    const double years = static_cast<double>(i) / 4;
    robot.parameters = {
        {"link2.mass", "kg", {2.0 + 0.03 * normal(random), 0.01}, ""},
        {"joint1.damping",
         "N m s",
         {0.1 + 0.02 * years + 0.001 * normal(random), 0.001},
         ""}};
  }
  robots[2].parameters[0].estimate.value = 2.6;
  robots[4].verdict = "missing_effect";
  robots[4].missing = {"coulomb_friction@joint1"};
  robots[6].broken = "run.csv:3:2: '<x>' is not a number";
  robots[6].parameters.clear();
  robots[8].verdict = "undecided";
  robots[8].rivals = {{"spring@joint1", "a@b"}, {"armature@joint1", "a@b"}};
  robots[9].parameters[1].unusable = "at a bound";
  robots[10].not_compared = "the fit has not converged: x";
  robots[11].skipped_runs = {"b.csv: is empty"};
  return robots;
}

TEST(AnalyseFleet, SaysWhatEachRobotMisses) {
  const Fleet fleet = AnalyseFleet(Robots());
  EXPECT_EQ(VerdictCounts(fleet),
            "adequate 17, missing_effect 1, undecided 1, broken 1");
  ASSERT_EQ(fleet.effects.size(), 3u);
  EXPECT_EQ(fleet.effects[0].name, "coulomb_friction@joint1");
  EXPECT_THAT(fleet.effects[0].robots, ElementsAre("r5"));
  EXPECT_THAT(fleet.effects[1].robots, IsEmpty());
  EXPECT_THAT(fleet.effects[1].rival_of, ElementsAre("r9"));
}

TEST(AnalyseFleet, NamesTheOutlierAndNoOther) {
  const Fleet fleet = AnalyseFleet(Robots());
  for (size_t i = 0; i < fleet.robots.size(); ++i) {
    if (i == 2) {
      EXPECT_THAT(OutliersOf(fleet, i), ElementsAre("link2.mass"));
    } else {
      EXPECT_THAT(OutliersOf(fleet, i), IsEmpty()) << i;
    }
  }
  const FleetParameter& mass = fleet.parameters[0];
  EXPECT_EQ(mass.all.count, 18);
  EXPECT_EQ(mass.without_outliers.count, 17);
  EXPECT_NEAR(mass.without_outliers.mean, 2.0,
              4 * mass.without_outliers.std_error);
  EXPECT_NEAR(std::sqrt(mass.without_outliers.tau2), 0.03, 0.015);
  EXPECT_EQ(fleet.tests, 18 + 17);
  EXPECT_THAT(
      fleet.parameters[1].left_out,
      ElementsAre("r10: at a bound", "r11: the fit has not converged: x"));
}

TEST(AnalyseFleet, ComparesWhatHasTheSameUnit) {
  std::vector<Robot> robots = Robots();
  robots[1].parameters[0].unit = "g";
  const FleetParameter mass = AnalyseFleet(robots).parameters[0];
  EXPECT_EQ(mass.unit, "kg");
  EXPECT_EQ(mass.all.count, 17);
  EXPECT_THAT(mass.left_out, ::testing::Contains("r2: in g, not kg"));
}

TEST(AnalyseFleet, FindsTheDriftOverTheYears) {
  const Fleet fleet = AnalyseFleet(Robots());
  EXPECT_FALSE(fleet.parameters[0].drift_significant);
  ASSERT_TRUE(fleet.parameters[1].drift);
  EXPECT_TRUE(fleet.parameters[1].drift_significant);
  EXPECT_NEAR(fleet.parameters[1].drift->slope, 0.02,
              4 * fleet.parameters[1].drift->std_error);
  std::vector<Robot> same = Robots();
  for (Robot& robot : same) robot.recorded = 1.6e9;
  EXPECT_FALSE(AnalyseFleet(same).parameters[1].drift);
  for (Robot& robot : same) robot.recorded.reset();
  EXPECT_FALSE(AnalyseFleet(same).parameters[1].drift);
}

TEST(FleetJson, HasAllOfIt) {
  const Json json = Json::parse(FleetJson(AnalyseFleet(Robots())));
  EXPECT_EQ(json["schema"], "sysid.fleet/1");
  EXPECT_EQ(json["robots"].size(), 20u);
  EXPECT_EQ(json["robots"][6]["status"], "broken");
  EXPECT_EQ(json["robots"][6]["reason"], "run.csv:3:2: '<x>' is not a number");
  EXPECT_EQ(json["robots"][6]["train"], nullptr);
  EXPECT_EQ(json["robots"][2]["outlier_in"], Json({"link2.mass"}));
  EXPECT_EQ(json["robots"][0]["recorded"], "2020-09-13");
  EXPECT_EQ(json["effects"][0]["robots"], Json({"r5"}));
  ASSERT_EQ(json["outliers"].size(), 1u);
  EXPECT_EQ(json["outliers"][0]["robot"], "r3");
  EXPECT_LT(json["outliers"][0]["p_corrected"], 0.01);
  EXPECT_EQ(json["level"], 0.01);
  const Json& mass = json["parameters"][0];
  EXPECT_EQ(mass["estimates"].size(), 18u);
  EXPECT_GT(mass["all"]["tau"], mass["without_outliers"]["tau"]);
  EXPECT_TRUE(json["parameters"][1]["drift"]["significant"]);
}

TEST(FleetText, SaysItInWords) {
  const std::string text = FleetText(AnalyseFleet(Robots()), false);
  EXPECT_THAT(
      text,
      HasSubstr("20 robots: adequate 17, missing_effect 1, undecided 1, broken "
                "1\n\nbroken recordings and results\n  r7: run.csv:3:2: '<x>' "
                "is not a number\n  r12: without its run b.csv: is empty\n\n"
                "missing effects\n  coulomb_friction@joint1: 1 robot: r5\n  "
                "spring@joint1: undecided in r9\n  armature@joint1: undecided "
                "in r9\n\noutliers\n  r3: link2.mass 2.6"));
  EXPECT_THAT(text, HasSubstr("\ndrift over the dates\n  joint1.damping +0.0"));
  EXPECT_THAT(text, HasSubstr(" N m s a year\n"));
}

TEST(FleetText, SaysThatNothingIsWrong) {
  std::vector<Robot> robots = Robots();
  robots.resize(2);
  const std::string text = FleetText(AnalyseFleet(robots), false);
  EXPECT_THAT(text, HasSubstr("2 robots: adequate 2\n\nno effect is missing in "
                              "any robot\n\nno robot is an outlier\n"));
  EXPECT_THAT(text, Not(HasSubstr("drift")));
}

TEST(FleetHtml, IsOneFileThatShowsTextOfFilesAsText) {
  const std::string html = FleetHtml(AnalyseFleet(Robots()));
  EXPECT_THAT(html, HasSubstr("<!doctype html>"));
  EXPECT_THAT(html, HasSubstr("r7: run.csv:3:2: '&lt;x&gt;' is not a number"));
  EXPECT_THAT(html, Not(HasSubstr("<x>")));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("src=")));
  EXPECT_THAT(html, HasSubstr("<svg"));
}

}  // namespace
}  // namespace sysid
