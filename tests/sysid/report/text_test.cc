#include "sysid/report/text.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sysid {
namespace {

TEST(Times, HasThreeDigitsAndNoExponentInASentence) {
  EXPECT_EQ(Times(0.98765), "0.988");
  EXPECT_EQ(Times(999.4), "999");
  EXPECT_EQ(Times(999.6), "1000");
  EXPECT_EQ(Times(1094.9), "1090");
  EXPECT_EQ(Times(54321.0), "54300");
  EXPECT_EQ(Times(INFINITY), "inf");
}

TEST(Text, ListsManyEffectsByTheirKind) {
  EXPECT_EQ(ListEffects({"spring@a", "armature@b"}, " and "),
            "spring@a and armature@b");
  EXPECT_EQ(
      ListEffects({"spring@a", "armature@a", "spring@b", "armature@c"}, ", "),
      "spring (a, b), armature (a, c)");
}

}  // namespace
}  // namespace sysid
