// sysid_simulate as its users run it.

#include <cmath>
#include <sstream>
#include <tuple>

#include "models/effects/catalogue.h"
#include "sysid/io/csv.h"
#include "tests/sysid/io/read_columns.h"
#include "tests/sysid/simulation/arm_with_limits.h"
#include "tests/tools/programs.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;

class SimulateTest : public ::testing::Test {
 protected:
  // The numbers of a run, by column.
  Table Numbers(const std::string& name) {
    CsvFile file(folder_.Path(name));
    std::vector<int> all;
    for (size_t i = 0; i < file.header().size(); ++i) {
      all.push_back(static_cast<int>(i));
    }
    return ReadColumns(file, all);
  }

  void ExpectFlags(const Arguments& more, const std::string& place,
                   const std::string& what, const std::string& hint) {
    folder_.Write("run.csv", "of an earlier day");
    ExpectRefused(
        folder_, SYSID_SIMULATE,
        Arguments{"--model", "pendulum2_planar", "--out_csv", "run.csv"} + more,
        place, what, hint);
  }

  ProgramFolder folder_;
};

TEST_F(SimulateTest, ItsHelpNamesEveryEffect) {
  const std::string help = folder_.Run(SYSID_SIMULATE, {"--help"}).out;
  for (const std::string& kind : Catalogue().kinds()) {
    EXPECT_THAT(help, HasSubstr(kind));
  }
}

TEST_F(SimulateTest, NumbersOutOfRange) {
  for (const std::string flag : {"--duration", "--rate", "--tilt", "--step"}) {
    for (const std::string value : {"0", "-1", "nan", "inf"}) {
      ExpectFlags({flag, value}, flag, "must be a positive number", "give ");
    }
    ExpectFlags({flag, "1s"}, flag, "cannot be '1s'", "a number");
  }
  ExpectFlags({"--noise", "-1"}, "--noise", "must not be negative", "1e-3");
  ExpectFlags({"--noise", "inf"}, "--noise", "finite", "1e-3");
  ExpectFlags({"--duration", "1e9"}, "--duration", "makes 1e+11 samples",
              "a shorter duration");
  ExpectFlags({"--rate", "1e12"}, "--duration", "samples", "a lower rate");
  ExpectFlags({"--rate", "0.01"}, "--duration", "shorter than one sample",
              "a higher rate");
  ExpectFlags({"--step", "1e-12"}, "--step", "more than 1e8 steps",
              "leave it out");
  ExpectFlags({"--seed", "-1"}, "--seed", "cannot be '-1'", "from 0");
}

TEST_F(SimulateTest, WordsThatAreNotKnown) {
  ExpectFlags({"--excite", "multisin"}, "--excite",
              "unknown excitation 'multisin'", "did you mean 'multisine'?");
  ExpectFlags({"--integrator", "rk5"}, "--integrator", "'rk5'",
              "did you mean 'rk4'?");
  ExpectFlags({"--initial", "rando"}, "--initial", "there is no run 'rando'",
              "write random");
  ExpectFlags({"--durtion", "1"}, "--durtion", "unknown flag",
              "did you mean 'duration'?");
}

TEST_F(SimulateTest, ParametersAndEffects) {
  ExpectFlags({"--set", "link1.lenght=2"}, "--set",
              "unknown parameter 'link1.lenght'",
              "did you mean 'link1.length'?");
  ExpectFlags({"--set", "link1.length"}, "--set", "has no value",
              "link1.length=number");
  ExpectFlags({"--set", "link1.length=long"}, "--set", "'long' is not a number",
              "name=number");
  ExpectFlags({"--set", "link1.mass=-1"}, "--set",
              "'link1.mass' cannot be -1 kg", "it lies between");
  ExpectFlags({"--set", "link1.mass=1,link1.mass=2"}, "--set",
              "'link1.mass' is named twice", "once");
  ExpectFlags({"--set", "link1.ixx=5"}, "--set", "triangle inequality",
              "the sum of the other two");
  ExpectFlags({"--add", "viscous_damping@joint9=1"}, "--add",
              "unknown target 'joint9'", "did you mean 'joint1'?");
  ExpectFlags({"--add", "viscous_damping@joint1=-1"}, "--add",
              "'joint1.damping' cannot be -1", "it lies between");
  ExpectFlags(
      {"--add", "viscous_damping@joint1=1", "--set", "joint1.damping=2"},
      "--set", "'joint1.damping' is named twice", "once");
  ExpectFlags(
      {"--add", "cogging@joint1=0.1", "--set", "joint1.cogging_order=2.5"},
      "--set", "'joint1.cogging_order' cannot be 2.5", "give a whole number");
  ExpectFlags({"--add", "stribeck_friction@joint1=1,coulomb_friction@joint1=1"},
              "--add", "shares parameters with", "leave one of them out");
}

TEST_F(SimulateTest, OutputsThatCannotBeWritten) {
  const Arguments simulate{"--model", "pendulum1"};
  folder_.Write("file", "");
  ExpectRefused(folder_, SYSID_SIMULATE, simulate, "--out_csv", "is missing",
                "name the file");
  ExpectRefused(folder_, SYSID_SIMULATE,
                simulate + Arguments{"--out_csv", "nowhere/run.csv"},
                "nowhere/run.csv", "cannot be written", "make the folder");
  ExpectRefused(folder_, SYSID_SIMULATE,
                simulate + Arguments{"--out_csv", "file/run.csv"},
                "file/run.csv", "cannot be written", "a file, not a folder");
  SimulateInto(folder_, "run.csv", simulate);
  ExpectRefused(
      folder_, SYSID_SIMULATE,
      simulate + Arguments{"--out_csv", "run.csv", "--initial", "run.csv"},
      "--out_csv", "is read too", "another file");
  const ProgramResult full = folder_.Run(
      SYSID_SIMULATE, simulate + Arguments{"--out_csv", "-"}, "/dev/full");
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_THAT(full.err, HasSubstr("standard output: cannot be written"));
}

TEST_F(SimulateTest, MotionThatDoesNotStayFinite) {
  ExpectFlags({"--set", "gravity=1e10"}, "simulation",
              "the motion does not stay finite", "--step");
}

TEST_F(SimulateTest, TheSameSeedMakesTheSameRun) {
  const Arguments simulate{"--model", "pendulum2", "--duration", "1"};
  SimulateInto(folder_, "a.csv", simulate + Arguments{"--seed", "7"});
  SimulateInto(folder_, "b.csv", simulate + Arguments{"--seed", "7"});
  SimulateInto(folder_, "c.csv", simulate + Arguments{"--seed", "8"});
  EXPECT_EQ(folder_.Read("a.csv"), folder_.Read("b.csv"));
  EXPECT_NE(Numbers("a.csv").columns, Numbers("c.csv").columns);
  EXPECT_EQ(Numbers("a.csv").rows(), 101);
  EXPECT_THAT(folder_.Read("a.csv"),
              testing::StartsWith("# sysid_simulate --model pendulum2 "
                                  "--duration 1 --seed 7\nt,joint1.qw,"));
}

TEST_F(SimulateTest, NamesItsFlagsAsTheyWereWritten) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum1", "--duration", "0.1", "--noise",
                "0.0005", "--rate", "200"});
  EXPECT_THAT(folder_.Read("run.csv"),
              testing::StartsWith("# sysid_simulate --model pendulum1 "
                                  "--duration 0.1 --rate 200 "
                                  "--noise 0.0005\nt,joint1.qw,"));
}

TEST_F(SimulateTest, WritesToStandardOutput) {
  const Arguments simulate{"--model", "cartpole", "--duration", "0.1"};
  SimulateInto(folder_, "run.csv", simulate);
  for (const std::string name : {"-", "/dev/stdout"}) {
    const ProgramResult result =
        folder_.Run(SYSID_SIMULATE, simulate + Arguments{"--out_csv", name});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.out, folder_.Read("run.csv"));
    EXPECT_EQ(result.err, "");
  }
}

TEST_F(SimulateTest, StartsWhereARunStarts) {
  const Arguments simulate{"--model", "arm7",    "--duration",
                           "0.5",     "--noise", "0"};
  SimulateInto(folder_, "a.csv", simulate + Arguments{"--seed", "3"});
  SimulateInto(folder_, "b.csv", simulate + Arguments{"--initial", "a.csv"});
  const auto a = Numbers("a.csv").columns, b = Numbers("b.csv").columns;
  ASSERT_EQ(a.size(), b.size());
  for (size_t c = 0; c < a.size(); ++c) {
    for (size_t k = 0; k < a[c].size(); ++k) {
      EXPECT_NEAR(a[c][k], b[c][k], 1e-9);
    }
  }
}

TEST_F(SimulateTest, SaysWhereARunDoesNotSayHowToStart) {
  folder_.Write("start.csv", "t,joint1.q,joint2.q\n0,,0.3\n0.1,0.2,0.3\n");
  const ProgramResult result = folder_.Run(
      SYSID_SIMULATE, {"--model", "pendulum2_planar", "--initial", "start.csv",
                       "--noise", "0", "--out_csv", "run.csv"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err,
            "note: start.csv: the first row has no position of joint "
            "'joint1': it starts at neutral\n");
  EXPECT_EQ(Numbers("run.csv").columns[1][0], 0.0);
  EXPECT_EQ(Numbers("run.csv").columns[2][0], 0.3);
}

TEST_F(SimulateTest, PlantsEffects) {
  const Arguments simulate{"--model", "pendulum2_planar", "--noise",
                           "0",       "--duration",       "2"};
  SimulateInto(folder_, "plain.csv", simulate);
  SimulateInto(folder_, "offset.csv",
               simulate + Arguments{"--add", "sensor_offset@joint1=0.25"});
  SimulateInto(folder_, "damped.csv",
               simulate + Arguments{"--add", "viscous_damping@joint1", "--set",
                                    "joint1.damping=1"});
  SimulateInto(folder_, "damped2.csv",
               simulate + Arguments{"--add", "viscous_damping@joint1=1"});
  const auto plain = Numbers("plain.csv").columns;
  const auto offset = Numbers("offset.csv").columns;
  const auto damped = Numbers("damped.csv").columns;
  for (size_t k = 0; k < plain[1].size(); ++k) {
    EXPECT_NEAR(offset[1][k], plain[1][k] + 0.25, 1e-12);
    EXPECT_NEAR(offset[2][k], plain[2][k], 1e-12);
  }
  EXPECT_GT(std::abs(damped[1].back() - plain[1].back()), 1e-3);
  EXPECT_EQ(damped, Numbers("damped2.csv").columns);
}

TEST_F(SimulateTest, PlantsWrongNominalValues) {
  const Arguments simulate{"--model", "pendulum2",  "--noise",
                           "0",       "--duration", "1"};
  const auto same = [&](const std::string& add, const std::string& set) {
    SimulateInto(folder_, "a.csv", simulate + Arguments{"--add", add});
    SimulateInto(folder_, "b.csv", simulate + Arguments{"--set", set});
    SimulateInto(folder_, "plain.csv", simulate);
    EXPECT_EQ(Numbers("a.csv").columns, Numbers("b.csv").columns);
    EXPECT_NE(Numbers("a.csv").columns, Numbers("plain.csv").columns);
  };
  same("mass@link2=0.5", "link2.mass=0.5");
  same("com@link2=0.1", "link2.com_x=0.1");
  same("inertia@link2=6e-5", "link2.ixx=6e-5");
}

// What a simulation says on standard error.
class SimulateNotesTest : public SimulateTest {
 protected:
  std::string Notes(const Arguments& more) {
    const ProgramResult result = folder_.Run(
        SYSID_SIMULATE, Arguments{"--model", "pendulum2_planar", "--duration",
                                  "0.1", "--out_csv", "run.csv"} +
                            more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  }
};

TEST_F(SimulateNotesTest, AnEffectThatIsOff) {
  EXPECT_EQ(Notes({"--add", "viscous_damping@joint1"}),
            "note: effect viscous_damping@joint1 is off: give it a value, "
            "--add viscous_damping@joint1=0.01\n");
  // What does nothing alone does not switch it on.
  EXPECT_THAT(
      Notes({"--add", "spring@joint1", "--set", "joint1.spring_reference=0.3"}),
      HasSubstr("spring@joint1 is off"));
  EXPECT_THAT(
      Notes({"--add", "cogging@joint1", "--set", "joint1.cogging_order=6"}),
      HasSubstr("cogging@joint1 is off"));
  EXPECT_EQ(Notes({"--add", "mass@link2"}),
            "note: effect mass@link2 is off: link2.mass is the model's own, 1 "
            "kg; give it another value, --add mass@link2=1.1\n");
  EXPECT_THAT(Notes({"--add", "com@link1"}),
              HasSubstr("com@link1 is off: link1.com_x is the model's own"));
  EXPECT_EQ(Notes({"--add", "mass@link2=0.5,inertia@link2=2,cogging@joint1",
                   "--set", "joint1.cogging_cos=0.1"}),
            "");
}

TEST_F(SimulateNotesTest, FrictionThatIsLessAtRest) {
  EXPECT_EQ(Notes({"--add", "stribeck_friction@joint1=0.1"}),
            "note: stribeck_friction@joint1: there is less friction at rest "
            "than in motion; give more with --set joint1.static_friction=0.2"
            "\n");
  EXPECT_EQ(Notes({"--add", "stribeck_friction@joint1=0.1", "--set",
                   "joint1.static_friction=0.2"}),
            "");
}

TEST_F(SimulateTest, ExcitesJoints) {
  SimulateInto(folder_, "run.csv",
               {"--model", "pendulum2_planar", "--duration", "1", "--excite",
                "multisine"});
  EXPECT_THAT(CsvFile(folder_.Path("run.csv")).header(),
              testing::ElementsAre("t", "joint1.q", "joint1.tau", "joint2.q",
                                   "joint2.tau"));
}

TEST_F(SimulateTest, PlantsByPatterns) {
  const Arguments simulate{"--model", "pendulum2_planar", "--noise",
                           "0",       "--duration",       "1"};
  SimulateInto(folder_, "a.csv",
               simulate + Arguments{"--add",
                                    "viscous_damping@*=0.1,"
                                    "viscous_damping@joint2=0.3",
                                    "--set", "link[12].mass=2"});
  SimulateInto(folder_, "b.csv",
               simulate + Arguments{"--add",
                                    "viscous_damping@joint1=0.1,"
                                    "viscous_damping@joint2=0.3",
                                    "--set", "link1.mass=2,link2.mass=2"});
  EXPECT_EQ(Numbers("a.csv").columns, Numbers("b.csv").columns);
  ExpectFlags({"--add", "viscous_damping@elb*=1"}, "--add",
              "'viscous_damping@elb*' meets no effect of this model",
              "near names: viscous_damping@joint1");
  ExpectFlags({"--set", "lnk*.mass=1"}, "--set",
              "'lnk*.mass' meets no parameter", "near names: link1.mass");
}

// Two links between stops, as tests/sysid/simulation/arm_with_limits.h.
class SimulateArmTest : public SimulateTest {
 protected:
  SimulateArmTest() {
    folder_.Write("arm.urdf", kArmWithLimits);
    std::ostringstream reference;
    reference << "t,shoulder.q,elbow.q\n";
    for (int k = 0; k <= 200; ++k) {
      const double t = 0.02 * k;
      reference << t << "," << 0.5 * std::sin(2 * t) << ","
                << 1 + 0.6 * std::cos(3 * t) << "\n";
    }
    folder_.Write("reference.csv", reference.str());
  }

  void ExpectArm(const Arguments& more, const std::string& place,
                 const std::string& what, const std::string& hint) {
    ExpectRefused(
        folder_, SYSID_SIMULATE,
        Arguments{"--model", "arm.urdf", "--out_csv", "run.csv"} + more, place,
        what, hint);
  }
  ProgramResult Arm(const std::string& out, const Arguments& more) {
    return folder_.Run(
        SYSID_SIMULATE,
        Arguments{"--model", "arm.urdf", "--out_csv", out} + more);
  }
};

TEST_F(SimulateArmTest, FollowsAReference) {
  const ProgramResult result =
      Arm("run.csv", {"--track", "reference.csv", "--gains", "300,20", "--rate",
                      "1000", "--noise", "0"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(CsvFile(folder_.Path("run.csv")).header(),
              testing::ElementsAre("t", "shoulder.q", "shoulder.tau", "elbow.q",
                                   "elbow.tau"));
  EXPECT_THAT(folder_.Read("run.csv"),
              testing::StartsWith("# sysid_simulate --model arm.urdf --rate "
                                  "1000 --noise 0 --track reference.csv "
                                  "--gains 300,20\n"));
  // As long as the reference, from its first row.
  const Table run = Numbers("run.csv");
  EXPECT_EQ(run.rows(), 4001);
  EXPECT_EQ(run.columns[1][0], 0.0);
  EXPECT_EQ(run.columns[3][0], 1.6);
  for (size_t k = 0; k < run.columns[0].size(); ++k) {
    const double t = run.columns[0][k];
    EXPECT_NEAR(run.columns[1][k], 0.5 * std::sin(2 * t), 0.05);
    EXPECT_NEAR(run.columns[3][k], 1 + 0.6 * std::cos(3 * t), 0.05);
  }
  // Its efforts make it again.
  const ProgramResult again =
      Arm("again.csv", {"--efforts", "run.csv", "--initial", "run.csv",
                        "--rate", "1000", "--noise", "0"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(Numbers("again.csv").columns[2], run.columns[2]);
}

TEST_F(SimulateArmTest, HoldsJointsWithoutAColumn) {
  folder_.Write("one.csv", "t,shoulder.q\n0,0.1\n1,0.2\n2,0.1\n");
  const ProgramResult result =
      Arm("run.csv", {"--track", "one.csv", "--gains", "shoulder=300:20,*=60:4",
                      "--rate", "1000", "--noise", "0"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err,
            "note: one.csv: no column of elbow: held where it starts\n");
  const auto run = Numbers("run.csv");
  for (const double q : run.columns[3]) {
    EXPECT_NEAR(q, 0.1, 0.05);
  }
}

TEST_F(SimulateArmTest, RefusesReferencesAndGains) {
  const Arguments track{"--track", "reference.csv", "--rate", "1000"};
  ExpectArm(track, "--gains", "is missing", "this model's inertia suggests");
  ExpectArm(track + Arguments{"--gains", "300"}, "--gains",
            "'300' is no pair of gains", "write kp,kd for all joints");
  ExpectArm(track + Arguments{"--gains", "shoulder=300:20"}, "--gains",
            "has no gains of elbow", "'*=kp:kd'");
  ExpectArm({"--gains", "300,20"}, "--gains", "say nothing without --track",
            "add --track");
  ExpectArm(track + Arguments{"--excite", "multisine"}, "--track",
            "cannot be given beside --excite", "leave one of them out");
  ExpectArm({"--track", "none.csv", "--gains", "300,20"}, "none.csv",
            "there is no such file", "");
  folder_.Write("wrong.csv", "t,shoulder.position\n0,0\n1,0\n");
  ExpectArm({"--track", "wrong.csv", "--gains", "300,20"}, "wrong.csv:1:1",
            "no column measures anything of arm", "shoulder.q");
  folder_.Write("far.csv", "t,shoulder.q\n0,0\n1,1.1\n2,0\n");
  ExpectArm({"--track", "far.csv", "--gains", "300,20"}, "far.csv",
            "shoulder.q is 1.1 at t = 1 s, outside of the limits -1.2 to 1",
            "keep the reference within them");
}

TEST_F(SimulateArmTest, AppliesEfforts) {
  folder_.Write("efforts.csv", "t,shoulder.tau\n0,1\n0.005,2\n0.5,3\n1,4\n");
  const ProgramResult result =
      Arm("run.csv", {"--efforts", "efforts.csv", "--noise", "0"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err,
              HasSubstr("note: efforts.csv: its rows are closer than the "
                        "samples of --rate, which hold theirs: to apply all of "
                        "them, --rate 200\n"));
  const Table run = Numbers("run.csv");
  EXPECT_EQ(run.rows(), 101);
  EXPECT_EQ(run.columns[2][0], 1);
  EXPECT_EQ(run.columns[2][1], 2);
  EXPECT_EQ(run.columns[2][49], 2);
  EXPECT_EQ(run.columns[2][50], 3);
  folder_.Write("none.csv", "t,shoulder.q\n0,1\n1,2\n");
  ExpectArm({"--efforts", "none.csv"}, "none.csv:1:1",
            "no column is an effort of arm",
            "its columns are t and any of shoulder.tau, elbow.tau");
  ExpectArm({"--efforts", "efforts.csv", "--track", "reference.csv"}, "--track",
            "cannot be given beside --efforts", "leave one of them out");
}

// A reference has no efforts, and nobody can map its columns.
TEST_F(SimulateArmTest, AsksForNoEffortsInAReference) {
  folder_.Write("more.csv", "t,shoulder.q,speed\n0,0,1\n1,0.1,1\n");
  const ProgramResult result =
      Arm("run.csv", {"--track", "more.csv", "--gains", "30,2"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(
      result.err,
      testing::StartsWith("note: more.csv: ignored the column speed\n"
                          "note: more.csv: no column of elbow: held where it "
                          "starts\n"));
}

TEST_F(SimulateArmTest, ExcitesWithinTheLimits) {
  for (const std::string seed : {"1", "2", "3"}) {
    const ProgramResult result =
        Arm("run.csv", {"--excite", "multisine", "--seed", seed, "--amplitude",
                        "0.8", "--band", "0.2,1.5"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    const Table run = Numbers("run.csv");
    for (const auto& [column, low, high] :
         {std::tuple{1, -1.2, 1.0}, std::tuple{3, 0.1, 2.2}}) {
      for (const double q : run.columns[column]) {
        EXPECT_GT(q, low);
        EXPECT_LT(q, high);
      }
    }
  }
  // The programs take what they make.
  const ProgramResult fit =
      folder_.Run(SYSID_FIT, {"--model", "arm.urdf", "--traj", "run.csv",
                              "--free", "*.mass", "--threads", "1"});
  EXPECT_EQ(fit.exit_code, 0) << fit.err << fit.out;
  EXPECT_THAT(fit.out, HasSubstr("at the noise floor"));
}

TEST_F(SimulateArmTest, RefusesExcitationsThatAreNone) {
  const Arguments excite{"--excite", "multisine"};
  ExpectArm(excite + Arguments{"--band", "2"}, "--band",
            "'2' is no pair of frequencies", "such as 0.1,2");
  ExpectArm(excite + Arguments{"--band", "2,0.1"}, "--band",
            "0 < lowest < highest must hold", "such as 0.1,2");
  ExpectArm(excite + Arguments{"--band", "1,40"}, "--band",
            "40 Hz is more than a quarter of 100 samples a second",
            "a higher --rate");
  ExpectArm(excite + Arguments{"--amplitude", "0"}, "--amplitude",
            "must be a positive number", "0.5 half of it");
  ExpectArm({"--band", "1,2"}, "--band", "says nothing without --excite",
            "--excite multisine");
  ExpectArm({"--amplitude", "0.5"}, "--amplitude",
            "says nothing without --excite", "--excite multisine");
}

TEST_F(SimulateTest, HelpFitsAScreenAndItsExampleWorks) {
  ExpectHelp(folder_, SYSID_SIMULATE, "sysid_simulate");
  EXPECT_EQ(Numbers("run.csv").rows(), 1001);
}

}  // namespace
}  // namespace sysid
