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

// Zeros that stand in a file are efforts.
TEST(ReadRunTest, TellsARecordedEffortOfZeroFromNone) {
  const sysid::Run run = Parse("t,joint1.q,joint2.tau\n0,1,0\n1,2,0\n");
  EXPECT_TRUE(run.effort.isZero(0.0));
  EXPECT_FALSE(HasEffort(run, 0));
  EXPECT_TRUE(HasEffort(run, 1));
  EXPECT_TRUE(HasEffort(run, 0, 2));
}

TEST(ReadRunTest, SaysWhatAFactorForTheTimeWouldMultiply) {
  const auto source = [](const std::string& t) {
    return Parse("clock,/js/time,joint1.q,t\n0,0,1,0\n1,1,2,1\n",
                 t.empty() ? "" : "t=" + t)
        .time_source;
  };
  EXPECT_EQ(source(""), "t");
  EXPECT_EQ(source("clock"), "clock");
  EXPECT_EQ(source("clock-5"), "(clock-5)");
  EXPECT_EQ(source("/js/time"), "\"/js/time\"");
  EXPECT_EQ(source("clock*1"), "");
  EXPECT_EQ(source("\"/js/time\"/5"), "");
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
          "'joint1.qw'; its columns are joint1.q, joint1.qd, joint1.motor_q, "
          "joint1.tau): --columns joint2.q=COLUMN maps one"));
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
