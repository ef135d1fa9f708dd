// What is said of a file that is not read as it stands.

#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/sysid/io/chain.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
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

TEST(ReadRunMessages, ReportsAMissingHeader) {
  EXPECT_EQ(ParseError("0,1.5\n1,2\n"),
            "run.csv:1:1: there is no header: the first row is numbers ('0', "
            "...)\n"
            "  hint: --columns t=#1,joint1.q=#2 if its columns are in this "
            "order; or put a row of names before it, such as t,joint1.q");
  // numpy.savetxt writes its header as a comment.
  EXPECT_THAT(ParseError("# t,joint1.q\n0,1.5\n1,2\n"),
              StartsWith("run.csv:2:1: there is no header: the first row is "
                         "numbers ('0', ...); the comment 't,joint1.q' reads "
                         "like the header: take its '#' away\n"));
  // With a position, a velocity and an effort of each joint it is likely all.
  EXPECT_THAT(ParseError("0 1 2 3 4 5 6\n1 1 2 3 4 5 6\n"),
              HasSubstr("t=#1,joint1.q=#2,joint2.q=#3,joint1.qd=#4,"
                        "joint2.qd=#5,joint1.tau=#6,joint2.tau=#7 if"));
  const sysid::Run run = Parse("0,1.5\n1,2\n", "t=#1,joint1.q=#2*2");
  EXPECT_THAT(run.t, ElementsAre(0, 1));
  EXPECT_EQ(run.channels[0].values(1, 0), 4.0);
}

TEST(ReadRunMessages, ReportsAMissingTimeColumn) {
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

TEST(ReadRunMessages, TheHintForForeignNamesReadsTheFile) {
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
       "'t=time [s],joint1.q=theta [rad],joint1.qd=omega [rad/s]'"},
      {"q1 (deg),v1 (deg/s),ms",
       "'t=ms*0.001,joint1.q=q1 (deg)*0.0174532925,"
       "joint1.qd=v1 (deg/s)*0.0174532925'"},
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

TEST(ReadRunMessages, TheHintSaysWhatItDoesNotKnow) {
  EXPECT_EQ(ParseError("time,a,b\n0,1,2\n"),
            "run.csv:1:1: there is no time column 't'\n"
            "  hint: name them by --columns t=time,joint1.q=COLUMN,"
            "joint2.q=COLUMN; the file's columns are time, a, b");
  EXPECT_EQ(ParseError("a,pos\n0,1\n"),
            "run.csv:1:1: there is no time column 't'\n"
            "  hint: name them by --columns t=COLUMN,joint1.q=pos; the file's "
            "columns are a, pos");
  EXPECT_THAT(ParseError("time,pos,i\n0,1,2\n", "joint1.tau=i*2"),
              HasSubstr("which is joint1.q: --columns t=time,joint1.q=pos,"
                        "joint1.tau=i*2"));
}

TEST(ReadRunMessages, ReportsTimeThatIsMissingOrDoesNotIncrease) {
  EXPECT_EQ(ParseError("t,joint1.q\n0,1\n,2\n"),
            "run.csv:3:1: no time in column 't'\n"
            "  hint: every row needs its time: fill it in, or remove the row");
  const std::string hint =
      "\n  hint: rows must be in the order of time; are two recordings in one "
      "file, or is the time rounded?";
  EXPECT_EQ(ParseError("t,joint1.q\n0,1\n# c\n0.5,2\n\n0.5,3\n"),
            "run.csv:6:1: time repeats: 0.5 s again (line 4)" + hint);
  EXPECT_EQ(
      ParseError("t,joint1.q\n0,1\n0.5,2\n0.25,2\n"),
      "run.csv:4:1: time goes back: from 0.5 s (line 3) to 0.25 s" + hint);
}

TEST(ReadRunMessages, ReportsTooFewRows) {
  const std::string hint = "\n  hint: a run needs at least two samples";
  EXPECT_EQ(ParseError("t,joint1.q\n"),
            "run.csv:1:1: there is a header but no row of data" + hint);
  EXPECT_EQ(ParseError("t,joint1.q\n0,1\n"),
            "run.csv:1:1: there is only one row of data" + hint);
}

TEST(ReadRunMessages, ReportsARunThatMeasuresNothing) {
  EXPECT_EQ(ParseError("t,pos_meas1,pos_meas2,vel_meas1,tau_con1\n0,1,2,3,4\n"),
            "run.csv:1:1: no column measures anything of chain\n"
            "  hint: its columns would be joint1.q, joint2.q; try --columns "
            "joint1.q=pos_meas1,joint2.q=pos_meas2,joint1.qd=vel_meas1,"
            "joint1.tau=tau_con1");
  EXPECT_EQ(ParseError("t,theta_deg\n0,1\n"),
            "run.csv:1:1: no column measures anything of chain\n"
            "  hint: its columns would be joint1.q, joint2.q; by the order of "
            "the columns, as no name says which is joint1.q: try --columns "
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

TEST(ReadRunMessages, ReportsIncompleteGroups) {
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

TEST(ReadRunMessages, ReportsAQuaternionFarFromUnit) {
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

TEST(ReadRunMessages, TakesColumnsWithoutNumbersAsNotRecorded) {
  std::vector<std::string> notices;
  const sysid::Run run =
      Parse("t,joint1.q,joint1.qd,joint2.q,joint1.tau\n0,1,,,\n1,2,nan,,nan\n",
            "", &notices);
  EXPECT_THAT(notices,
              ElementsAre("run.csv: no number in joint1.qd, joint1.tau, "
                          "joint2.q: taken as not recorded"));
  EXPECT_EQ(run.channels.size(), 1);
  EXPECT_FALSE(HasEffort(run, 0));
  // Nothing is left.
  EXPECT_EQ(ParseError("t,ball.qw,ball.qx,ball.qy,ball.qz\n0,,1,0,0\n"
                       "1,1,,0,0\n",
                       "", Ball()),
            "run.csv:1:2: nothing was measured in ball.qw, ball.qx, ball.qy, "
            "ball.qz: every row has a cell that is empty or nan\n"
            "  hint: remove the column where the quantity was not measured");
}

TEST(ReadRunMessages, LeavesOutRowsThatSayTheSame) {
  std::vector<std::string> notices;
  const std::string text = "t,joint1.q\n0,1\n0.5,2\n0.5,2\n0.5,2\n1,3\n";
  EXPECT_THAT(Parse(text, "", &notices).t, ElementsAre(0, 0.5, 1));
  EXPECT_THAT(
      notices,
      ElementsAre("run.csv: 2 rows of 5 say the same as the row before, "
                  "time included: left out"));
  // Places are those of the file.
  EXPECT_THAT(ParseError(text + "0.7,4\n"),
              StartsWith("run.csv:7:1: time goes back: from 1 s (line 6)"));
}

TEST(ReadRunMessages, TakesRoundedTimesAsEven) {
  std::vector<std::string> notices;
  std::string text = "t,joint1.q\n";
  for (int k = 0; k < 100; ++k) {
    text += std::to_string(0.01 * std::floor(0.5 * k)) + "," +
            std::to_string(k) + "\n";
  }
  const sysid::Run run = Parse(text, "", &notices);
  EXPECT_NEAR(run.t[51] - run.t[50], 0.005, 1e-9);
  EXPECT_THAT(notices,
              ElementsAre("run.csv: times repeat, as they have steps of 0.01 "
                          "s: the rows are taken as even, 0.005 s apart (200 "
                          "Hz), which agrees with each of them to its last "
                          "digit"));
  // Rows that no even step explains.
  EXPECT_THAT(ParseError(text + "3,1\n"), HasSubstr("time repeats: 0 s again"));
}

TEST(ReadRunMessages, CountsTimesSince1970FromTheFirst) {
  std::vector<std::string> notices;
  const sysid::Run run = Parse(
      "t,joint1.q\n1746215066.098755,1\n1746215066.100000,2\n", "", &notices);
  EXPECT_THAT(run.t, ElementsAre(0, 0.001245));
  EXPECT_THAT(notices,
              ElementsAre("run.csv: its times count from its first row, which "
                          "is at 1746215066.098755 s"));
}

TEST(ReadRunMessages, AFactorWinsOverTheRowOfUnits) {
  const std::string text = "t,a,b\nms,deg,rad\n0,180,1\n500,90,2\n";
  std::vector<std::string> notices;
  const sysid::Run run = Parse(text, "joint1.q=a,joint2.q=b", &notices);
  EXPECT_THAT(run.t, ElementsAre(0, 0.5));
  EXPECT_NEAR(run.channels[0].values(0, 0), M_PI, 1e-12);
  EXPECT_THAT(notices,
              ElementsAre("run.csv: the row of units behind the names is taken "
                          "at its word: joint1.q in deg, t in ms"));
  EXPECT_EQ(Parse(text, "joint1.q=a*1,joint2.q=b").channels[0].values(0, 0),
            180.0);
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

TEST(ReadRunMessages, ReportsAnglesThatLookLikeDegrees) {
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

TEST(ReadRunMessages, AFactorSettlesTheUnit) {
  const std::string text = SwingInDegrees("joint1.q", 60.0, 1.0);
  EXPECT_NEAR(
      Parse(text, "joint1.q=joint1.q*0.0174532925").channels[0].values(0, 0),
      1.0471975, 1e-6);
  EXPECT_EQ(Parse(text, "joint1.q=joint1.q*1").channels[0].values(0, 0), 60.0);
}

TEST(ReadRunMessages, ReportsCommandsThatLookLikeDegrees) {
  std::string text = "t,joint1.q,joint1.cmd\n";
  for (int k = 0; k <= 400; ++k) {
    const double t = 0.01 * k, q = std::sin(2 * M_PI * t);
    text += std::to_string(t) + "," + std::to_string(q) + "," +
            std::to_string(60.0 * q) + "\n";
  }
  EXPECT_THAT(ParseError(text), HasSubstr("run.csv:1:3: column 'joint1.cmd' "
                                          "looks like degrees, not radians"));
  EXPECT_EQ(ParseError(text, "joint1.cmd=joint1.cmd*0.01745"), "no error");
}

TEST(ReadRunMessages, NoticesSlowAnglesThatMayBeDegrees) {
  std::vector<std::string> notices;
  Parse(SwingInDegrees("joint1.q", 30.0, 0.2), "", &notices);
  EXPECT_THAT(notices,
              ElementsAre("run.csv: column 'joint1.q' may be in degrees: it "
                          "swings to and fro over 60.0: in radians 9.5 turns; "
                          "if so: --columns joint1.q=joint1.q*0.0174532925"));
}

TEST(ReadRunMessages, ReportsAVelocityThatLooksLikeDegrees) {
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

TEST(ReadRunMessages, ReportsAResultThatIsNotFinite) {
  EXPECT_EQ(
      ParseError("t,a,b\n0,1,2\n1,3,0\n", "joint1.q=a/b"),
      "run.csv:3:2: 'a/b' (joint1.q) is not finite here\n"
      "  hint: is there a division by zero, or a function without a value?");
  EXPECT_THAT(ParseError("t,a,b\n0,1,2\n1,0,0\n", "joint1.q=a/b"),
              StartsWith("run.csv:3:2: 'a/b' (joint1.q) is not finite"));
}

TEST(ReadRunMessages, ADifferenceOfDegreesLooksLikeDegrees) {
  std::string text = SwingInDegrees("a", 60.0, 1.0);
  EXPECT_THAT(ParseError(text, "joint1.q=a-t"),
              HasSubstr("'a-t' (joint1.q) looks like degrees"));
  EXPECT_THAT(ParseError(text, "joint1.q=a-t"),
              HasSubstr("--columns 'joint1.q=(a-t)*0.0174532925'"));
  EXPECT_EQ(ParseError(text, "joint1.q=(a-t)*1"), "no error");
}

}  // namespace
}  // namespace sysid
