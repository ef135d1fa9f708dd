#include "sysid/io/write_run.h"

#include <gtest/gtest.h>

#include <limits>

#include "sysid/io/read_run.h"
#include "tests/sysid/io/chain.h"

namespace sysid {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Run SmallRun() {
  Run run;
  run.t = {0.0, 0.1, 1.0 / 3.0};
  Channel position;
  position.kind = ChannelKind::kPosition;
  position.target = 1;
  position.name = "hinge";
  position.values.resize(3, 1);
  position.values << 0.1, kNan, 2.0 / 3.0;
  Channel ball;
  ball.kind = ChannelKind::kOrientation;
  ball.target = 0;
  ball.name = "ball";
  ball.values.resize(3, 4);
  ball.values << 0, 0, 0, 1, 0.6, 0, 0, 0.8, kNan, kNan, kNan, kNan;
  run.channels = {ball, position};
  run.effort = RowMatrixXd::Zero(3, 4);
  run.effort(1, 3) = 0.25;
  return run;
}

Mechanism BallAndHinge() {
  return Chain(
      {{"ball", JointType::kSpherical}, {"hinge", JointType::kRevolute}});
}

TEST(WriteRunTest, WritesTheContractsColumns) {
  EXPECT_EQ(FormatRun(BallAndHinge(), SmallRun(), {"made by", "two\nlines"}),
            "# made by\n"
            "# two\n"
            "# lines\n"
            "t,ball.qw,ball.qx,ball.qy,ball.qz,hinge.q,hinge.tau\n"
            "0,1,0,0,0,0.1,0\n"
            "0.1,0.8,0.6,0,0,,0.25\n"
            "0.3333333333333333,,,,,0.6666666666666666,0\n");
}

TEST(WriteRunTest, WritesARecordedEffortOfZero) {
  sysid::Run run = SmallRun();
  run.effort.setZero();
  const auto header = [&] {
    const std::string text = FormatRun(BallAndHinge(), run, {});
    return text.substr(0, text.find('\n'));
  };
  EXPECT_EQ(header(), "t,ball.qw,ball.qx,ball.qy,ball.qz,hinge.q");
  run.recorded_efforts = {false, false, false, true};
  EXPECT_EQ(header(), "t,ball.qw,ball.qx,ball.qy,ball.qz,hinge.q,hinge.tau");
}

TEST(WriteRunTest, ReadsBackAsItWas) {
  const Mechanism mechanism = BallAndHinge();
  const sysid::Run run = SmallRun();
  const sysid::Run back =
      ParseRun("run.csv", FormatRun(mechanism, run), {}, mechanism, nullptr);
  EXPECT_EQ(back.t, run.t);
  EXPECT_EQ(back.effort, run.effort);
  ASSERT_EQ(back.channels.size(), run.channels.size());
  for (size_t i = 0; i < run.channels.size(); ++i) {
    EXPECT_EQ(back.channels[i].name, run.channels[i].name);
    EXPECT_TRUE(
        ((back.channels[i].values.array() == run.channels[i].values.array()) ||
         run.channels[i].values.array().isNaN())
            .all());
  }
}

}  // namespace
}  // namespace sysid
