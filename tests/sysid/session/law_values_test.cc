#include "sysid/session/law_values.h"

#include <gmock/gmock.h>

#include <cmath>
#include <string>

#include "models/effects/catalogue.h"
#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "tests/support/error_text.h"

namespace sysid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// joint1 swings by half a radian, at 100 Hz; joint2 is not measured. An input
// `load` falls from 1 to -1.
Run Swing(double amplitude = 0.5, double frequency = 0.5) {
  Run run;
  run.name = "swing.csv";
  Channel joint1;
  joint1.target = 0;
  joint1.name = "joint1";
  joint1.values.resize(400, 1);
  Input load{"load", false, {}};
  for (int k = 0; k < 400; ++k) {
    run.t.push_back(0.01 * k);
    joint1.values(k, 0) = amplitude * std::sin(2 * M_PI * frequency * run.t[k]);
    load.values.push_back(1.0 - 0.005 * k);
  }
  run.channels = {joint1};
  run.effort.setZero(400, 2);
  run.inputs = {load};
  return run;
}

Mechanism Pendulum() {
  Mechanism mechanism = LoadUrdf(FindModel("pendulum2_planar"));
  mechanism.inputs = {"load"};
  return mechanism;
}

std::string ErrorOf(const std::string& law, const Run& run = Swing()) {
  const Mechanism mechanism = Pendulum();
  const auto effect =
      Catalogue().Make("custom@joint1: " + law, mechanism, "--add");
  return ErrorText(
      [&] { CheckHasValues(*effect, mechanism, {&run}, "--add"); });
}

TEST(CheckHasValues, RefusesALawWithoutAValueWhereTheJointWas) {
  EXPECT_THAT(ErrorOf("-k*sqrt(q)"),
              AllOf(HasSubstr("--add: custom@joint1: -k*sqrt(q) has no value "
                              "from 1"),
                    HasSubstr(" s of swing.csv, where joint1.q is from -0.5"),
                    HasSubstr("sqrt(abs(q)) instead of sqrt(q)")));
  EXPECT_THAT(ErrorOf("-k*log(qd)"), HasSubstr("joint1.qd from -1.571 to "));
  EXPECT_THAT(ErrorOf("k*sqrt(load)*q"), HasSubstr("has no value from 2"));
  EXPECT_THAT(ErrorOf("max(k*sqrt(q), k*q)"), HasSubstr("has no value"));
}

TEST(CheckHasValues, TakesALawThatHasOneEverywhere) {
  EXPECT_EQ(ErrorOf("-k*sqrt(abs(q))"), "no error");
  EXPECT_EQ(ErrorOf("-k*asin(q)"), "no error");
  EXPECT_EQ(ErrorOf("k*sqrt(4 - t)"), "no error");
  EXPECT_EQ(ErrorOf("k*sqrt(load + 1)"), "no error");
}

// c = 30, of a specification, would do: what a user may mean is not refused.
TEST(CheckHasValues, LeavesALawToTheParametersThatItIsNotLinearIn) {
  EXPECT_EQ(ErrorOf("-k*sqrt(q + c)", Swing(20.0)), "no error");
}

TEST(CheckHasValues, SaysNothingOfWhatIsShortOrNotMeasured) {
  // Below zero for 0.05 s at a time.
  EXPECT_EQ(ErrorOf("-k*sqrt(q)", Swing(0.5, 10.0)), "no error");
  EXPECT_EQ(ErrorOf("-k*sqrt(joint2.q)"), "no error");
}

TEST(CheckHasValues, SeesTheColumnOfAJointThatFollowsAnother) {
  Mechanism mechanism = Pendulum();
  mechanism.joints[1].mimic = Mimic{"joint1", 1.0, 0.0};
  const auto effect =
      Catalogue().Make("custom@joint2: -k*sqrt(q)", mechanism, "--add");
  sysid::Run run = Swing();
  run.effort.setZero(run.size(), 1);
  const auto error = [&] {
    return ErrorText(
        [&] { CheckHasValues(*effect, mechanism, {&run}, "--add"); });
  };
  EXPECT_EQ(error(), "no error");
  run.channels.push_back(run.channels.front());
  run.channels.back().target = 1;
  EXPECT_THAT(error(), HasSubstr("where joint2.q is from -0.5"));
}

}  // namespace
}  // namespace sysid
