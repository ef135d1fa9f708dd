#include "sysid/io/joined_table.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "sysid/io/read_run.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/chain.h"
#include "tests/sysid/io/scratch_file.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Reads the run at `q` by a map in which "OTHER" is the other file's name.
Run Read(const ScratchFile& q, const ScratchFile& other, std::string columns) {
  const std::string name =
      std::filesystem::path(other.path()).filename().string();
  const size_t at = columns.find("OTHER");
  if (at != std::string::npos) columns.replace(at, 5, name);
  return ReadRun(q.path(), ParseColumnMap(columns), Hinges(), nullptr);
}

TEST(JoinedTable, JoinsByTimeAndInventsNoSample) {
  const ScratchFile q("q.csv", "t,- a\n0,1\n0.1,2\n0.2,3\n");
  const ScratchFile tau("tau.csv", "t,- a\n0.1,7\n0.15,8\n0.2000000001,9\n");
  const sysid::Run run =
      Read(q, tau, "joint1.q=- a,joint1.tau=\"OTHER/- a\"*2");
  EXPECT_THAT(run.t, ElementsAre(0, 0.1, 0.15, 0.2));
  const auto positions = run.channels[0].values.col(0);
  EXPECT_EQ(positions[1], 2.0);
  EXPECT_TRUE(std::isnan(positions[2]));
  EXPECT_EQ(positions[3], 3.0);
  // An effort acts until the next.
  const Eigen::VectorXd effort = run.effort.col(0);
  EXPECT_THAT(std::vector<double>(effort.begin(), effort.end()),
              ElementsAre(0, 14, 16, 18));
}

TEST(JoinedTable, EachFileHasTheTimeByTheSameExpression) {
  const ScratchFile q("q.csv", "ms,pos\n0,1\n100,2\n");
  const std::string columns = "t=ms*0.001,joint1.q=pos,joint1.qd=OTHER/x";
  const ScratchFile v("v.csv", "x,ms\n5,0\n6,100\n");
  const sysid::Run run = Read(q, v, columns);
  EXPECT_THAT(run.t, ElementsAre(0, 0.1));
  EXPECT_EQ(run.channels[1].values(1, 0), 6.0);
  const ScratchFile w("w.csv", "x,t\n5,0\n6,100\n");
  EXPECT_THAT(ErrorText([&] { Read(q, w, columns); }),
              HasSubstr("w.csv:1:1: there is no time 'ms*0.001'"));
}

TEST(JoinedTable, PlacesAreThoseOfTheFileAtFault) {
  const ScratchFile q("q.csv", "t,pos\n0,1\n0.1,2\n");
  const ScratchFile v("v.csv", "t,x\n0,5\n0.1,oops\n");
  EXPECT_THAT(ErrorText([&] { Read(q, v, "joint1.q=pos,joint1.qd=OTHER/x"); }),
              HasSubstr("v.csv:3:2: 'oops' in column 'x' is not a number"));
  EXPECT_THAT(
      ErrorText([&] { Read(q, v, "joint1.q=pos,joint1.qd=absent.csv/x"); }),
      HasSubstr("no column 'absent.csv"));
}

}  // namespace
}  // namespace sysid
