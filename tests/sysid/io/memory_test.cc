#include "sysid/io/memory.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include "tests/support/error_text.h"

namespace sysid {
namespace {

TEST(Memory, IsAtMostThatOfTheMachine) {
  const double machine = static_cast<double>(sysconf(_SC_PHYS_PAGES)) *
                         static_cast<double>(sysconf(_SC_PAGESIZE));
  EXPECT_GT(MemoryLimit(), 0.0);
  EXPECT_LE(MemoryLimit(), machine);
}

TEST(Memory, IsRefusedWhereThereIsNotAsMuch) {
  CheckMemory(MemoryLimit(), "--draws", "that", "less");
  const std::string text =
      ErrorText([] { CheckMemory(3.21e18, "--draws", "a history", "less"); });
  EXPECT_THAT(text, ::testing::StartsWith("--draws: a history needs 3.21 EB of "
                                          "memory, and this machine has "));
  EXPECT_THAT(text, ::testing::EndsWith("\n  hint: less"));
}

}  // namespace
}  // namespace sysid
