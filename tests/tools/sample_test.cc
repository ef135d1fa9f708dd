// sysid_fit --sample as its users run it: draws from the distribution of the
// estimate (stochastic_test.cc: from the mixture).

#include <nlohmann/json.hpp>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using Json = nlohmann::json;

const Arguments kLengths{
    "--model", "pendulum2_planar",          "--traj",  "run.csv",
    "--free",  "link1.length,link2.length", "--check", "none"};

class SampleTest : public ::testing::Test {
 protected:
  ProgramResult Fit(const Arguments& arguments, const std::string& count,
                    const std::string& out) {
    return folder_.Run(SYSID_FIT,
                       arguments + Arguments{"--sample", count, "--out", out});
  }

  // Rows of samples.csv, without the number of the draw.
  std::vector<std::vector<double>> Draws(const std::string& out) {
    std::istringstream lines(folder_.Read(out + "/samples.csv"));
    std::string line, cell;
    std::getline(lines, line);
    std::vector<std::vector<double>> draws;
    while (std::getline(lines, line)) {
      std::istringstream cells(line);
      std::getline(cells, cell, ',');
      EXPECT_EQ(cell, std::to_string(draws.size() + 1));
      draws.emplace_back();
      while (std::getline(cells, cell, ',')) {
        draws.back().push_back(std::stod(cell));
      }
    }
    return draws;
  }

  // That these are the draws' values, within eight standard errors.
  void ExpectAboutTheEstimate(const std::string& out) {
    const Json fit = Json::parse(folder_.Read(out + "/fit.json"));
    for (const std::vector<double>& draw : Draws(out)) {
      ASSERT_EQ(draw.size(), fit["parameters"].size());
      for (size_t i = 0; i < draw.size(); ++i) {
        const Json& p = fit["parameters"][i];
        EXPECT_NE(draw[i], p["value"].get<double>());
        EXPECT_NEAR(draw[i], p["value"], 8.0 * p["std_error"].get<double>());
      }
    }
  }

  ProgramFolder folder_;
};

TEST_F(SampleTest, DrawsFromTheEstimateOfLevenbergMarquardt) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum2_planar"});
  const ProgramResult result = Fit(kLengths, "3", "a");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("samples.csv, sample_1.urdf to sample_3.urdf\n"),
                    Not(HasSubstr("in all samples"))));
  EXPECT_THAT(folder_.Read("a/samples.csv"),
              StartsWith("sample,link1.length,link2.length\n1,0."));
  ASSERT_EQ(Draws("a").size(), 3u);
  ExpectAboutTheEstimate("a");
  // XML comments may not have two hyphens.
  const std::string urdf = folder_.Read("a/sample_2.urdf");
  EXPECT_THAT(urdf, HasSubstr("draw 2 of 3 from the normal distribution of the "
                              "estimate that sysid_fit - -solver lm identified "
                              "for pendulum2_planar"));
  SimulateInto(folder_, "drawn.csv",
               {"--model", "a/sample_2.urdf", "--duration", "0.1"});
  // The same seed, the same bytes; another one, others.
  EXPECT_EQ(Fit(kLengths, "3", "b").exit_code, 0);
  EXPECT_EQ(folder_.Read("a/samples.csv"), folder_.Read("b/samples.csv"));
  EXPECT_EQ(urdf, folder_.Read("b/sample_2.urdf"));
  EXPECT_EQ(Fit(kLengths + Arguments{"--seed", "2"}, "3", "c").exit_code, 0);
  EXPECT_NE(folder_.Read("a/samples.csv"), folder_.Read("c/samples.csv"));
}

TEST_F(SampleTest, DrawsFromTheEstimateOfInverseDynamics) {
  folder_.Write("rods.urdf", kRods);
  SimulateInto(folder_, "run.csv",
               {"--model", "rods.urdf", "--excite", "multisine", "--rate",
                "200", "--noise", "1e-5"});
  const Arguments fit{"--model",  "rods.urdf",
                      "--traj",   "run.csv",
                      "--free",   "link1.mass,link2.mass,link2.iyy",
                      "--solver", "inverse_dynamics",
                      "--check",  "none"};
  const ProgramResult result = Fit(fit, "2", "a");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              HasSubstr("samples.csv, sample_1.urdf to sample_2.urdf\n"));
  EXPECT_THAT(folder_.Read("a/samples.csv"),
              StartsWith("sample,link1.mass,link2.mass,link2.iyy\n1,"));
  ASSERT_EQ(Draws("a").size(), 2u);
  ExpectAboutTheEstimate("a");
  EXPECT_THAT(folder_.Read("a/sample_1.urdf"),
              HasSubstr("- -solver inverse_dynamics identified"));
  EXPECT_EQ(Fit(fit, "2", "b").exit_code, 0);
  for (const char* name : {"/samples.csv", "/sample_1.urdf"}) {
    EXPECT_EQ(folder_.Read(std::string("a") + name),
              folder_.Read(std::string("b") + name));
  }
}

TEST_F(SampleTest, SaysWhichCombinationsItHolds) {
  const ProgramResult result =
      Fit({"--model", "rod_and_bob", "--traj",
           std::string(SYSID_SOURCE) + "/data/runs/rod_and_bob.csv", "--noise",
           "1e-3", "--check", "none"},
          "4", "a");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string remark =
      "rod.length, bob.com_z are not separately identifiable from this data: "
      "the combinations that the data do not determine are in all samples as "
      "estimated";
  EXPECT_THAT(result.out, HasSubstr("  " + remark + "\n"));
  EXPECT_THAT(folder_.Read("a/sample_4.urdf"), HasSubstr(remark));
  // The distance of the bob is what shows, to a part of it; its two parts do
  // not wander along the valley, which is metres long.
  const std::vector<std::vector<double>> draws = Draws("a");
  ASSERT_EQ(draws.size(), 4u);
  EXPECT_NE(draws[0], draws[1]);
  for (const std::vector<double>& draw : draws) {
    EXPECT_NEAR(draw[0], draws[0][0], 0.02);
    EXPECT_NEAR(draw[1], draws[0][1], 0.02);
  }
}

TEST_F(SampleTest, SaysWhyThereAreNone) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum1", "--seed", "2"});
  const ProgramResult result = Fit({"--model", "pendulum1", "--traj", "run.csv",
                                    "--free", "link1.mass", "--check", "none"},
                                   "2", "a");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out,
              HasSubstr("link1.mass is not identifiable from this data"));
  EXPECT_THAT(result.out, Not(HasSubstr("samples.csv")));
  EXPECT_THAT(result.err,
              HasSubstr("error: no samples: no free parameter has a variance: "
                        "the data identify none of them, or each is at a "
                        "bound\n"));
  EXPECT_TRUE(folder_.Has("a/identified.urdf"));
  EXPECT_FALSE(folder_.Has("a/samples.csv"));
  EXPECT_FALSE(folder_.Has("a/sample_1.urdf"));
}

TEST_F(SampleTest, RefusesWhereThereIsNothingToDrawOrNowhereToWrite) {
  SimulateInto(folder_, "run.csv", {"--model", "pendulum2_planar"});
  for (const char* solver : {"lm", "inverse_dynamics"}) {
    ExpectRefused(folder_, SYSID_FIT,
                  {"--model", "pendulum2_planar", "--traj", "run.csv", "--free",
                   "none", "--solver", solver, "--sample", "2", "--out", "a"},
                  "--sample", "has nothing to draw: nothing is free", "--free");
    ExpectRefused(folder_, SYSID_FIT,
                  kLengths + Arguments{"--solver", solver, "--sample", "2"},
                  "--sample", "has nowhere to write to", "--out DIR");
  }
}

}  // namespace
}  // namespace sysid
