#include "sysid/io/bag_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "sysid/io/decompress.h"
#include "sysid/io/read_run.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/bag_writer.h"
#include "tests/sysid/io/chain.h"
#include "tests/sysid/io/read_columns.h"
#include "tests/sysid/io/scratch_file.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsNan;
using W = BagWriter;

constexpr char kType[] = "sensor_msgs/JointState";

// Two joints with all they have, at 0, 0.5, 1 ... s.
std::string Swing(int messages, uint32_t connection = 0) {
  std::string records;
  for (int i = 0; i < messages; ++i) {
    records += W::Message(connection, 1000 + i,
                          W::JointState(1600000000 + i / 2, i % 2 * 500000000,
                                        {"joint1", "joint2"}, {0.1 * i, 2.0},
                                        {0.2, 3.0}, {0.5, -0.5}));
  }
  return records;
}

std::string PlainBag() {
  const std::string records = W::Connection(0, "/joint_states", kType) +
                              W::Connection(1, "/odom", "nav_msgs/Odometry") +
                              W::Message(1, 1000, "not looked at") + Swing(5);
  return W::Bag(W::Chunk("none", records, records.size()));
}

std::string OpenError(const std::string& bytes, const std::string& topic = "") {
  const ScratchFile file("run.bag", bytes);
  const std::string text = ErrorText(
      [&] { ReadColumns(*OpenBagFile(ByteSource(file.path()), topic), {0}); });
  // Without the folder.
  return text.substr(text.find("run.bag"));
}

TEST(BagFileTest, ReadsJointStatesAsARun) {
  const ScratchFile file("run.bag", PlainBag());
  std::vector<std::string> notices;
  const sysid::Run run = ReadRun(file.path(), {}, Hinges(), &notices);
  EXPECT_THAT(run.t, ElementsAre(0, 0.5, 1, 1.5, 2));
  ASSERT_EQ(run.channels.size(), 4u);
  EXPECT_EQ(run.channels[0].name, "joint1");
  EXPECT_EQ(run.channels[0].values(3, 0), 0.1 * 3);
  EXPECT_EQ(run.channels[1].name, "joint1.qd");
  EXPECT_EQ(run.channels[3].values(4, 0), 3.0);
  EXPECT_EQ(run.effort(2, 1), -0.5);
  EXPECT_THAT(notices,
              ElementsAre(file.path() +
                          ": messages of /joint_states; t counts from the "
                          "first one, by their stamps"));
}

TEST(BagFileTest, MapsJointsOfOtherNames) {
  const std::string records =
      W::Connection(0, "/js", kType) +
      W::Message(0, 1, W::JointState(1, 0, {"elbow"}, {90})) +
      W::Message(0, 2, W::JointState(2, 0, {"elbow"}, {45}));
  const ScratchFile file("run.bag", W::Bag(records));
  const sysid::Run run =
      ReadRun(file.path(), ParseColumnMap("joint2.q=(elbow.q-45)/45"), Hinges(),
              nullptr);
  EXPECT_EQ(run.channels[0].values(0, 0), 1.0);
}

TEST(BagFileTest, MessagesMayHaveOtherJoints) {
  const std::string records =
      W::Connection(0, "/js", kType) + W::Connection(1, "/js", kType) +
      W::Message(0, 1, W::JointState(1, 0, {"a"}, {1})) +
      W::Message(1, 1, W::JointState(1, 0, {"b"}, {2}, {3})) +
      W::Message(0, 2, W::JointState(2, 0, {"a"}, {4})) +
      W::Message(1, 2, W::JointState(3, 0, {"b"}, {5}));
  const ScratchFile file("run.bag", W::Bag(records));
  const std::unique_ptr<TableFile> bag =
      OpenBagFile(ByteSource(file.path()), "");
  EXPECT_THAT(bag->header(), ElementsAre("t", "a.q", "b.q", "b.qd"));
  const Table table = ReadColumns(*bag, {0, 1, 2, 3});
  // Of one stamp: one row.
  EXPECT_THAT(table.columns[0], ElementsAre(0, 1, 2));
  EXPECT_THAT(table.columns[1], ElementsAre(1, 4, IsNan()));
  EXPECT_THAT(table.columns[2], ElementsAre(2, IsNan(), 5));
  EXPECT_THAT(table.columns[3], ElementsAre(3, IsNan(), IsNan()));
  EXPECT_EQ(bag->RowName(1), "message 3");
  EXPECT_EQ(bag->Place(2, 1), file.path() + ":/js: message 4");
}

TEST(BagFileTest, CountsByReceiptWhereStampsAreMissing) {
  const std::string records =
      W::Connection(0, "/js", kType) +
      W::Message(0, 7, W::JointState(0, 0, {"a"}, {1})) +
      W::Message(0, 9, W::JointState(0, 0, {"a"}, {4}));
  const ScratchFile file("run.bag", W::Bag(records));
  const std::unique_ptr<TableFile> bag =
      OpenBagFile(ByteSource(file.path()), "");
  EXPECT_THAT(ReadColumns(*bag, {0}).columns[0], ElementsAre(0, 2));
  EXPECT_THAT(bag->notices()[0], HasSubstr("some carry no stamp"));
}

TEST(BagFileTest, ReportsTimeThatRepeatsWithItsMessages) {
  const std::string records =
      W::Connection(0, "/js", kType) +
      W::Message(0, 7, W::JointState(5, 0, {"joint1"}, {1})) +
      W::Message(0, 9, W::JointState(5, 0, {"joint1"}, {4}));
  const ScratchFile file("run.bag", W::Bag(records));
  EXPECT_THAT(
      ErrorText([&] { ReadRun(file.path(), {}, Hinges(), nullptr); }),
      HasSubstr("run.bag:/js: message 2: time repeats: 0 s again (message 1)"));
}

TEST(BagFileTest, AsksWhichOfSeveralTopics) {
  const std::string records = W::Connection(0, "/left", kType) +
                              W::Connection(1, "/right", kType) + Swing(2) +
                              Swing(3, 1);
  EXPECT_THAT(OpenError(W::Bag(records)),
              HasSubstr("several topics of the type sensor_msgs/JointState: "
                        "/left, /right\n  hint: choose one: "));
  EXPECT_THAT(OpenError(W::Bag(records), "/rigth"),
              HasSubstr("no topic '/rigth' of the type sensor_msgs/JointState\n"
                        "  hint: did you mean '/right'?"));
  const ScratchFile file("run.bag", W::Bag(records));
  EXPECT_EQ(ReadRun(file.path() + ":/right", {}, Hinges(), nullptr).size(), 3);
}

TEST(BagFileTest, ReportsABagWithoutJointStates) {
  EXPECT_EQ(OpenError(W::Bag(W::Connection(0, "/odom", "nav_msgs/Odometry") +
                             W::Message(0, 1, "x"))),
            "run.bag: no topic of the type sensor_msgs/JointState\n"
            "  hint: its topics are /odom (nav_msgs/Odometry)");
  EXPECT_THAT(OpenError(W::Bag("")), HasSubstr("it holds no messages"));
  EXPECT_THAT(OpenError("#ROSBAG V1.2\n"), HasSubstr("rosbag migrate"));
}

TEST(BagFileTest, RefusesWhatTheFileCannotHold) {
  const std::string hint =
      "\n  hint: it is damaged or cut off: try `rosbag reindex`, or record "
      "again";
  EXPECT_EQ(OpenError("#ROSBAG V2.0\n" + W::U32(0xfffffff0u) + "op=x"),
            "run.bag: a record's header claims 4294967280 bytes, but the file "
            "has 4 more (in the record at byte 13)" +
                hint);
  // A message that claims more joints than it has bytes.
  std::string message = W::JointState(1, 0, {"a"}, {1});
  message.replace(message.find("arm") + 3, 4, W::U32(0xffffffffu));
  EXPECT_EQ(OpenError(W::Bag(W::Connection(0, "/js", kType) +
                             W::Message(0, 1, message))),
            "run.bag: message 1 of /js is shorter than it claims\n"
            "  hint: is it a sensor_msgs/JointState of ROS 1?");
  EXPECT_THAT(
      OpenError(W::Bag(W::Connection(0, "/js", kType) +
                       W::Message(0, 1, W::JointState(1, 0, {"a"}, {1, 2})))),
      HasSubstr("message 1 of /js has 2 values for 1 joint"));
  EXPECT_THAT(OpenError(W::Bag(W::Message(3, 1, "x"))),
              HasSubstr("a message of the connection 3, which is not there"));
  EXPECT_THAT(OpenError(W::Bag(W::Chunk("zip", "x", 1))),
              HasSubstr("unknown compression 'zip'"));
  EXPECT_THAT(OpenError(W::Bag(W::Chunk("bz2", "BZh9x", 0xffffffffu))),
              HasSubstr("a chunk of more than 1 GiB"));
}

// Every cut and many random bytes: read, or refused in our words.
TEST(BagFileTest, SurvivesDamage) {
  const std::string bag = PlainBag();
  int refused = 0;
  const auto survives = [&](const std::string& bytes) {
    const ScratchFile file("damaged.bag", bytes);
    try {
      ReadColumns(*OpenBagFile(ByteSource(file.path()), ""), {0});
    } catch (const InputError&) {
      ++refused;
    }
  };
  for (size_t n = 0; n < bag.size(); n += n < 4300 && n > 200 ? 500 : 7) {
    survives(bag.substr(0, n));
  }
  const int cut = refused;
  EXPECT_GT(cut, 100);
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = bag;
    for (int k = 0; k < 3; ++k) {
      bytes[4000 + random() % (bytes.size() - 4000)] =
          static_cast<char>(random());
    }
    survives(bytes);
  }
  EXPECT_GT(refused, cut + 200);
}

}  // namespace
}  // namespace sysid
