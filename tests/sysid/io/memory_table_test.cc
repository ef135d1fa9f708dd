#include "sysid/io/memory_table.h"

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "models/error.h"
#include "sysid/io/read_run.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::ThrowsMessage;

Mechanism OneHinge() {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  Joint joint;
  joint.name = "joint1";
  joint.type = JointType::kContinuous;
  joint.parent_link = 0;
  mechanism.AddJoint(joint, "link1", Eigen::Vector3d::Zero(), {});
  return mechanism;
}

Run Read(size_t rows, const std::vector<MemoryTable::Column>& columns,
         std::vector<std::string>* notices = nullptr) {
  return ReadTable(std::make_unique<MemoryTable>("run 1", rows, columns), {},
                   OneHinge(), notices);
}

TEST(MemoryTable, IsReadAsAFileIs) {
  // Two columns of a matrix, and one alone with missing numbers.
  const double table[] = {0.0, 0.1, 0.01, 0.2, 0.02, std::nan("")};
  const double tau[] = {std::nan(""), 2.0, std::nan("")};
  std::vector<std::string> notices;
  const sysid::Run run = Read(
      3, {{"t", table, 2}, {"joint1.q", table + 1, 2}, {"joint1.tau", tau, 1}},
      &notices);
  EXPECT_EQ(run.name, "run 1");
  EXPECT_THAT(run.t, ElementsAre(0.0, 0.01, 0.02));
  ASSERT_EQ(run.channels.size(), 1u);
  EXPECT_EQ(run.channels[0].values(1, 0), 0.2);
  EXPECT_TRUE(std::isnan(run.channels[0].values(2, 0)));
  EXPECT_EQ(run.effort, (RowMatrixXd(3, 1) << 0.0, 2.0, 2.0).finished());
  EXPECT_THAT(notices, ElementsAre("run 1: 2 of 3 efforts in joint1.tau are "
                                   "missing: each holds the value before it; "
                                   "the first 1 are taken as zero"));
}

TEST(MemoryTable, NamesTheElementThatIsWrong) {
  const double t[] = {0.0, 0.01, 0.02};
  const double back[] = {0.0, 0.01, 0.01};
  const double q[] = {0.1, 0.2, std::numeric_limits<double>::infinity()};
  EXPECT_THAT(
      [&] {
        Read(3, {{"t", t, 1}, {"joint1.q", q, 1}});
      },
      ThrowsMessage<InputError>("run 1, joint1.q[2]: is infinite\n"
                                "  hint: a missing measurement is "
                                "nan"));
  EXPECT_THAT(
      [&] {
        Read(3, {{"t", back, 1}, {"joint1.q", t, 1}});
      },
      ThrowsMessage<InputError>(::testing::StartsWith("run 1, t[2]: ")));
  EXPECT_THAT(
      [&] {
        Read(3, {{"t", t, 1}, {"t", q, 1}});
      },
      ThrowsMessage<InputError>("run 1: has two columns 't'\n"
                                "  hint: leave one of them out"));
}

}  // namespace
}  // namespace sysid
