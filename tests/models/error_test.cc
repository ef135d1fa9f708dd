#include "models/error.h"

#include <gtest/gtest.h>

namespace sysid {
namespace {

TEST(InputError, ShowsNoControlCharactersOfItsInput) {
  const InputError error("run\x1b[2J.csv:1:1", "column 'a\x07\t\x7f'\n  b",
                         "\rmend it");
  EXPECT_STREQ(error.what(),
               "run?[2J.csv:1:1: column 'a?"
               "?"
               "?'\n  b\n  hint: ?mend it");
  EXPECT_EQ(error.place(), "run\x1b[2J.csv:1:1");  // as it was given
}

}  // namespace
}  // namespace sysid
