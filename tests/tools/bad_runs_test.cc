// Recordings that cannot be used: the issue's list, each by its message.

#include <cmath>
#include <cstdio>

#include "tests/tools/programs.h"

namespace sysid {
namespace {

std::string Row(double t, double q1, double q2) {
  char text[96];
  std::snprintf(text, sizeof(text), "%.3f,%.9f,%.9f\n", t, q1, q2);
  return text;
}

// Two joints that swing, `rows` of them from line 2 on, 10 ms apart.
std::string Swing(int rows, double unit = 1.0) {
  std::string text = "t,joint1.q,joint2.q\n";
  for (int k = 0; k < rows; ++k) {
    const double t = 0.01 * k;
    text += Row(t, unit * 0.5 * std::sin(4 * t), unit * 0.4 * std::cos(4 * t));
  }
  return text;
}

// With line `number` (from 1) replaced.
std::string WithLine(const std::string& text, int number,
                     const std::string& line) {
  size_t from = 0;
  for (int i = 1; i < number; ++i) from = text.find('\n', from) + 1;
  return text.substr(0, from) + line + text.substr(text.find('\n', from));
}

class BadRunsTest : public ::testing::Test {
 protected:
  void ExpectRun(const std::string& text, const std::string& place,
                 const std::string& what, const std::string& hint,
                 const Arguments& more = {}) {
    folder_.Write("run.csv", text);
    ExpectFitRefused(
        folder_,
        Arguments{"--model", "pendulum2_planar", "--traj", "run.csv"} + more,
        place, what, hint);
  }

  ProgramFolder folder_;
};

TEST_F(BadRunsTest, AMissingFile) {
  ExpectFitRefused(folder_,
                   {"--model", "pendulum2_planar", "--traj", "nowhere.csv"},
                   "nowhere.csv", "there is no such file", "check the name");
  folder_.Write("run.csv", Swing(100));
  ExpectRun(Swing(100), "nowhere.csv", "there is no such file",
            "check the name", {"--holdout", "nowhere.csv"});
}

TEST_F(BadRunsTest, AFolder) {
  ExpectFitRefused(folder_, {"--model", "pendulum2_planar", "--traj", "."}, ".",
                   "is a folder, not a file", "name a file in it");
}

TEST_F(BadRunsTest, AnEmptyFile) {
  ExpectRun("", "run.csv:1:1", "the file is empty", "a header such as");
}

TEST_F(BadRunsTest, ABinaryFile) {
  ExpectRun(std::string("t,joint1.q\n0,\0\n", 15), "run.csv",
            "is not a text file", "save it as text");
}

TEST_F(BadRunsTest, NoHeader) {
  const std::string text = Swing(100);
  ExpectRun(text.substr(text.find('\n') + 1), "run.csv:1:1",
            "there is no header", "put a row of names before it");
}

TEST_F(BadRunsTest, NoColumnOfAnyJoint) {
  ExpectRun(WithLine(Swing(100), 1, "t,a,b"), "run.csv:1:1",
            "no column measures anything of pendulum2_planar",
            "its columns would be joint1.q, joint2.q; map yours by --columns");
}

TEST_F(BadRunsTest, NoTime) {
  ExpectRun(WithLine(Swing(100), 1, "when,joint1.q,joint2.q"), "run.csv:1:1",
            "time", "--columns t=");
}

TEST_F(BadRunsTest, AnUnknownJointIsNoted) {
  folder_.Write("run.csv", WithLine(Swing(100), 1, "t,jiont1.q,joint2.q"));
  const ProgramResult result =
      folder_.Run(SYSID_FIT, {"--model", "pendulum2_planar", "--traj",
                              "run.csv", "--free", "link2.length"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(
      result.err,
      ::testing::HasSubstr("note: run.csv: no column is read as the position "
                           "of joint1 or the effort of joint1, joint2; "
                           "ignored the column jiont1.q (the "
                           "model has no joint 'jiont1' (column "
                           "'jiont1.q'); did you mean 'joint1.q'?)"));
}

TEST_F(BadRunsTest, AnUnknownJointInTheMap) {
  ExpectRun(Swing(100), "--columns", "the model has no joint 'joint9'",
            "did you mean 'joint1.q'?", {"--columns", "joint9.q=joint1.q"});
  ExpectRun(Swing(100), "--columns", "run.csv has no column 'pos'",
            "known: t, joint1.q, joint2.q", {"--columns", "joint1.q=pos"});
}

TEST_F(BadRunsTest, TextInANumber) {
  ExpectRun(WithLine(Swing(100), 7, "0.05,abc,0"), "run.csv:7:2",
            "'abc' in column 'joint1.q' is not a number", "leave the cell");
}

TEST_F(BadRunsTest, ARowThatIsTooShort) {
  ExpectRun(WithLine(Swing(100), 7, "0.05,1"), "run.csv:7:3", "2 cells",
            "cut off?");
}

TEST_F(BadRunsTest, TimeThatRepeats) {
  ExpectRun(WithLine(Swing(100), 7, "0.04,0,0"), "run.csv:7:1",
            "time repeats: 0.04 s again (line 6)", "in the order of time");
}

TEST_F(BadRunsTest, TimeThatGoesBack) {
  ExpectRun(WithLine(Swing(100), 7, "0.01,0,0"), "run.csv:7:1",
            "time goes back: from 0.04 s (line 6) to 0.01 s",
            "in the order of time");
}

TEST_F(BadRunsTest, AQuaternionFarFromUnit) {
  std::string text = "t,joint1.qw,joint1.qx,joint1.qy,joint1.qz\n";
  for (int k = 0; k < 50; ++k) {
    text += std::to_string(0.01 * k) + (k == 20 ? ",2,0,0,0\n" : ",1,0,0,0\n");
  }
  folder_.Write("run.csv", text);
  ExpectFitRefused(folder_, {"--model", "pendulum1", "--traj", "run.csv"},
                   "run.csv:22:2", "has norm 2, not 1", "unit quaternion");
}

// Of a joint that cannot turn on and on.
TEST_F(BadRunsTest, AnglesThatLookLikeDegrees) {
  folder_.Write("arm.urdf", R"(<robot name="arm">
  <link name="base"/>
  <joint name="joint1" type="revolute">
    <parent link="base"/> <child link="link1"/> <axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="10" velocity="10"/>
  </joint>
  <link name="link1">
    <inertial>
      <origin xyz="0 0 -0.2"/> <mass value="1"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
</robot>
)");
  std::string text = "t,joint1.q\n";
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k;
    text +=
        std::to_string(t) + "," + std::to_string(28.6 * std::sin(4 * t)) + "\n";
  }
  folder_.Write("run.csv", text);
  ExpectFitRefused(
      folder_,
      {"--model", "arm.urdf", "--traj", "run.csv", "--free", "link1.mass"},
      "run.csv:1:2", "column 'joint1.q' is no angle in radians",
      "--columns joint1.q=joint1.q*0.0174532925");
}

TEST_F(BadRunsTest, TimeInMilliseconds) {
  std::string text = "clock,joint1.q,joint2.q\n";
  for (int k = 0; k < 50; ++k) text += Row(10 * k, 0.1 * std::sin(k), 0);
  const std::string what =
      "samples are 10 s apart: is the time in milliseconds?";
  ExpectRun(text, "run.csv", what, "--columns t=clock*0.001  (if",
            {"--columns", "t=clock"});
  ExpectRun(WithLine(text, 1, "t,joint1.q,joint2.q"), "run.csv", what,
            "--columns t=t*0.001  (if it is seconds after all: t=t*1)");
}

TEST_F(BadRunsTest, APauseThatNoPredictionCrosses) {
  std::string text = Swing(100);
  for (int k = 0; k < 100; ++k) text += Row(1000 + 0.01 * k, 0, 0);
  ExpectRun(text, "run.csv",
            "nothing was sampled from 0.99 s to 1000 s: too long to predict",
            "split it there into two files");
}

TEST_F(BadRunsTest, TooFewSamples) {
  ExpectRun(Swing(4), "run.csv", "has 4 samples: too few to fit anything",
            "at least 5 are needed");
  ExpectRun(Swing(0), "run.csv:1:1", "a header but no row of data",
            "at least two samples");
}

TEST_F(BadRunsTest, NaNEverywhereInAChannel) {
  std::string text = "t,joint1.q,joint2.q\n";
  for (int k = 0; k < 50; ++k) text += std::to_string(0.01 * k) + ",,nan\n";
  ExpectRun(text, "run.csv:1:2", "nothing was measured in joint1.q",
            "remove the column");
}

TEST_F(BadRunsTest, NothingThatMoves) {
  std::string text = "t,joint1.q,joint2.q\n";
  for (int k = 0; k < 50; ++k) text += std::to_string(0.01 * k) + ",0.1,0\n";
  ExpectRun(text, "run.csv", "nothing that was measured ever changes",
            "record a motion");
}

TEST_F(BadRunsTest, TheSameRunTwice) {
  folder_.Write("run.csv", Swing(100));
  ExpectFitRefused(
      folder_, {"--model", "pendulum2_planar", "--traj", "run.csv,./run.csv"},
      "--traj", "'./run.csv' is given twice", "give each recording once");
  ExpectRun(Swing(100), "--holdout", "'run.csv' is fitted too", "not in --traj",
            {"--holdout", "run.csv"});
}

}  // namespace
}  // namespace sysid
