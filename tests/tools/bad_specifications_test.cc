// Specifications that cannot be used, each by its message.

#include "tests/tools/programs.h"

namespace sysid {
namespace {

class BadSpecificationsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ProgramFolder;
    SimulateInto(*folder_, "run.csv",
                 {"--model", "pendulum1", "--duration", "1"});
  }
  static void TearDownTestSuite() { delete folder_; }

  void ExpectSpec(const std::string& yaml, const std::string& place,
                  const std::string& what, const std::string& hint,
                  const Arguments& more = {}) {
    folder_->Write("fit.yaml", yaml);
    ExpectFitRefused(*folder_,
                     Arguments{"--model", "pendulum1", "--traj", "run.csv",
                               "--spec", "fit.yaml"} +
                         more,
                     place, what, hint);
  }

  static ProgramFolder* folder_;
};

ProgramFolder* BadSpecificationsTest::folder_ = nullptr;

TEST_F(BadSpecificationsTest, AMissingFileAndAFolder) {
  const Arguments fit{"--model", "pendulum1", "--traj", "run.csv", "--spec"};
  ExpectFitRefused(*folder_, fit + Arguments{"nowhere.yaml"}, "nowhere.yaml",
                   "there is no such file", "check the name");
  ExpectFitRefused(*folder_, fit + Arguments{"."}, ".",
                   "is a folder, not a file", "name a file in it");
}

TEST_F(BadSpecificationsTest, NoYaml) {
  ExpectSpec("free: [link1.length\n", "fit.yaml:1:20", "is not YAML",
             "brackets and quotes must be closed");
}

TEST_F(BadSpecificationsTest, UnknownKeys) {
  ExpectSpec("fre: {}\n", "fit.yaml:1:1",
             "unknown key 'fre' in the specification", "did you mean 'free'?");
  ExpectSpec("free:\n  link1.length: {inital: 1}\n", "fit.yaml:2:18",
             "unknown key 'inital' in link1.length", "did you mean 'initial'?");
}

TEST_F(BadSpecificationsTest, UnknownParameters) {
  ExpectSpec("free: {link1.lenght: {}}\n", "fit.yaml:1:8",
             "unknown parameter 'link1.lenght'",
             "did you mean 'link1.length'?");
  ExpectSpec("free: [link1.length]\nfix: {link1.mss: 1}\n", "fit.yaml:2:7",
             "unknown parameter 'link1.mss'", "did you mean 'link1.mass'?");
}

TEST_F(BadSpecificationsTest, EffectsThatDoNotExist) {
  ExpectSpec("effects: [viscous_dampng@joint1]\n", "fit.yaml:1:11",
             "unknown effect 'viscous_dampng'",
             "did you mean 'viscous_damping'?");
  ExpectSpec("effects: [viscous_damping@joint7]\n", "fit.yaml:1:11",
             "unknown target 'joint7'", "did you mean 'joint1'?");
}

TEST_F(BadSpecificationsTest, BoundsThatExcludeTheStart) {
  ExpectSpec("free: {link1.length: {initial: 0.5, lower: 1}}\n",
             "fit.yaml:1:22",
             "the bounds of link1.length exclude its start: initial 0.5 is "
             "below lower 1",
             "widen the bounds");
  // The model's own value is the start.
  ExpectSpec("free: {link1.length: {upper: 0.1}}\n", "fit.yaml:1:8",
             "'link1.length' starts at 0.5 outside its bounds",
             "widen the bounds");
  ExpectSpec("free: {link1.length: {lower: 1}}\n", "--free",
             "'link1.length' starts at 0.2 outside its bounds [1, inf] m",
             "widen the bounds", {"--free", "link1.length=0.2"});
}

TEST_F(BadSpecificationsTest, FreeAndFixed) {
  ExpectSpec("free: [link1.length]\nfix: {link1.length: 1}\n", "fit.yaml:2:7",
             "'link1.length' is both free and fixed", "keep one of them");
}

TEST_F(BadSpecificationsTest, ValuesThatCannotBe) {
  ExpectSpec("free: [link1.length]\nfix: {link1.mass: -1}\n", "fit.yaml:2:7",
             "'link1.mass' cannot be -1 kg", "it lies between");
  ExpectSpec("free: [link1.length]\nnoise: 1e-300\n", "fit.yaml:2:8",
             "cannot be 1e-300", "standard deviation of a measurement");
  ExpectSpec("free: [link1.length]\nstep: 1e-9\n", "fit.yaml:2:7",
             "makes more than 1000 steps from one sample of run.csv",
             "leave it out");
}

TEST_F(BadSpecificationsTest, WhatThisBuildDoesNotHave) {
  ExpectSpec("free: [link1.length]\nsolver: adm\n", "fit.yaml:2:9", "'adm'",
             "did you mean 'adam'?");
}

TEST_F(BadSpecificationsTest, AModelThatIsNotThere) {
  const Arguments fit{"--traj", "run.csv", "--spec", "fit.yaml"};
  folder_->Write("fit.yaml", "model: nowhere.urdf\nfree: [link1.length]\n");
  ExpectFitRefused(*folder_, fit, "nowhere.urdf", "No such file",
                   "give a URDF file");
  folder_->Write("fit.yaml", "model: pendulm1\nfree: [link1.length]\n");
  ExpectFitRefused(*folder_, fit, "fit.yaml:1:8",
                   "no shipped model is named 'pendulm1'",
                   "did you mean 'pendulum1'?");
}

TEST_F(BadSpecificationsTest, AColumnThatIsNotThere) {
  ExpectSpec("free: [link1.length]\ncolumns: {joint1.qw: angle}\n",
             "fit.yaml:2:11", "run.csv has no column 'angle'",
             "known: t, joint1.qw");
}

}  // namespace
}  // namespace sysid
