#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "sysid/io/read_run.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/chain.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// What effects read of a run.

TEST(ReadInputsTest, ReadsInputsWithTheirKinds) {
  std::vector<std::string> notices;
  Mechanism mechanism = Hinges();
  mechanism.inputs = {"wind"};
  const sysid::Run run = Parse(
      "t,joint1.q,joint1.cmd,joint1.temperature,w\n"
      "0,0,,20,1\n0.1,0,2,,2\n0.2,0,,26,3\n0.3,0,5,27,4\n",
      "wind=w*2", &notices, mechanism);
  ASSERT_EQ(run.inputs.size(), 3u);
  EXPECT_EQ(run.inputs[0].name, "joint1.cmd");
  EXPECT_TRUE(run.inputs[0].held);
  // The first ahead of all, then held.
  EXPECT_THAT(run.inputs[0].values, ElementsAre(2, 2, 2, 5));
  EXPECT_EQ(run.inputs[1].name, "joint1.temperature");
  EXPECT_FALSE(run.inputs[1].held);
  EXPECT_THAT(run.inputs[1].values, ElementsAre(20, 23, 26, 27));
  EXPECT_EQ(run.inputs[2].name, "wind");
  EXPECT_THAT(run.inputs[2].values, ElementsAre(2, 4, 6, 8));
  EXPECT_THAT(notices,
              ::testing::Contains(HasSubstr("2 of 4 numbers of joint1.cmd are "
                                            "missing: each holds")));
  EXPECT_THAT(notices, ::testing::Contains(HasSubstr(
                           "1 of 4 numbers of joint1.temperature are missing: "
                           "they are taken on lines")));
}

TEST(ReadInputsTest, RefusesInputsThatAreNone) {
  EXPECT_THAT(ParseError("t,joint1.q,joint1.cmd\n0,1,\n0.1,2,\n"),
              HasSubstr("nothing was measured in joint1.cmd"));
  EXPECT_THAT(ParseError("t,joint1.q,w\n0,1,1\n0.1,2,2\n", "joint1q=w"),
              HasSubstr("joint1.q"));
  EXPECT_THAT(ParseError("t,joint1.q,w\n0,1,1\n0.1,2,2\n", "joint9.cmd=w"),
              HasSubstr("joint1.cmd"));
}

// The second derivative of positions, exact for a parabola away from the ends.
TEST(ReadInputsTest, DifferentiatesThePositionOfTheBase) {
  std::string text = "t,joint1.q,base.px,base.ay\n";
  for (int k = 0; k <= 40; ++k) {
    const double t = 0.01 * k;
    text += std::to_string(t) + ",0," + std::to_string(1.5 * t * t) + ",0.3\n";
  }
  const sysid::Run run = Parse(text);
  const auto input =
      [&](const std::string& name) -> const std::vector<double>& {
    for (const Input& one : run.inputs) {
      if (one.name == name) return one.values;
    }
    ADD_FAILURE() << name;
    return run.inputs.front().values;
  };
  // Positions of six decimals.
  for (int k = 12; k <= 28; ++k) EXPECT_NEAR(input("base.ax")[k], 3.0, 0.05);
  EXPECT_THAT(input("base.ay"), ::testing::Each(0.3));
  EXPECT_THAT(input("base.az"), ::testing::Each(0.0));
}

}  // namespace
}  // namespace sysid
