#include "sysid/report/svg_plot.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

namespace sysid {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const PlotBox kBox{100, 50, 200, 100};

TEST(AxisOver, HoldsAllFiniteValues) {
  const double nan = std::nan(""),
               inf = std::numeric_limits<double>::infinity();
  const PlotAxis axis = AxisOver("x", {1.0, nan, 3.0, inf});
  EXPECT_LT(axis.lower, 1.0);
  EXPECT_GT(axis.upper, 3.0);
  EXPECT_LT(axis.upper, 3.5);
  const PlotAxis decades = AxisOver("y", {-1.0, 0.0, 1e-6, 1.0}, true);
  EXPECT_GT(decades.lower, 1e-7);
  EXPECT_LT(decades.lower, 1e-6);
  for (const PlotAxis& empty :
       {AxisOver("x", {}), AxisOver("x", {0.0}), AxisOver("x", {nan}, true)}) {
    EXPECT_LT(empty.lower, empty.upper);
  }
}

TEST(SvgPanel, PlacesPointsByItsAxes) {
  SvgPanel panel(kBox, {"x", 0.0, 2.0, false}, {"y", 1e-2, 1.0, true}, "t");
  // The middle; y upwards, by decades.
  panel.Marker(1.0, 0.1, "red");
  EXPECT_THAT(panel.Text(), HasSubstr("cx=\"200\" cy=\"100\""));
  panel.Line({0.0, 2.0}, {1e-2, 1.0}, "blue");
  EXPECT_THAT(panel.Text(), HasSubstr("points=\"100,150 300,50\""));
}

TEST(SvgPanel, InterruptsALineWhereThereIsNoPoint) {
  SvgPanel panel(kBox, {"x", 0.0, 4.0, false}, {"y", 0.1, 1.0, true}, "t");
  panel.Line({0, 1, 2, 3, 4}, {0.1, 0.1, -1.0, 1.0, 1.0}, "blue");
  const std::string text = panel.Text();
  EXPECT_THAT(text, AllOf(HasSubstr("points=\"100,150 150,150\""),
                          HasSubstr("points=\"250,50 300,50\"")));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(SvgFigure, EscapesItsTexts) {
  SvgPanel panel(kBox, {"a < b & \"c\"", 0.0, 1.0, false},
                 {"y", 0.0, 1.0, false}, "t");
  const std::string text =
      SvgFigure(400, 300, "<title>", {panel}, {{"one", "#123456", ""}});
  EXPECT_THAT(text, AllOf(HasSubstr("a &lt; b &amp; &quot;c&quot;"),
                          HasSubstr("&lt;title&gt;"), HasSubstr("#123456"),
                          testing::EndsWith("</svg>\n")));
}

}  // namespace
}  // namespace sysid
