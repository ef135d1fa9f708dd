// Sizes from outside that no machine has: refused before they are allocated,
// with the limit.

#include "tests/tools/programs.h"

namespace sysid {
namespace {

class SizesTest : public ::testing::Test {
 protected:
  SizesTest() { SimulateInto(folder_, "run.csv", {"--model", "pendulum1"}); }
  void ExpectFit(const Arguments& arguments, const std::string& place,
                 const std::string& what, const std::string& hint) {
    Arguments all = {"--model", "pendulum1", "--traj", "run.csv"};
    ExpectFitRefused(folder_, all + arguments, place, what, hint);
  }
  void ExpectSimulation(const Arguments& arguments, const std::string& place,
                        const std::string& what, const std::string& hint) {
    ExpectRefused(folder_, SYSID_SIMULATE,
                  arguments + Arguments{"--out_csv", "new.csv"}, place, what,
                  hint);
  }

  ProgramFolder folder_;
};

TEST_F(SizesTest, OfASimulation) {
  const Arguments model{"--model", "pendulum1"};
  const std::string most = "samples; 1e7 are the most";
  ExpectSimulation(model + Arguments{"--duration", "1e12"}, "--duration", most,
                   "shorter");
  ExpectSimulation(model + Arguments{"--rate", "1e12"}, "--duration", most,
                   "lower rate");
  ExpectSimulation(model + Arguments{"--step", "1e-12"}, "--step",
                   "makes more than 1e8 steps", "leave it out");
}

// A chain of `joints` hinges.
std::string ChainOf(int joints) {
  std::string urdf = "<robot name=\"chain\"><link name=\"l0\"/>\n";
  for (int i = 1; i <= joints; ++i) {
    const std::string n = std::to_string(i), m = std::to_string(i - 1);
    urdf += "<link name=\"l" + n +
            "\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" "
            "ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>"
            "<joint name=\"j" +
            n + "\" type=\"continuous\"><parent link=\"l" + m +
            "\"/><child link=\"l" + n + "\"/></joint>\n";
  }
  return urdf + "</robot>\n";
}

TEST_F(SizesTest, OfAModel) {
  folder_.Write("long.urdf", ChainOf(100000));
  ExpectSimulation({"--model", "long.urdf"}, "long.urdf",
                   "100000 joints; 1000 are the most", "leave out what moves");
  folder_.Write("large.urdf", std::string((64 << 20) + (1 << 17), ' '));
  ExpectSimulation({"--model", "large.urdf"}, "large.urdf",
                   "is larger than 64 MiB", "is this the URDF");
  // As many samples as there may be of as many joints as there may be.
  folder_.Write("most.urdf", ChainOf(1000));
  ExpectSimulation(
      {"--model", "most.urdf", "--duration", "1e5", "--rate", "100"},
      "--duration", "and this machine has", "shorter");
}

TEST_F(SizesTest, OfARun) {
  std::string header = "t,joint1.q";
  for (int i = 0; i < 100000; ++i) header += ",c" + std::to_string(i);
  folder_.Write("wide.csv", header + "\n0,1\n");
  ExpectFitRefused(folder_, {"--model", "pendulum1", "--traj", "wide.csv"},
                   "wide.csv:1:10001", "100002 columns; 10000 are the most",
                   "Keep the columns that are used");
}

TEST_F(SizesTest, OfTheWork) {
  ExpectFit({"--threads", "1000000000"}, "--threads",
            "cannot be 1000000000: 1024 are the most", "cores");
  ExpectFit({"--step", "1e-12"}, "--step", "makes more than 1000 steps",
            "leave it out");
}

TEST_F(SizesTest, OfTheThreadsThatMayBeStarted) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer needs the address space";
#endif
  // A stack of 4 GB in 1.5 GB.
  const auto expect = [&](const std::string& threads, const std::string& hint) {
    ExpectRefused(
        folder_, "/bin/sh",
        {"-c", "ulimit -s 4000000; ulimit -v 1500000; exec \"$0\" \"$@\"",
         SYSID_FIT, "--model", "pendulum1", "--traj", "run.csv", "--threads",
         threads},
        "no thread can be started", "Resource temporarily unavailable", hint);
  };
  expect("4", "\n  hint: --threads 1, or allow more: ulimit -u (threads)");
  expect("1", "\n  hint: allow more: ulimit -u (threads), ulimit -v (memory)");
}

#ifdef SYSID_HAVE_STAN
TEST_F(SizesTest, OfAMixture) {
  const Arguments gmm{"--solver", "gmm"};
  ExpectFit(gmm + Arguments{"--kernels", "1000000"}, "--kernels", "cannot be",
            "100");
  ExpectFit(gmm + Arguments{"--draws", "1000000000"}, "--draws", "cannot be",
            "10000");
  ExpectFit(gmm + Arguments{"--epochs", "2000000000"}, "--epochs", "cannot be",
            "1e+06");
  ExpectFit(gmm + Arguments{"--sample", "1000000"}, "--sample", "cannot be",
            "100000");
}
#endif

}  // namespace
}  // namespace sysid
