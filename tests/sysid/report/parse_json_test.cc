#include <gtest/gtest.h>

#include "sysid/report/json.h"

namespace sysid {
namespace {

std::string Nested(const std::string& open, int depth,
                   const std::string& close) {
  std::string text;
  for (int i = 0; i < depth; ++i) text += open;
  text += "1";
  for (int i = 0; i < depth; ++i) text += close;
  return text;
}

TEST(ParseJson, IsNoneOfATextThatIsNoJson) {
  for (const char* text : {"", "{", "[1,]", "nul", "{\"a\":1}}", "1e999",
                           "\"\xff\"", "\"\\ud800\""}) {
    EXPECT_FALSE(ParseJson(text)) << text;
  }
  EXPECT_EQ(ParseJson(" {\"b\": [1, {}], \"a\": null}")->dump(),
            "{\"b\":[1,{}],\"a\":null}");
  EXPECT_TRUE(ParseJson("null")->is_null());
}

TEST(ParseJson, IsNoneBeyondTheDepth) {
  for (const auto& [open, close] :
       {std::pair{"[", "]"}, {"{\"a\":", "}"}, {"[0,", ",0]"}}) {
    const std::string most = Nested(open, kMostJsonDepth, close);
    ASSERT_TRUE(ParseJson(most));
    EXPECT_EQ(ParseJson(most)->dump(), most);
    EXPECT_FALSE(ParseJson(Nested(open, kMostJsonDepth + 1, close)));
    EXPECT_FALSE(ParseJson(Nested(open, 1000000, close)));
  }
}

}  // namespace
}  // namespace sysid
