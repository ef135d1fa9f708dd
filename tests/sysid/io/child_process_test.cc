#include "sysid/io/child_process.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <string>

namespace sysid {
namespace {

std::string ReadAll(std::FILE* in) {
  std::string text;
  for (int c = std::fgetc(in); c != EOF; c = std::fgetc(in)) {
    text += static_cast<char>(c);
  }
  return text;
}

TEST(ChildProcessTest, GivesWhatItWrites) {
  ChildProcess child([](std::FILE* out) { std::fputs("hello", out); }, 10);
  EXPECT_EQ(ReadAll(child.out()), "hello");
  EXPECT_EQ(child.Finish(), "");
}

TEST(ChildProcessTest, SaysHowItFailed) {
  ChildProcess child(
      [](std::FILE* out) {
        std::fputs("half", out);
        std::fflush(out);
        raise(SIGSEGV);
      },
      10);
  EXPECT_EQ(ReadAll(child.out()), "half");
  EXPECT_EQ(child.Finish(), "Segmentation fault");
  ChildProcess aborted([](std::FILE*) { std::abort(); }, 10);
  EXPECT_EQ(aborted.Finish(), "Aborted");
}

TEST(ChildProcessTest, EndsWhatFindsNoEnd) {
  ChildProcess child(
      [](std::FILE*) {
        while (std::atoi("0") == 0) {
        }
      },
      1);
  EXPECT_EQ(ReadAll(child.out()), "");
  EXPECT_EQ(child.Finish(), "it found no end");
}

TEST(ChildProcessTest, KillsWhatNobodyWaitsFor) {
  // Writes for ever; the destructor returns.
  ChildProcess child(
      [](std::FILE* out) {
        while (std::fputs("more", out) >= 0) {
        }
      },
      100);
  EXPECT_EQ(std::fgetc(child.out()), 'm');
}

}  // namespace
}  // namespace sysid
