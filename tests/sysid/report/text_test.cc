#include "sysid/report/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "models/effects/catalogue.h"
#include "tests/support/all_joints.h"

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

// An arm's fit: of two masses their sum shows, of an effect all.
TEST(BaseTable, HasCombinationsAndWhatOtherwiseShows) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  AddSomeJoint("joint1", JointType::kRevolute, 0, "link1", SomeBody(),
               &mechanism);
  Model model(mechanism);
  const Catalogue catalogue;
  for (const char* name : {"effort_delay@base", "viscous_damping@joint1"}) {
    model.AddEffect(catalogue.Make(name, model.mechanism(), "test"));
  }
  Fit fit(model);
  fit.base = {{{{"link1.m", 1.0}, {"link2.m", 1.0}}, "kg", 2.5, 0.1},
              {{{"joint1.damping", 1.0}}, "N m s/rad", 0.25, 0.01}};
  for (const auto& [name, error] :
       {std::pair("link1.mass", std::nan("")),
        std::pair("joint1.damping", 0.01), std::pair("effort_delay", 0.001)}) {
    ParameterEstimate p;
    p.name = name;
    p.value = 0.01;
    p.std_error = error;
    p.identifiable = std::isfinite(error);
    fit.parameters.push_back(p);
  }
  EXPECT_FALSE(ShowsCombinations(fit));  // each is identifiable
  fit.not_identifiable = {{"link1.mass", "link2.mass"}};
  EXPECT_TRUE(ShowsCombinations(fit));
  const std::string table = BaseTable(fit);
  EXPECT_NE(table.find("link1.m + link2.m"), std::string::npos);
  EXPECT_NE(table.find("effort_delay"), std::string::npos) << table;
  EXPECT_EQ(table.find("link1.mass"), std::string::npos);
  EXPECT_EQ(table.find("joint1.damping"), table.rfind("joint1.damping"));
}

OpenError Open(const std::string& run, double rms) {
  return {run, 10.0, {{"joint1", "rad", rms, 99.0}}};
}

TEST(OfTheMotion, SaysWhatIsMissingOfNearlyAll) {
  EXPECT_EQ(OfTheMotion(99.61), " (fit 99.6 %)");
  EXPECT_EQ(OfTheMotion(99.97), " (fit 99.97 %)");
  EXPECT_EQ(OfTheMotion(99.996), " (fit 99.996 %)");
  EXPECT_EQ(OfTheMotion(100.0), " (fit 100 %)");
  EXPECT_EQ(OfTheMotion(-20.0), " (fit -20 %)");
  EXPECT_EQ(OfTheMotion(NAN), "");
}

TEST(OpenLines, HaveOneEachOfAFewRuns) {
  EXPECT_EQ(OpenLines({Open("a.csv", 0.5), Open("b.csv", INFINITY)}, ""),
            "  open prediction of a.csv, 10 s from one initial state: joint1 "
            "0.5 rad (fit 99 %)\n"
            "  open prediction of b.csv, 10 s from one initial state: joint1 "
            "diverges rad (fit 99 %)\n");
}

TEST(OpenLines, SayMedianAndWorstOfMany) {
  std::vector<OpenError> open;
  for (int i = 1; i <= 101; ++i) {
    open.push_back(Open(std::to_string(i) + ".csv", 0.01 * (i * 7 % 102)));
  }
  EXPECT_EQ(OpenLines(open, "held-out "),
            "  open prediction of 101 held-out runs, each from one initial "
            "state: joint1 median 0.51 rad, worst 1.01 rad (29.csv)\n");
  open[40].channels[0].rms = INFINITY;
  EXPECT_NE(OpenLines(open, "").find("worst diverges (41.csv)"),
            std::string::npos);
}

}  // namespace
}  // namespace sysid
