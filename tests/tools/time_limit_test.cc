// Every program ends soon after it is told to: after --time, or by Ctrl-C at
// whatever moment. Seconds are those of the processor: two threads that work
// for one second more.

#include <csignal>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/support/running_program.h"
#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

std::string Shipped(const std::string& run) {
  return std::string(SYSID_SOURCE) + "/data/runs/" + run;
}

class TimeLimitTest : public ::testing::Test {
 protected:
  ProgramResult Run(const char* program, const Arguments& arguments) {
    return folder_.Run(program, arguments);
  }
  // That takes for ever.
  static Arguments Endless() {
    return {"--model",  "pendulum3", "--traj",   Shipped("pendulum3.csv"),
            "--solver", "adam",      "--epochs", "1000000"};
  }
  Json Read(const std::string& name) const {
    return Json::parse(folder_.Read(name));
  }

  ProgramFolder folder_;
};

TEST_F(TimeLimitTest, EndsWithTheBestPoint) {
  const ProgramResult fit = Run(
      SYSID_FIT, Endless() + Arguments{"--time", "3", "--json", "fit.json"});
  // Adam has no stages, of which one would be an answer.
  EXPECT_EQ(fit.exit_code, 1);
  const Json json = Read("fit.json");
  EXPECT_EQ(json["stopped"], "time");
  EXPECT_FALSE(json["converged"].get<bool>());
  EXPECT_THAT(json["termination"].get<std::string>(),
              ::testing::StartsWith("out of time (--time 3), interrupted"));
  EXPECT_GT(json["iterations"].get<int>(), 0);
}

TEST_F(TimeLimitTest, SaysWhereThereIsNoPointYet) {
  const ProgramResult fit =
      Run(SYSID_FIT, {"--model", "pendulum3", "--traj",
                      Shipped("pendulum3.csv"), "--time", "1e-3"});
  EXPECT_EQ(fit.exit_code, 1);
  EXPECT_THAT(fit.err, HasSubstr("before there was a first point"));
}

TEST_F(TimeLimitTest, DiagnosesWhatItCan) {
  const ProgramResult found =
      Run(SYSID_DIAGNOSE,
          {"--model", "pendulum3", "--traj", Shipped("pendulum3.csv"), "--auto",
           "--time", "6", "--json", "found.json"});
  const Json json = Read("found.json");
  EXPECT_EQ(found.exit_code, 0);
  if (json["stopped"].is_null()) return;  // a fast machine
  EXPECT_EQ(json["stopped"], "time");
  EXPECT_THAT(json["doubts"].dump(), HasSubstr("out of time (--time 6)"));
  EXPECT_TRUE(json["final"]["cv_error"].is_number());
}

TEST_F(TimeLimitTest, SaysNothingWhereTimeWasEnough) {
  const ProgramResult fit =
      Run(SYSID_FIT, {"--model", "pendulum2_planar", "--traj",
                      Shipped("pendulum2_planar_friction.csv"), "--free",
                      "link1.length", "--time", "300", "--json", "whole.json"});
  EXPECT_EQ(fit.exit_code, 0);
  EXPECT_TRUE(Read("whole.json")["stopped"].is_null());
}

TEST_F(TimeLimitTest, EndsSoonAfterCtrlCAtAnyMoment) {
  constexpr double kSoon = 2.0;  // s of the processor
  constexpr int kMoments = 5;    // of each
  const std::pair<const char*, Arguments> kPrograms[] = {
      {SYSID_FIT, {"--model", "pendulum3", "--traj", Shipped("pendulum3.csv")}},
      {SYSID_DIAGNOSE,
       {"--model", "pendulum3", "--traj", Shipped("pendulum3.csv"), "--auto"}},
      {SYSID_DIAGNOSE,
       {"--model", "pendulum2", "--traj", Shipped("figure1_damped.csv"),
        "--auto"}},
      {SYSID_DIAGNOSE,
       {"--model", "cartpole", "--traj", Shipped("cartpole.csv"), "--auto"}}};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> moment(0.3, 6.0);
  for (const auto& [program, arguments] : kPrograms) {
    for (int i = 0; i < kMoments; ++i) {
      const double cpu_s = moment(random);
      RunningProgram running(folder_, program,
                             arguments + Arguments{"--out", "out"});
      if (!running.WorksFor(cpu_s)) continue;  // it had ended
      const double worked = running.Worked();
      running.Signal(SIGINT);
      SCOPED_TRACE(std::string(program) + " " + arguments[1] + " " +
                   std::to_string(cpu_s));
      EXPECT_FALSE(running.WorksFor(worked + kSoon));
      const int code = running.Await();
      EXPECT_TRUE(code == 0 || code == 1 || code == 128 + SIGINT) << code;
    }
  }
}

}  // namespace
}  // namespace sysid
