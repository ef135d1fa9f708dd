#include "sysid/report/findings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sysid/report/json.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A delay that leads with this verdict, a fault that does not, an effect.
CheckResult Leading(DataVerdict verdict) {
  CheckResult result;
  result.error = 17.0;
  result.compared = {
      {"joint2.q read 14 ms later", true, verdict, 9.0, 0.5},
      {"spring@joint1", false, DataVerdict::kRejected, 13.0, 0.8},
      {"without joint1.tau", true, DataVerdict::kRejected, 25.0, 1.5}};
  return result;
}

TEST(CheckText, SaysThatAFaultOfTheDataIsUndecided) {
  const std::string text =
      CheckText("arm", 1, Leading(DataVerdict::kUndecided));
  EXPECT_THAT(text, HasSubstr("whether a fault of the data explains it is "
                              "undecided; sysid_diagnose looks for"));
  EXPECT_THAT(text, HasSubstr("joint2.q read 14 ms later (undecided)\n"));
  EXPECT_THAT(text, HasSubstr("spring@joint1\n"));
  EXPECT_THAT(text, Not(HasSubstr("without joint1.tau")));
}

TEST(CheckText, ShowsNoFaultOfTheDataThatIsRejected) {
  const std::string text = CheckText("arm", 1, Leading(DataVerdict::kRejected));
  EXPECT_THAT(text, Not(HasSubstr("undecided")));
  EXPECT_THAT(text, Not(HasSubstr("joint2.q")));
}

TEST(CheckJson, HasTheVerdictOfEachExplanation) {
  for (const DataVerdict verdict :
       {DataVerdict::kAccepted, DataVerdict::kUndecided,
        DataVerdict::kRejected}) {
    const Json json =
        Json::parse(CheckJson("arm", {"a.csv"}, Leading(verdict), {}));
    const Json& first = json["compared"][0];
    EXPECT_EQ(first["accepted"], verdict == DataVerdict::kAccepted);
    EXPECT_EQ(first["undecided"], verdict == DataVerdict::kUndecided);
    EXPECT_EQ(json["compared"].size(), 3u);
  }
}

}  // namespace
}  // namespace sysid
