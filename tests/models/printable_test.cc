#include "models/printable.h"

#include <gtest/gtest.h>

namespace sysid {
namespace {

TEST(Printable, KeepsTextOfOtherLanguages) {
  EXPECT_EQ(Printable("Größe 5\n\xc2\xb0 \u20ac \U0001F916"),
            "Größe 5\n\xc2\xb0 \u20ac \U0001F916");
}

TEST(Printable, ShowsControlsAsQuestionMarks) {
  EXPECT_EQ(Printable("\x1b[2J\r\t\x7f"), "?[2J???");
  EXPECT_EQ(Printable(std::string("a\0b", 3)), "a?b");
  EXPECT_EQ(Printable("\u009b31m\u0080\u00a0"), "?31m?\u00a0");
}

TEST(Printable, ShowsWhatIsNoUtf8AsQuestionMarks) {
  // Latin-1, cut off, longer than it must be, half of a pair, beyond U+10FFFF.
  EXPECT_EQ(Printable("caf\xe9 \x9b"), "caf? ?");
  EXPECT_EQ(Printable("\xe2\x82"), "??");
  EXPECT_EQ(Printable("\xc0\xaf"), "??");
  EXPECT_EQ(Printable("\xed\xa0\x80"), "???");
  EXPECT_EQ(Printable("\xf4\x90\x80\x80"), "????");
  for (const char* bytes : {"caf\xe9", "\xe2\x82", "\xc0\xaf", "\xed\xa0\x80",
                            "\xf4\x90\x80\x80"}) {
    EXPECT_FALSE(IsUtf8(bytes)) << bytes;
  }
  EXPECT_TRUE(IsUtf8("Größe \u20ac \U0001F916"));
}

TEST(Printable, LineFeedsAndTabsAreControls) {
  for (const char* text : {"a\n", "\t", "\x1b", "\x7f", "\u009b"}) {
    EXPECT_TRUE(HasControls(text)) << text;
  }
  for (const char* text : {"", "Größe \u20ac", "\u00a0", "\xe9"}) {
    EXPECT_FALSE(HasControls(text)) << text;
  }
}

}  // namespace
}  // namespace sysid
