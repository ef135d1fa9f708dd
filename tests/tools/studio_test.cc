// sysid_studio as its users run it: the address, Ctrl-C, and what it refuses.
// SYSID_STUDIO is the program's file; what it serves tests/sysid/studio tests.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "tests/support/running_program.h"
#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;
using Json = nlohmann::json;

int PortOf(const std::string& address) {
  return std::stoi(address.substr(address.rfind(':') + 1));
}

// Whether somebody listens there.
bool Answers(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  const bool connected =
      connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  close(fd);
  return connected;
}

class StudioTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ProgramFolder;
    for (const std::string seed : {"1", "2"}) {
      SimulateInto(*folder_, seed + ".csv",
                   {"--model", "pendulum2_planar", "--duration", "4", "--seed",
                    seed, "--add", "viscous_damping@joint1=0.05"});
    }
  }
  static void TearDownTestSuite() { delete folder_; }

  static Arguments Damped() {
    return {"--model", "pendulum2_planar", "--traj",
            "1.csv",   "--holdout",        "2.csv"};
  }
  static ProgramFolder* folder_;
};

ProgramFolder* StudioTest::folder_ = nullptr;

TEST_F(StudioTest, SaysItsAddressAndEndsByCtrlC) {
  for (const int signal : {SIGINT, SIGTERM}) {
    RunningProgram studio(*folder_, SYSID_STUDIO,
                          Damped() + Arguments{"--port", "0"});
    const std::string address = studio.Line();
    ASSERT_THAT(address, MatchesRegex("http://127\\.0\\.0\\.1:[0-9]+/"));
    EXPECT_TRUE(Answers(PortOf(address)));
    EXPECT_EQ(studio.End(signal), 0);  // in the middle of the first fit
    EXPECT_FALSE(Answers(PortOf(address)));
  }
}

TEST_F(StudioTest, SavesWhatWasDone) {
  const Arguments arguments =
      Damped() + Arguments{"--port", "0", "--out", "session"};
  for (int i = 0; i < 2; ++i) {  // and continues there
    RunningProgram studio(*folder_, SYSID_STUDIO, arguments);
    EXPECT_NE(studio.Line(), "");
    EXPECT_EQ(studio.End(SIGINT), 0);
    const Json index = Json::parse(folder_->Read("session/studio.json"));
    EXPECT_EQ(index["schema"], "sysid.studio/1");
  }
  ExpectRefused(*folder_, SYSID_STUDIO,
                {"--model", "pendulum2_planar", "--traj", "2.csv", "--port",
                 "0", "--out", "session"},
                "session/studio.json", "is a session of other runs: 1.csv",
                "--out");
}

TEST_F(StudioTest, NamesAFreePortWhereOneIsInUse) {
  RunningProgram studio(*folder_, SYSID_STUDIO,
                        Damped() + Arguments{"--port", "0"});
  const std::string port = std::to_string(PortOf(studio.Line()));
  ExpectRefused(*folder_, SYSID_STUDIO,
                Damped() + Arguments{"--port", port, "--out", "refused"},
                "--port", "port " + port + " cannot be had", " is free");
  EXPECT_EQ(studio.End(SIGINT), 0);
}

TEST_F(StudioTest, RefusesBadInput) {
  const auto refused = [&](const Arguments& arguments, const std::string& place,
                           const std::string& what, const std::string& hint) {
    ExpectRefused(*folder_, SYSID_STUDIO,
                  arguments + Arguments{"--out", "refused"}, place, what, hint);
  };
  refused({"--traj", "1.csv"}, "--model", "is missing", "pendulum1");
  refused({"--model", "pendulum2_planar", "--traj", "none.csv"}, "none.csv", "",
          "");
  refused(Damped() + Arguments{"--port", "x"}, "--port", "cannot be 'x'",
          "a whole number");
  refused(Damped() + Arguments{"--port", "70000"}, "--port", "cannot be had",
          "is free");
  refused(Damped() + Arguments{"--candidates", "frictoin"}, "--candidates",
          "unknown effect 'frictoin'", "");
  // Whose hint names no flag that is refused, too.
  const ProgramResult automatic =
      folder_->Run(SYSID_STUDIO, Damped() + Arguments{"--auto"});
  EXPECT_EQ(automatic.exit_code, 2);
  EXPECT_THAT(automatic.err,
              AllOf(HasSubstr("--auto: unknown flag"), HasSubstr("candidates"),
                    Not(HasSubstr("json")), Not(HasSubstr("solver"))));
  refused(Damped() + Arguments{"--json", "a.json"}, "--json", "is nothing",
          "--out");
}

TEST_F(StudioTest, HelpFitsOneScreen) {
  const ProgramResult help = folder_->Run(SYSID_STUDIO, {"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_EQ(help.err, "");
  std::istringstream lines(help.out);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    EXPECT_LE(line.size(), 80u) << line;
  }
  EXPECT_LE(count, 40);
  EXPECT_THAT(help.out, HasSubstr("\n  sysid_studio --model "));
}

}  // namespace
}  // namespace sysid
