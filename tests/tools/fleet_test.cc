// sysid_fleet on the results of real programs.

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

using Json = nlohmann::json;
using ::testing::HasSubstr;

TEST(FleetTest, ReadsWhatTheProgramsWrite) {
  const ProgramFolder folder;
  for (const char* const name : {"r1", "r2", "r3"}) {
    const std::string run = std::string(name) + ".csv";
    SimulateInto(folder, run,
                 {"--model", "pendulum2_planar", "--duration", "3", "--rate",
                  "50", "--seed", name + 1});
    Arguments arguments{
        "--model", "pendulum2_planar", "--traj", run,
        "--free",  "link2.mass",       "--out",  std::string("fleet/") + name};
    const bool diagnosed = name[1] != '3';
    if (diagnosed) {
      arguments = arguments + Arguments{"--candidates", "viscous_damping"};
    }
    const ProgramResult result =
        folder.Run(diagnosed ? SYSID_DIAGNOSE : SYSID_FIT, arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  std::filesystem::create_directories(folder.Path("fleet/r4"));
  const ProgramResult result = folder.Run(
      SYSID_FLEET, {"--fits", "fleet/*/diagnosis.json", "--out", "table"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              HasSubstr("4 robots: adequate 2, fitted 1, broken 1\n"));
  EXPECT_THAT(result.out,
              HasSubstr("  r4: has no diagnosis.json and no fit.json\n"));
  const Json json = Json::parse(folder.Read("table/fleet.json"));
  EXPECT_EQ(json["parameters"][0]["all"]["robots"], 3);
  EXPECT_THAT(folder.Read("table/fleet.html"), HasSubstr("<svg"));
  const ProgramResult printed = folder.Run(
      SYSID_FLEET, {"--fits", "fleet/*/diagnosis.json", "--json", "-"});
  EXPECT_EQ(Json::parse(printed.out), json);
}

TEST(FleetTest, RefusesBadInput) {
  const ProgramFolder folder;
  ExpectRefused(folder, SYSID_FLEET, {}, "--fits", "is missing",
                "name the results of each robot");
  ExpectRefused(folder, SYSID_FLEET, {"--fits", "a,,b"}, "--fits",
                "has an empty entry", "single commas");
  ExpectRefused(folder, SYSID_FLEET, {"--fits", "fleet/*/diagnosis.json"},
                "--fits", "no folder matches 'fleet/*/diagnosis.json'",
                "name the results of each robot");
  ExpectRefused(folder, SYSID_FLEET, {"--fits", "fit.json", "--out", "table"},
                "fit.json", "there is no such file", "sysid_fit --out FOLDER");
  folder.Write("fit.json", R"({"schema": "sysid.fit/1", "model": 3})");
  ExpectRefused(folder, SYSID_FLEET, {"--fits", "fit.json"}, "fit.json",
                "key model is no text", "sysid_fit --out FOLDER");
  SimulateInto(folder, "run.csv", {"--model", "pendulum1", "--duration", "1"});
  const ProgramResult fit =
      folder.Run(SYSID_FIT, {"--model", "pendulum1", "--traj", "run.csv",
                             "--check", "none", "--out", "r1"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  ExpectRefused(folder, SYSID_FLEET, {"--fits", "r1/fit.json,r1/fit.json"},
                "--fits", "'r1/fit.json' is named twice",
                "give each robot once");
}

TEST(FleetTest, HasHelp) {
  const ProgramFolder folder;
  const ProgramResult help = folder.Run(SYSID_FLEET, {"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out,
              HasSubstr("sysid_fleet --fits 'fleet/*/diagnosis.json'"));
}

}  // namespace
}  // namespace sysid
