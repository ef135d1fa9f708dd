#include "sysid/estimation/processes.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <random>

#include "tests/support/thread_processes.h"

namespace sysid {
namespace {

TEST(LongSum, DoesNotDependOnTheOrder) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> numbers;
  for (int i = 0; i < 1000; ++i) {
    numbers.push_back(normal(random) * std::pow(10.0, i % 20 - 10));
  }
  std::vector<double> sums;
  for (int order = 0; order < 20; ++order) {
    std::shuffle(numbers.begin(), numbers.end(), random);
    LongSum first, second;
    for (size_t i = 0; i < numbers.size(); ++i) {
      (i < numbers.size() / 3 ? first : second) += numbers[i];
    }
    second += first;
    sums.push_back(second.Value());
  }
  EXPECT_THAT(sums, ::testing::Each(sums[0]));
}

TEST(LongSum, KeepsWhatIsNoNumber) {
  LongSum sum;
  sum += 1.0;
  sum += std::numeric_limits<double>::infinity();
  sum += 2.0;
  EXPECT_EQ(sum.Value(), std::numeric_limits<double>::infinity());
}

TEST(MedianOver, IsThatOfAllNumbers) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(1e-4, 10.0);
  for (const int count : {1, 2, 7, 100}) {
    std::vector<double> numbers;
    for (int i = 0; i < count; ++i) numbers.push_back(uniform(random));
    std::vector<double> sorted = numbers;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(MedianOver(Alone(), numbers), sorted[count / 2]);
    ThreadProcesses(3).Run([&](const Processes& all) {
      // The first has none.
      std::vector<double> own;
      for (int i = 0; i < count; ++i) {
        if (1 + i % 2 == all.rank()) own.push_back(numbers[i]);
      }
      EXPECT_EQ(MedianOver(all, own), sorted[count / 2]);
    });
  }
  EXPECT_EQ(MedianOver(Alone(), {}), 0.0);
}

TEST(GatherToAll, SaysAllOfThemByRank) {
  ThreadProcesses(3).Run([](const Processes& all) {
    const std::string own(all.rank(), 'a' + all.rank());
    EXPECT_THAT(GatherToAll(all, own), ::testing::ElementsAre("", "b", "cc"));
    EXPECT_FALSE(AllTrue(all, all.rank() != 1));
    EXPECT_TRUE(AllTrue(all, true));
    EXPECT_EQ(SumOver(all, 1.5), 4.5);
  });
}

TEST(Unpacker, ReadsWhatWasPacked) {
  Packer packer;
  packer.Put(1.5);
  packer.Put(std::string("two"));
  packer.Put(RowMatrixXd::Identity(2, 3).eval());
  Unpacker unpacker(packer.bytes());
  EXPECT_EQ(unpacker.Number(), 1.5);
  EXPECT_EQ(unpacker.Text(), "two");
  EXPECT_EQ(unpacker.Matrix(), RowMatrixXd::Identity(2, 3));
  EXPECT_TRUE(unpacker.AtEnd());
  EXPECT_FALSE(unpacker.failed());
}

TEST(Unpacker, SaysThatThereIsNoMore) {
  Packer packer;
  packer.Put(std::string("two"));
  const std::string half = packer.bytes().substr(0, 10);
  Unpacker unpacker(half);
  EXPECT_EQ(unpacker.Text(), "");
  EXPECT_TRUE(unpacker.failed());
  EXPECT_EQ(unpacker.Number(), 0.0);
}

}  // namespace
}  // namespace sysid
