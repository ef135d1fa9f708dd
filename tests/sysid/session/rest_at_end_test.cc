#include "sysid/session/rest_at_end.h"

#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <vector>

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A swing that stops at this time, of 20 s at 50 Hz.
sysid::Run Swing(double stops) {
  sysid::Run run;
  run.name = "run.csv";
  for (int k = 0; k <= 1000; ++k) run.t.push_back(0.02 * k);
  run.effort = RowMatrixXd::Zero(run.size(), 1);
  Channel channel;
  channel.target = 0;
  channel.values.resize(run.size(), 1);
  for (int k = 0; k < run.size(); ++k) {
    channel.values(k, 0) = run.t[k] < stops ? std::sin(3.0 * run.t[k]) : 0.0;
  }
  run.channels.push_back(channel);
  return run;
}

int SizeLeft(sysid::Run run, std::vector<std::string>* notices) {
  std::vector<sysid::Run> runs = {std::move(run)};
  LeaveOutRestAtEnd(&runs, notices);
  return runs[0].size();
}

TEST(RestAtEnd, IsLeftOutButForASecond) {
  std::vector<std::string> notices;
  EXPECT_NEAR(SizeLeft(Swing(10.0), &notices), 550, 2);
  EXPECT_THAT(notices,
              ElementsAre("run.csv: at rest from 9.98 s to its end, which "
                          "decides between no laws: left out but for a "
                          "second"));
}

TEST(RestAtEnd, StaysWhereItIsShortOrSomethingActs) {
  std::vector<std::string> notices;
  EXPECT_EQ(SizeLeft(Swing(17.5), &notices), 1001);
  EXPECT_EQ(SizeLeft(Swing(30.0), &notices), 1001);
  sysid::Run driven = Swing(10.0);
  driven.effort(3, 0) = 1.0;
  EXPECT_EQ(SizeLeft(driven, &notices), 1001);
  EXPECT_THAT(notices, IsEmpty());
}

}  // namespace
}  // namespace sysid
