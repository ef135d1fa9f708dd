#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>

#include "sysid/io/read_run.h"
#include "tests/sysid/io/chain.h"

namespace sysid {
namespace {

constexpr int kRows = 10'000'000;

// Writes the rows of a run of 10 million samples, about 0.4 GB, into a pipe: it
// is nowhere whole. A third of it is a column that nobody asks for.
void WriteRows(const std::string& pipe) {
  std::FILE* const out = std::fopen(pipe.c_str(), "w");
  ASSERT_NE(out, nullptr);
  std::fputs("time_ms;note;joint1.q;joint2.q\n", out);
  for (int i = 0; i < kRows; ++i) {
    std::fprintf(out, "%d;not looked at;0,%04d;%d\n", i, i % 10000, i & 1);
  }
  std::fclose(out);
}

int64_t PeakBytes() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return int64_t{usage.ru_maxrss} * 1024;
}

// What is kept is t, a position of each of two joints, and an effort of each
// (zero: there is none). While the rows come t is copied to where there is room
// for more (a half of it is what lies there then), and pages of what grows are
// moved, not copied. Beside the numbers: the blocks of the text (6 MiB), the
// first 2^20 samples of a channel, looked at for degrees (10 numbers each), and
// what the program itself takes on the way.
TEST(LongRunTest, TakesTheRoomOfItsNumbers) {
  const std::string pipe =
      ::testing::TempDir() + "long_run_" + std::to_string(getpid());
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int64_t before = PeakBytes();
  std::thread writer(WriteRows, pipe);
  const sysid::Run run = ReadRun(
      pipe, ParseColumnMap("t=time_ms*0.001,joint2.q=joint2.q-joint1.q"),
      Hinges(), nullptr);
  writer.join();
  std::filesystem::remove(pipe);
  const int64_t grown = PeakBytes() - before;
  ASSERT_EQ(run.size(), kRows);
  EXPECT_EQ(run.t.back(), (kRows - 1) * 0.001);
  EXPECT_EQ(run.channels[0].values(kRows - 1, 0), 0.9999);
  EXPECT_EQ(run.channels[1].values(kRows - 1, 0), 1 - 0.9999);
  const int64_t numbers = int64_t{5} * kRows * 8;
  const int64_t copied = int64_t{kRows} * 8;
  const int64_t beside =
      (int64_t{6} << 20) + 10 * (int64_t{8} << 20) + (int64_t{16} << 20);
  std::printf("%.0f MB of numbers, peak %.0f MB\n", 1e-6 * numbers,
              1e-6 * grown);
  EXPECT_GT(grown, numbers / 2);  // it is measured at all
  EXPECT_LT(grown, numbers + copied + beside);
}

}  // namespace
}  // namespace sysid
