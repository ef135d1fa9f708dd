// Flags of sysid_fit that cannot be used, and outputs that cannot be written.

#include "tests/tools/programs.h"

namespace sysid {
namespace {

class BadFlagsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ProgramFolder;
    SimulateInto(*folder_, "run.csv",
                 {"--model", "pendulum1", "--duration", "1"});
  }
  static void TearDownTestSuite() { delete folder_; }

  void ExpectFlags(const Arguments& more, const std::string& place,
                   const std::string& what, const std::string& hint) {
    ExpectFitRefused(
        *folder_, Arguments{"--model", "pendulum1", "--traj", "run.csv"} + more,
        place, what, hint);
  }

  static ProgramFolder* folder_;
};

ProgramFolder* BadFlagsTest::folder_ = nullptr;

TEST_F(BadFlagsTest, MissingOnes) {
  ExpectFitRefused(*folder_, {}, "--model", "is missing", "pendulum3_planar");
  ExpectFitRefused(*folder_, {"--model", "pendulum1"}, "--traj", "is missing",
                   "--traj run1.csv,run2.csv");
}

TEST_F(BadFlagsTest, UnknownOnes) {
  ExpectFlags({"--nois", "1"}, "--nois", "unknown flag",
              "did you mean 'noise'?");
  ExpectFlags({"--nois=1"}, "--nois", "unknown flag", "did you mean 'noise'?");
  // Of gflags and glog, not ours.
  ExpectFlags({"--flagfile=x"}, "--flagfile", "unknown flag", "known: help");
  ExpectFlags({"--minloglevel", "0"}, "--minloglevel", "unknown flag", "known");
  ExpectFlags({"--"}, "--", "unknown flag", "known: help");
}

TEST_F(BadFlagsTest, GivenTwice) {
  ExpectFlags({"--model", "pendulum1"}, "--model", "is given twice",
              "give it once");
}

TEST_F(BadFlagsTest, WithoutAValue) {
  ExpectFlags({"--noise"}, "--noise", "has no value", "--noise value");
  ExpectFlags({"--noise", "--seed", "1"}, "--noise", "has no value",
              "--noise value");
  ExpectFlags({"--free", ""}, "--free", "has no value", "leave the flag out");
  ExpectFlags({"--out="}, "--out", "has no value", "leave the flag out");
}

TEST_F(BadFlagsTest, WrongNumbers) {
  ExpectFlags({"--noise", "abc"}, "--noise", "cannot be 'abc'", "a number");
  ExpectFlags({"--noise", "-1"}, "--noise", "a positive number, not -1",
              "standard deviation");
  ExpectFlags({"--noise", "0"}, "--noise", "a positive number, not 0",
              "standard deviation");
  ExpectFlags({"--noise", "nan"}, "--noise", "a positive number, not nan",
              "standard deviation");
  ExpectFlags({"--noise", "1e-300"}, "--noise", "cannot be 1e-300",
              "standard deviation");
  ExpectFlags({"--noise", "1e300"}, "--noise", "cannot be 1e+300",
              "standard deviation");
  ExpectFlags({"--step", "0"}, "--step", "a positive number", "seconds");
  ExpectFlags({"--step", "1e-9"}, "--step", "more than 1000 steps",
              "leave it out");
  ExpectFlags({"--segment", "-2"}, "--segment", "a positive number", "seconds");
  ExpectFlags({"--time", "0"}, "--time", "cannot be 0", "above 0");
  ExpectFlags({"--time", "-3"}, "--time", "cannot be -3", "above 0");
  ExpectFlags({"--time", "soon"}, "--time", "cannot be 'soon'", "a number");
  ExpectFlags({"--threads", "-1"}, "--threads", "must not be negative",
              "0 means all cores");
  ExpectFlags({"--threads", "1.5"}, "--threads", "cannot be '1.5'",
              "a whole number");
  ExpectFlags({"--seed", "-1"}, "--seed", "cannot be '-1'",
              "a whole number from 0");
}

TEST_F(BadFlagsTest, UnknownWords) {
  ExpectFlags({"--solver", "ml"}, "--solver", "unknown solver 'ml'", "lm");
  ExpectFlags({"--integrator", "rk5"}, "--integrator",
              "unknown integrator 'rk5'", "did you mean 'rk4'?");
  ExpectFlags({"--residual", "headings"}, "--residual", "'headings'",
              "did you mean 'heading'?");
  ExpectFlags({"--loss", "hubr"}, "--loss", "unknown loss 'hubr'",
              "did you mean 'huber'?");
}

TEST_F(BadFlagsTest, StrayArguments) {
  ExpectFlags({"other.csv"}, "argument 'other.csv'", "belongs to no flag",
              "separated by commas without spaces");
}

TEST_F(BadFlagsTest, ListsWithEmptyEntries) {
  ExpectFitRefused(
      *folder_, {"--model", "pendulum1", "--traj", "run.csv,,run.csv"},
      "--traj", "has an empty entry: 'run.csv,,run.csv'", "single commas");
  ExpectFlags({"--free", "link1.length,"}, "--free", "has an empty entry",
              "single commas");
}

TEST_F(BadFlagsTest, Parameters) {
  ExpectFlags({"--free", "link1.lenght"}, "--free",
              "unknown parameter 'link1.lenght'",
              "did you mean 'link1.length'?");
  ExpectFlags({"--fix", "link1.mas=1"}, "--fix",
              "unknown parameter 'link1.mas'", "did you mean 'link1.mass'?");
  ExpectFlags({"--fix", "link1.mass=-1"}, "--fix",
              "'link1.mass' cannot be -1 kg", "it lies between");
  ExpectFlags({"--fix", "link1.mass=heavy"}, "--fix", "'heavy' is not a number",
              "name=number");
  ExpectFlags({"--free", "link1.length", "--fix", "link1.length"}, "--fix",
              "'link1.length' is also in --free", "one of them");
  ExpectFlags({"--free", "link1.length=1,link1.length=2"}, "--free",
              "'link1.length' is named twice", "once");
  // Spin without inertia.
  ExpectFlags({"--fix", "link1.izz=0"}, "--fix", "link1", "");
}

TEST_F(BadFlagsTest, Effects) {
  ExpectFlags({"--add", "viscous_dampng@joint1"}, "--add",
              "unknown effect 'viscous_dampng'",
              "did you mean 'viscous_damping'?");
  ExpectFlags({"--add", "viscous_damping@joint9"}, "--add",
              "unknown target 'joint9'", "did you mean 'joint1'?");
  ExpectFlags({"--add", "viscous_damping"}, "--add", "has no target",
              "viscous_damping@joint1");
  ExpectFlags({"--add", "viscous_damping@joint1=1"}, "--add",
              "'viscous_damping@joint1' has a value",
              "write --add viscous_damping@joint1");
  ExpectFlags({"--add", "viscous_damping@joint1,viscous_damping@joint1"},
              "--add", "is named twice", "once");
  for (const std::string both :
       {"coulomb_friction@joint1,stribeck_friction@joint1",
        "stribeck_friction@joint1,coulomb_friction@joint1"}) {
    ExpectFlags({"--add", both}, "--add", "shares parameters with",
                "leave one of them out");
  }
}

TEST_F(BadFlagsTest, WholeNumbers) {
  const Arguments add{"--model", "rod.urdf", "--add", "cogging@j"};
  folder_->Write("rod.urdf", R"(<robot name="r"><link name="base"/>
<joint name="j" type="continuous"><parent link="base"/><child link="arm"/>
<axis xyz="0 1 0"/></joint>
<link name="arm"><inertial><origin xyz="0 0 -1"/><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>)");
  const Arguments fit = add + Arguments{"--traj", "run.csv"};
  ExpectFitRefused(*folder_, fit + Arguments{"--free", "j.cogging_order"},
                   "--free",
                   "'j.cogging_order' is a whole number, which a fit cannot "
                   "move",
                   "hold it: --fix j.cogging_order=6");
  ExpectFitRefused(*folder_, fit + Arguments{"--fix", "j.cogging_order=2.5"},
                   "--fix", "'j.cogging_order' cannot be 2.5",
                   "give a whole number");
  ExpectFitRefused(*folder_, fit + Arguments{"--fix", "j.cogging_order=0"},
                   "--fix", "'j.cogging_order' cannot be 0",
                   "it lies between 1 and 1000");
}

TEST_F(BadFlagsTest, AnEffectThatNothingOfTheModelFeels) {
  folder_->Write("cart.urdf", R"(<robot name="r"><link name="base"/>
<joint name="j" type="prismatic"><parent link="base"/><child link="car"/>
<axis xyz="1 0 0"/></joint>
<link name="car"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>)");
  ExpectFitRefused(
      *folder_,
      {"--model", "cart.urdf", "--traj", "run.csv", "--add", "com@car"},
      "--add",
      "effect 'com@car': the motion of this model does not depend "
      "on car.com_x, car.com_y, car.com_z",
      "leave it out");
}

TEST_F(BadFlagsTest, OutputsThatCannotBeWritten) {
  ExpectFlags({"--out", "run.csv"}, "--out",
              "'run.csv': ", "a file, not a folder");
  ExpectFlags({"--out", "run.csv/result"}, "--out",
              "'run.csv/result': the folder cannot be made",
              "a file, not a folder");
  ExpectFlags({"--out", "/proc/result"}, "--out",
              "'/proc/result': the folder cannot be made", "");
  ExpectFlags({"--json", "nowhere/fit.json"}, "nowhere/fit.json",
              "cannot be written: No such file or directory",
              "make the folder 'nowhere' first");
  ExpectFlags({"--json", "."}, ".", "cannot be written", "name a file in it");
  ExpectFlags({"--json", "./run.csv"}, "--json",
              "'./run.csv' is read too: it would be replaced", "another file");
}

TEST_F(BadFlagsTest, AFullDisk) {
  for (const Arguments& more : {Arguments{"--json", "-"}, Arguments{}}) {
    const ProgramResult result = folder_->Run(
        SYSID_FIT,
        Arguments{"--model", "pendulum1", "--traj", "run.csv"} + more,
        "/dev/full");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, ::testing::HasSubstr("error: standard output: "
                                                 "cannot be written"));
  }
}

}  // namespace
}  // namespace sysid
