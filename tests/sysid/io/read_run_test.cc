#include "sysid/io/read_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/error_text.h"
#include "tests/sysid/io/chain.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// A word as the shell takes it.
std::string FromShell(const std::string& word) {
  std::string text;
  bool quoted = false;
  for (size_t i = 0; i < word.size(); ++i) {
    if (word[i] == '\'') {
      quoted = !quoted;
    } else {
      if (word[i] == '\\' && !quoted) ++i;
      text += word[i];
    }
  }
  return text;
}

Mechanism Ball() { return Chain({{"ball", JointType::kSpherical}}); }

TEST(ReadRunTest, ReadsEveryKindOfChannel) {
  const Mechanism mechanism =
      Chain({{"ball", JointType::kSpherical}, {"hinge", JointType::kRevolute}});
  const sysid::Run run = Parse(
      "t,ball.qw,ball.qx,ball.qy,ball.qz,ball.wx,ball.wy,ball.wz,ball.taux,"
      "ball.tauy,ball.tauz,hinge.q,hinge.qd,hinge.tau,tip.px,tip.py,tip.pz\n"
      "0,0.5,0.1,-0.7,0.5,1,2,3,4,5,6,7,8,9,10,11,12\n"
      "0.1,-1,0,0,0,1,2,3,4,5,6,7,8,9.5,10,11,12\n",
      "", nullptr, mechanism);
  EXPECT_EQ(run.name, "run.csv");
  EXPECT_THAT(run.t, ElementsAre(0, 0.1));
  ASSERT_EQ(run.channels.size(), 5u);
  const Channel& ball = run.channels[0];
  EXPECT_EQ(ball.name, "ball");
  EXPECT_EQ(ball.kind, ChannelKind::kOrientation);
  EXPECT_EQ(ball.target, 0);
  // x, y, z, w.
  EXPECT_TRUE(ball.values.row(0).isApprox(
      Eigen::RowVector4d(0.1, -0.7, 0.5, 0.5), 1e-12));
  EXPECT_EQ(ball.values(1, 3), -1.0);  // the other sign of the same rotation
  EXPECT_EQ(run.channels[1].name, "ball.w");
  EXPECT_EQ(run.channels[1].values.row(0), Eigen::RowVector3d(1, 2, 3));
  EXPECT_EQ(run.channels[2].name, "hinge");
  EXPECT_EQ(run.channels[2].target, 1);
  EXPECT_EQ(run.channels[3].kind, ChannelKind::kVelocity);
  EXPECT_EQ(run.channels[4].name, "tip");
  EXPECT_EQ(run.channels[4].target, mechanism.FindLink("tip"));
  EXPECT_EQ(run.channels[4].values.row(1), Eigen::RowVector3d(10, 11, 12));
  EXPECT_EQ(run.effort.row(1), Eigen::RowVector4d(4, 5, 6, 9.5));
}

TEST(ReadRunTest, AJointWithoutColumnsIsUnmeasured) {
  const sysid::Run run = Parse("t,joint2.q\n0,1\n1,2\n");
  ASSERT_EQ(run.channels.size(), 1u);
  EXPECT_EQ(run.channels[0].target, 1);
  EXPECT_TRUE(run.effort.isZero(0.0));
  EXPECT_EQ(run.effort.rows(), 2);
  EXPECT_EQ(run.effort.cols(), 2);
}

TEST(ReadRunTest, MapsColumnsWithFactorsAndOffsets) {
  const sysid::Run run = Parse("time_ms,pos 1,t\n0,180,x\n10,90,x\n",
                               "t=time_ms*0.001,joint1.q=pos 1*0.0174532925-1");
  EXPECT_THAT(run.t, ElementsAre(0, 0.01));
  EXPECT_NEAR(run.channels[0].values(0, 0), 3.14159265 - 1.0, 1e-9);
}

TEST(ReadRunTest, ReportsWhatNoMeasurementIs) {
  EXPECT_EQ(ParseError("t,joint1.q\n0,1\n1,1e308\n"),
            "run.csv:3:2: column 'joint1.q' is 1e+308 here, and no measurement "
            "is beyond 1e15\n"
            "  hint: leave the cell empty where nothing was measured");
  for (const std::string column : {"joint1.qd", "joint1.tau", "tip.px"}) {
    const std::string more =
        column == "tip.px" ? ",tip.py,tip.pz" : ",joint2.q,joint2.qd";
    EXPECT_THAT(ParseError("t," + column + more + "\n0,-2e15,0,0\n"),
                HasSubstr("run.csv:2:2: column '" + column + "' is -2e+15"));
  }
  // What it is mapped to counts; times may be of any clock.
  Parse("ns,q\n1700000000000000000,1e17\n1700000001000000000,2e17\n",
        "t=ns,joint1.q=q*1e-17");
}

TEST(ReadRunTest, TheMapWinsOverAColumnOfOurName) {
  std::vector<std::string> notices;
  const sysid::Run run =
      Parse("t,joint1.q,other\n0,1,5\n1,2,6\n", "joint1.q=other", &notices);
  EXPECT_EQ(run.channels[0].values(1, 0), 6.0);
  EXPECT_THAT(
      notices,
      ElementsAre("run.csv: no column is read as the position of joint2 "
                  "or the effort of joint1, joint2; ignored the column "
                  "joint1.q (mapped from another column): --columns "
                  "joint2.q=COLUMN maps one"));
}

TEST(ReadRunTest, AnEmptyCellIsAMissingMeasurement) {
  const sysid::Run run = Parse(
      "t,joint1.q,tip.px,tip.py,tip.pz\n0,,1,2,3\n1,nan,1,,3\n2,5,1,2,3\n");
  EXPECT_TRUE(std::isnan(run.channels[0].values(0, 0)));
  EXPECT_TRUE(std::isnan(run.channels[0].values(1, 0)));
  EXPECT_EQ(run.channels[0].values(2, 0), 5.0);
  EXPECT_EQ(run.channels[1].values.row(0), Eigen::RowVector3d(1, 2, 3));
  EXPECT_TRUE(run.channels[1].values.row(1).array().isNaN().all());
}

TEST(ReadRunTest, AFrameMayBeSeenInAPlane) {
  const sysid::Run run = Parse("t,x,tip.py,z\n0,1,7,3\n1,2,7,\n2,4,7,6\n",
                               "tip.px=x,tip.pz=z*0.5,tip.py=tip.py");
  EXPECT_THAT(run.channels[0].axes, ElementsAre(0, 1, 2));
  const sysid::Run plane =
      Parse("t,x,z\n0,1,3\n1,2,\n2,4,6\n", "tip.pz=z*0.5,tip.px=x");
  ASSERT_EQ(plane.channels.size(), 1u);
  EXPECT_EQ(plane.channels[0].name, "tip");
  EXPECT_THAT(plane.channels[0].axes, ElementsAre(0, 2));
  EXPECT_EQ(plane.channels[0].values.row(0), Eigen::RowVector2d(1, 1.5));
  EXPECT_TRUE(plane.channels[0].values.row(1).array().isNaN().all());
  EXPECT_EQ(plane.channels[0].values.row(2), Eigen::RowVector2d(4, 3));
  const sysid::Run height = Parse("t,tip.pz\n0,1\n1,2\n");
  EXPECT_THAT(height.channels[0].axes, ElementsAre(2));
}

TEST(ReadRunTest, HoldsMissingEffortsAndSaysSo) {
  std::vector<std::string> notices;
  const sysid::Run run = Parse(
      "t,joint1.q,joint1.tau,joint2.tau\n0,0,,1\n1,0,2,1\n2,0,,1\n3,0,4,1\n",
      "", &notices);
  EXPECT_THAT(std::vector<double>({run.effort(0, 0), run.effort(1, 0),
                                   run.effort(2, 0), run.effort(3, 0)}),
              ElementsAre(0, 2, 2, 4));
  EXPECT_THAT(notices,
              ElementsAre("run.csv: 2 of 4 efforts in joint1.tau are missing: "
                          "each holds the value before it; the first 1 are "
                          "taken as zero"));
}

TEST(ReadRunTest, NormalisesQuaternionsThatWereRounded) {
  const sysid::Run run =
      Parse("t,ball.qw,ball.qx,ball.qy,ball.qz\n0,1.005,0,0,0\n1,-1,0,0,0\n",
            "", nullptr, Ball());
  EXPECT_EQ(run.channels[0].values(0, 3), 1.0);
}

TEST(ReadRunTest, ListsUnknownColumnsInOneNotice) {
  std::vector<std::string> notices;
  Parse(
      "t,joint1.q,note,jiont2.q,,zz.qd,joint1.qw\n0,0,hello,1,2,3,4\n"
      "1,0,x,1,2,3,4\n",
      "", &notices);
  EXPECT_THAT(
      notices,
      ElementsAre(
          "run.csv: no column is read as the position of joint2 or the effort "
          "of joint1, joint2; "
          "ignored the columns note, jiont2.q (the model has no joint "
          "'jiont2' (column 'jiont2.q'); did you mean 'joint2.q'?), zz.qd (the "
          "model has no joint 'zz' (column 'zz.qd'); known: joint1, joint2), "
          "joint1.qw (joint 'joint1' is revolute and has no column "
          "'joint1.qw'; its columns are joint1.q, joint1.qd, joint1.tau): "
          "--columns joint2.q=COLUMN maps one"));
  notices.clear();
  Parse(
      "t,joint1.q,joint2.q,joint1.tau,joint2.tau,\x1b[2J\n0,0,0,0,0,1\n"
      "1,0,0,0,0,2\n",
      "", &notices);
  EXPECT_THAT(notices, ElementsAre("run.csv: ignored the column ?[2J"));
  notices.clear();
  Parse("time,t,pos\n0,x,0\n1,x,0\n", "t=time,joint1.q=pos", &notices);
  EXPECT_THAT(notices, IsEmpty());
}

TEST(ReadRunTest, ReportsAMissingHeader) {
  EXPECT_EQ(ParseError("0,1.5\n1,2\n"),
            "run.csv:1:1: there is no header: the first row is numbers ('0', "
            "...)\n"
            "  hint: put a row of names before it, such as t,joint1.q");
  // numpy.savetxt writes its header as a comment.
  EXPECT_EQ(ParseError("# t,joint1.q\n0,1.5\n1,2\n"),
            "run.csv:2:1: there is no header: the first row is numbers ('0', "
            "...)\n"
            "  hint: the comment 't,joint1.q' reads like the header: take its "
            "'#' away");
}

TEST(ReadRunTest, ReadsOtherSeparatorsAndSaysSo) {
  std::vector<std::string> notices;
  EXPECT_EQ(Parse("t;joint1.q\n0;1,5\n1;2,5\n", "", &notices)
                .channels[0]
                .values(1, 0),
            2.5);
  EXPECT_THAT(notices,
              ElementsAre("run.csv: the columns are separated by semicolons",
                          "run.csv: the numbers have decimal commas"));
}

TEST(ReadRunTest, ReportsAMissingTimeColumn) {
  EXPECT_EQ(ParseError("time,joint1.q\n0,1\n"),
            "run.csv:1:1: there is no time column 't'\n"
            "  hint: --columns t=time");
  EXPECT_EQ(ParseError("joint1.q,Time [ms]\n0,1\n"),
            "run.csv:1:1: there is no time column 't'\n"
            "  hint: --columns 't=Time [ms]*0.001'");
  // All that the file needs, in one go.
  EXPECT_EQ(ParseError("time,pos_meas1,pos_meas2\n0,1,2\n"),
            "run.csv:1:1: there is no time column 't'\n"
            "  hint: --columns t=time,joint1.q=pos_meas1,joint2.q=pos_meas2");
  EXPECT_THAT(ParseError("time,a\n0,1\n", "joint1.q=a"),
              HasSubstr("hint: --columns t=time,joint1.q=a"));
  EXPECT_EQ(ParseError("a,joint1.q\n0,1\n"),
            "run.csv:1:1: there is no time column 't'\n"
            "  hint: name it by --columns t=COLUMN; the file's columns are a, "
            "joint1.q");
}

TEST(ReadRunTest, TheHintForForeignNamesReadsTheFile) {
  const Mechanism cart = Chain(
      {{"cart", JointType::kPrismatic}, {"pole", JointType::kContinuous}});
  const struct {
    std::string header, flag;
    Mechanism mechanism = Hinges();
  } kFiles[] = {
      {"time,pos1,pos2", "t=time,joint1.q=pos1,joint2.q=pos2"},
      {"% time,pos1", "'t=% time,joint1.q=pos1'"},
      {"stamp,joint1,joint2", "t=stamp,joint1.q=joint1,joint2.q=joint2"},
      // Neither a time nor positions.
      {"theta [rad],omega [rad/s],rate_rad,time [s]",
       "'t=time [s],joint1.q=theta [rad]'"},
      {"q1 (deg),v1 (deg/s),ms", "'t=ms*0.001,joint1.q=q1 (deg)*0.0174532925'"},
      {R"(time,"pos, left","pos ""right""")",
       R"('t=time,joint1.q="pos, left",joint2.q='\''pos "right"'\''')"},
      // An effort is no measurement.
      {"time,pos1,joint1.tau", "t=time,joint1.q=pos1"},
      {"time,x,theta", "t=time,cart.q=x,pole.q=theta", cart},
      {"time,qw,qx,qy,qz", "t=time,ball.qw=qw,ball.qx=qx,ball.qy=qy,ball.qz=qz",
       Ball()},
      {"time,tip.X,tip.Y,tip.Z,IMU.W.1,IMU.X.1,IMU.Y.1,IMU.Z.1",
       "t=time,ball.qw=IMU.W.1,ball.qx=IMU.X.1,ball.qy=IMU.Y.1,"
       "ball.qz=IMU.Z.1",
       Ball()},
  };
  for (const auto& file : kFiles) {
    const std::string error =
        ParseError(file.header + "\n", "", file.mechanism);
    const size_t at = error.find("--columns ");
    ASSERT_NE(at, std::string::npos) << error;
    const std::string flag =
        error.substr(at + std::string("--columns ").size());
    EXPECT_EQ(flag, file.flag);
    // What is missing then is the rows.
    EXPECT_THAT(ParseError(file.header + "\n", FromShell(flag), file.mechanism),
                HasSubstr("there is a header but no row of data"));
  }
}

TEST(ReadRunTest, TheHintSaysWhatItDoesNotKnow) {
  EXPECT_EQ(ParseError("time,a,b\n0,1,2\n"),
            "run.csv:1:1: there is no time column 't'\n"
            "  hint: name them by --columns t=time,joint1.q=COLUMN,"
            "joint2.q=COLUMN; the file's columns are time, a, b");
  EXPECT_EQ(ParseError("a,pos\n0,1\n"),
            "run.csv:1:1: there is no time column 't'\n"
            "  hint: name them by --columns t=COLUMN,joint1.q=pos; the file's "
            "columns are a, pos");
  EXPECT_THAT(ParseError("time,pos,i\n0,1,2\n", "joint1.tau=i*2"),
              HasSubstr("hint: --columns t=time,joint1.q=pos,joint1.tau=i*2"));
}

TEST(ReadRunTest, ReportsTimeThatIsMissingOrDoesNotIncrease) {
  EXPECT_EQ(ParseError("t,joint1.q\n0,1\n,2\n"),
            "run.csv:3:1: no time in column 't'\n"
            "  hint: every row needs its time: fill it in, or remove the row");
  const std::string hint =
      "\n  hint: rows must be in the order of time; are two recordings in one "
      "file, or is the time rounded?";
  EXPECT_EQ(ParseError("t,joint1.q\n0,1\n# c\n0.5,2\n\n0.5,2\n"),
            "run.csv:6:1: time repeats: 0.5 s again (line 4)" + hint);
  EXPECT_EQ(
      ParseError("t,joint1.q\n0,1\n0.5,2\n0.25,2\n"),
      "run.csv:4:1: time goes back: from 0.5 s (line 3) to 0.25 s" + hint);
}

TEST(ReadRunTest, ReportsTooFewRows) {
  const std::string hint = "\n  hint: a run needs at least two samples";
  EXPECT_EQ(ParseError("t,joint1.q\n"),
            "run.csv:1:1: there is a header but no row of data" + hint);
  EXPECT_EQ(ParseError("t,joint1.q\n0,1\n"),
            "run.csv:1:1: there is only one row of data" + hint);
}

TEST(ReadRunTest, ReportsARunThatMeasuresNothing) {
  EXPECT_EQ(ParseError("t,pos_meas1,pos_meas2,vel_meas1,tau_con1\n0,1,2,3,4\n"),
            "run.csv:1:1: no column measures anything of chain\n"
            "  hint: its columns would be joint1.q, joint2.q; try --columns "
            "joint1.q=pos_meas1,joint2.q=pos_meas2");
  EXPECT_EQ(ParseError("t,theta_deg\n0,1\n"),
            "run.csv:1:1: no column measures anything of chain\n"
            "  hint: its columns would be joint1.q, joint2.q; try --columns "
            "joint1.q=theta_deg*0.0174532925");
  // What the flag says already is kept.
  EXPECT_THAT(ParseError("time,pos\n0,1\n", "t=time"),
              HasSubstr("try --columns joint1.q=pos,t=time"));
  // An effort alone measures no motion.
  EXPECT_EQ(ParseError("t,joint1.tau,a\n0,1,2\n"),
            "run.csv:1:1: no column measures anything of chain\n"
            "  hint: its columns would be joint1.q, joint2.q; map yours by "
            "--columns NAME=COLUMN; the file's columns are t, joint1.tau, a");
  EXPECT_THAT(ParseError("t,a\n0,1\n", "", Ball()),
              HasSubstr("its columns would be ball.qw, ball.qx, ball.qy, "
                        "ball.qz; map yours by"));
}

TEST(ReadRunTest, ReportsIncompleteGroups) {
  EXPECT_EQ(ParseError("t,ball.qw,ball.qx,ball.qy\n0,1,0,0\n", "", Ball()),
            "run.csv:1:4: there is column 'ball.qy', but no column 'ball.qz'\n"
            "  hint: the columns ball.qw, ball.qx, ball.qy, ball.qz belong "
            "together: give all or none");
  EXPECT_THAT(ParseError("t,x,ball.wx\n0,1,0\n", "", Ball()),
              StartsWith("run.csv:1:3: there is column 'ball.wx', but no "
                         "column 'ball.wy'"));
  EXPECT_THAT(ParseError("t,ball.taux\n0,1\n", "", Ball()),
              StartsWith("run.csv:1:2: there is column 'ball.taux', but no "
                         "column 'ball.tauy'"));
}

TEST(ReadRunTest, ReportsAQuaternionFarFromUnit) {
  EXPECT_EQ(ParseError("t,ball.qw,ball.qx,ball.qy,ball.qz\n0,1,0,0,0\n"
                       "1,1,0.5,0,0\n",
                       "", Ball()),
            "run.csv:3:2: the quaternion ball.qw, ball.qx, ball.qy, ball.qz "
            "has norm 1.118034, not 1\n"
            "  hint: its columns are w, x, y, z of a unit quaternion; leave "
            "them empty where nothing was measured");
  EXPECT_THAT(ParseError("t,ball.qw,ball.qx,ball.qy,ball.qz\n0,0,0,0,0\n"
                         "1,1,0,0,0\n",
                         "", Ball()),
              HasSubstr("has norm 0, not 1"));
}

TEST(ReadRunTest, ReportsAChannelWithoutNumbers) {
  const std::string hint =
      "\n  hint: remove the column where the quantity was not measured";
  EXPECT_EQ(ParseError("t,joint1.q,joint2.q\n0,1,\n1,2,nan\n"),
            "run.csv:1:3: nothing was measured in joint2.q: every cell is "
            "empty or nan" +
                hint);
  EXPECT_EQ(ParseError("t,ball.qw,ball.qx,ball.qy,ball.qz\n0,,1,0,0\n"
                       "1,1,,0,0\n",
                       "", Ball()),
            "run.csv:1:2: nothing was measured in ball.qw, ball.qx, ball.qy, "
            "ball.qz: every row has a cell that is empty or nan" +
                hint);
  EXPECT_EQ(ParseError("t,joint1.q,joint1.tau\n0,1,\n1,2,nan\n"),
            "run.csv:1:3: nothing was measured in joint1.tau: every cell is "
            "empty or nan" +
                hint);
}

// A swing in degrees, with columns t and `name`.
std::string SwingInDegrees(const std::string& name, double amplitude,
                           double frequency_hz) {
  std::string text = "t," + name + "\n";
  for (int i = 0; i < 1000; ++i) {
    const double t = 0.01 * i;
    text += std::to_string(t) + "," +
            std::to_string(amplitude * std::cos(6.2831853 * frequency_hz * t)) +
            "\n";
  }
  return text;
}

TEST(ReadRunTest, ReportsAnglesThatLookLikeDegrees) {
  EXPECT_EQ(
      ParseError(SwingInDegrees("joint1.q", 60.0, 1.0)),
      "run.csv:1:2: column 'joint1.q' looks like degrees, not radians: "
      "it swings to and fro over 120 at up to 245 a second: in radians that "
      "is 19 turns, 39 turns a second\n"
      "  hint: --columns joint1.q=joint1.q*0.0174532925  (if it is "
      "radians after all: joint1.q=joint1.q*1)");
  EXPECT_THAT(ParseError(SwingInDegrees("pos", 60.0, 1.0), "joint1.q=pos"),
              HasSubstr("column 'pos' (joint1.q) looks like degrees"));
}

TEST(ReadRunTest, AFactorSettlesTheUnit) {
  const std::string text = SwingInDegrees("joint1.q", 60.0, 1.0);
  EXPECT_NEAR(
      Parse(text, "joint1.q=joint1.q*0.0174532925").channels[0].values(0, 0),
      1.0471975, 1e-6);
  EXPECT_EQ(Parse(text, "joint1.q=joint1.q*1").channels[0].values(0, 0), 60.0);
}

TEST(ReadRunTest, NoticesSlowAnglesThatMayBeDegrees) {
  std::vector<std::string> notices;
  Parse(SwingInDegrees("joint1.q", 30.0, 0.2), "", &notices);
  EXPECT_THAT(notices,
              ElementsAre("run.csv: column 'joint1.q' may be in degrees: it "
                          "swings to and fro over 60.0: in radians 9.5 turns; "
                          "if so: --columns joint1.q=joint1.q*0.0174532925"));
}

TEST(ReadRunTest, ReportsAVelocityThatLooksLikeDegrees) {
  std::string text = "t,joint1.q,joint1.qd\n";
  for (int i = 0; i < 200; ++i) {
    const double t = 0.01 * i;
    text += std::to_string(t) + "," + std::to_string(0.1 * std::sin(5 * t)) +
            "," + std::to_string(57.29578 * 0.5 * std::cos(5 * t)) + "\n";
  }
  EXPECT_EQ(ParseError(text),
            "run.csv:1:3: column 'joint1.qd' looks like degrees per second, "
            "not radians: it is 57.3 times what the position's changes say "
            "(180/pi is 57.3)\n"
            "  hint: --columns joint1.qd=joint1.qd*0.0174532925  (if it is "
            "radians after all: joint1.qd=joint1.qd*1)");
}

TEST(ReadRunTest, JoinsColumnsByArithmetic) {
  // Absolute angles, a drifting sensor and an effort from a current.
  const std::string text =
      "t,joint1.q,joint2.q,i\n0,1,3,2\n1,2,,2\n2,,7,2\n3,1,5,2\n";
  const sysid::Run run =
      Parse(text,
            "joint2.q=joint2.q-joint1.q,joint1.q=joint1.q-0.5*t,"
            "joint1.tau=-i*0.35*6");
  EXPECT_THAT(std::vector<double>({run.channels[0].values(0, 0),
                                   run.channels[0].values(1, 0),
                                   run.channels[0].values(3, 0)}),
              ElementsAre(1, 1.5, -0.5));
  EXPECT_EQ(run.channels[1].values(0, 0), 2.0);
  // A missing cell makes the result missing.
  EXPECT_TRUE(std::isnan(run.channels[0].values(2, 0)));
  EXPECT_TRUE(std::isnan(run.channels[1].values(1, 0)));
  EXPECT_TRUE(std::isnan(run.channels[1].values(2, 0)));
  EXPECT_NEAR(run.effort(0, 0), -4.2, 1e-12);
}

TEST(ReadRunTest, ReportsAResultThatIsNotFinite) {
  EXPECT_EQ(
      ParseError("t,a,b\n0,1,2\n1,3,0\n", "joint1.q=a/b"),
      "run.csv:3:2: 'a/b' (joint1.q) is not finite here\n"
      "  hint: is there a division by zero, or a function without a value?");
  EXPECT_THAT(ParseError("t,a,b\n0,1,2\n1,0,0\n", "joint1.q=a/b"),
              StartsWith("run.csv:3:2: 'a/b' (joint1.q) is not finite"));
}

TEST(ReadRunTest, ADifferenceOfDegreesLooksLikeDegrees) {
  std::string text = SwingInDegrees("a", 60.0, 1.0);
  EXPECT_THAT(ParseError(text, "joint1.q=a-t"),
              HasSubstr("'a-t' (joint1.q) looks like degrees"));
  EXPECT_THAT(ParseError(text, "joint1.q=a-t"),
              HasSubstr("--columns 'joint1.q=(a-t)*0.0174532925'"));
  EXPECT_EQ(ParseError(text, "joint1.q=(a-t)*1"), "no error");
}

TEST(ReadRunTest, NamesAtMostTwoDozenIgnoredColumns) {
  std::string header = "t,joint1.q", row = "0,1", next = "1,2";
  for (int i = 0; i < 30; ++i) {
    header += ",c" + std::to_string(i);
    row += ",0";
    next += ",0";
  }
  std::vector<std::string> notices;
  Parse(header + "\n" + row + "\n" + next + "\n", "", &notices);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_THAT(notices[0], HasSubstr(", c22, c23, and 6 more: --columns"));
}

// Columns that nobody mapped: what they may be is said with their names, before
// anything else of the file.
TEST(ReadRunTest, SaysFirstWhichJointsNoColumnGives) {
  const auto first = [](const std::string& header,
                        const Mechanism& mechanism = Hinges()) {
    const auto cells = 1 + std::count(header.begin(), header.end(), ',');
    std::string text = header + "\n";
    for (const std::string t : {"0", "1"}) {
      text += t;
      for (int i = 1; i < cells; ++i) text += i == 1 ? ",1" : ",0";
      text += "\n";
    }
    std::vector<std::string> notices;
    Parse(text, "", &notices, mechanism);
    return notices.empty() ? "" : notices.front();
  };
  EXPECT_EQ(first("t,joint1.q,pos2,cur2,joint1.tau"),
            "run.csv: no column is read as the position of joint2 or the "
            "effort of joint2; ignored the columns pos2, cur2: --columns "
            "joint2.q=COLUMN maps one");
  EXPECT_EQ(first("t,joint1.q,joint2.q,cur1"),
            "run.csv: no column is read as the effort of joint1, joint2; "
            "ignored the column cur1: --columns joint1.tau=COLUMN maps one");
  EXPECT_EQ(first("t,ball.qw,ball.qx,ball.qy,ball.qz,motor", Ball()),
            "run.csv: no column is read as the effort of ball; ignored the "
            "column motor: --columns ball.taux=COLUMN maps one");
  // A frame that is measured is a measurement of joints.
  EXPECT_EQ(first("t,tip.px,tip.py,tip.pz,joint1.tau,joint2.tau,note"),
            "run.csv: ignored the column note");
  // Nothing that could be one: a joint need not be measured or driven.
  EXPECT_EQ(first("t,joint1.q"), "");
}

TEST(ReadRunTest, ReadsAFileFromDisk) {
  const std::string path = ::testing::TempDir() + "read_run_test.csv";
  std::ofstream(path) << "t,joint1.q\n0,1\n1,2\n";
  EXPECT_EQ(ReadRun(path, {}, Hinges(), nullptr).size(), 2);
  std::filesystem::remove(path);
  EXPECT_EQ(ErrorText([&] { ReadRun(path, {}, Hinges(), nullptr); }),
            path +
                ": there is no such file\n"
                "  hint: check the name and the folder that you are in");
}

}  // namespace
}  // namespace sysid
