#include "sysid/io/channel_edits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "models/error.h"
#include "sysid/io/run_rows.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/chain.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Mechanism Hinge() {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  Joint joint;
  joint.name = "joint1";
  joint.type = JointType::kRevolute;
  joint.parent_link = 0;
  mechanism.AddJoint(joint, "link1", Eigen::Vector3d::Zero(), {});
  return mechanism;
}

// sin(3 t), recorded `late` seconds late, with the effort cos(3 t) held.
Run Recorded(double period, double late, double effort_late) {
  Run run;
  run.name = "runs/a.csv";
  Channel q;
  q.target = 0;
  q.name = "joint1";
  const int n = static_cast<int>(2.0 / period);
  q.values.resize(n, 1);
  run.effort.resize(n, 1);
  for (int k = 0; k < n; ++k) {
    run.t.push_back(k * period + 0.0001 * std::sin(1.0 * k * (period != 0.01)));
    q.values(k, 0) = std::sin(3 * (run.t[k] - late));
    run.effort(k, 0) = std::cos(3 * (run.t[k] - effort_late));
  }
  run.channels = {q};
  return run;
}

void Apply(const std::string& shift, const std::string& ignore, Run* run) {
  ChannelEdits edits{ParseShifts(shift, "--shift"),
                     ParseIgnored(ignore, "--ignore")};
  CheckEdits(edits, Hinge());
  ApplyEdits(edits, Hinge(), run, nullptr);
}

TEST(ChannelEditsTest, WholeSamplesAreMovedAsTheyAre) {
  sysid::Run run = Recorded(0.01, 0.02, 0.0);
  const sysid::Run before = run;
  Apply("joint1.q=0.02", "", &run);
  for (int k = 0; k + 2 < run.size(); ++k) {
    EXPECT_EQ(run.channels[0].values(k, 0),
              before.channels[0].values(k + 2, 0));
  }
  EXPECT_TRUE(std::isnan(run.channels[0].values(run.size() - 1, 0)));
  EXPECT_EQ(run.effort, before.effort);
}

// The cubic's error is below |q''''| h^4 / 16 = 81 h^4 / 16, and where its
// slopes are those of chords, |q'''| h^3 / 24.
TEST(ChannelEditsTest, PartsOfASampleAreInterpolated) {
  const double h = 0.0101;
  sysid::Run run = Recorded(0.0099, 0.0123, 0.0);
  Apply("joint1.q=0.0123", "", &run);
  for (int k = 2; k < run.size() - 4; ++k) {
    EXPECT_NEAR(run.channels[0].values(k, 0), std::sin(3 * run.t[k]),
                27 * h * h * h / 24);
  }
}

// A held effort's mean over a sample; that of its curve at the middle differs
// by half a step of its slope.
TEST(ChannelEditsTest, EffortsKeepTheirImpulse) {
  sysid::Run run = Recorded(0.0099, 0.0, 0.0333);
  sysid::Run exact = Recorded(0.0099, 0.0, 0.0);
  Apply("joint1.tau=0.0333", "", &run);
  for (int k = 1; k < run.size() - 8; ++k) {
    EXPECT_NEAR(run.effort(k, 0), exact.effort(k, 0), 3 * 0.0101);
  }
}

TEST(ChannelEditsTest, ThereAndBackIsNothing) {
  sysid::Run run = Recorded(0.01, 0.0, 0.0);
  const sysid::Run before = run;
  Apply("joint1.q=0.03", "", &run);
  Apply("joint1.q=-0.03", "", &run);
  for (int k = 3; k + 3 < run.size(); ++k) {
    EXPECT_EQ(run.channels[0].values(k, 0), before.channels[0].values(k, 0));
  }
}

TEST(ChannelEditsTest, IgnoredSpansAreMissingInTheirRun) {
  sysid::Run run = Recorded(0.01, 0.0, 0.0);
  Apply("", "joint1.q@0.5:0.6,b.csv/joint1.q@0:2,a.csv/joint1@1:1.1", &run);
  for (int k = 0; k < run.size(); ++k) {
    const double t = run.t[k];
    const bool missing = (t >= 0.5 && t <= 0.6) || (t >= 1.0 && t <= 1.1);
    EXPECT_EQ(std::isnan(run.channels[0].values(k, 0)), missing) << t;
  }
}

TEST(ChannelEditsTest, AChannelOfWhichNothingIsLeftWasNotMeasured) {
  sysid::Run run = Recorded(0.01, 0.0, 0.0);
  run.channels.push_back(run.channels[0]);
  run.channels[1].kind = ChannelKind::kVelocity;
  run.channels[1].name = "joint1.qd";
  Apply("", "joint1.q@0:100", &run);
  std::vector<std::string> notices;
  DropUnmeasured("--ignore", &run, &notices);
  ASSERT_EQ(run.channels.size(), 1u);
  EXPECT_EQ(run.channels[0].name, "joint1.qd");
  EXPECT_THAT(notices, ElementsAre("runs/a.csv: nothing of joint1 is left: it "
                                   "was not measured"));
  Apply("", "joint1.qd@0:100", &run);
  EXPECT_THAT(ErrorText([&] { DropUnmeasured("--ignore", &run, nullptr); }),
              HasSubstr("--ignore: nothing of runs/a.csv is left"));
}

// A rest before the release that is ignored: no row of it is left to predict.
TEST(ChannelEditsTest, ARunBeginsWhereSomethingIsMeasured) {
  sysid::Run run = Recorded(0.01, 0.0, 0.0);
  const sysid::Run before = run;
  Apply("", "joint1@0:0.495,joint1.q@1.5:1.6", &run);
  std::vector<std::string> notices;
  BeginMeasured(&run, &notices);
  ASSERT_EQ(run.size(), before.size() - 50);
  EXPECT_EQ(run.t.front(), before.t[50]);
  EXPECT_EQ(run.channels[0].values(0, 0), before.channels[0].values(50, 0));
  EXPECT_EQ(run.effort.row(7), before.effort.row(57));
  EXPECT_THAT(notices, ElementsAre("runs/a.csv: begins at 0.5 s: nothing "
                                   "before is measured"));
  // Missing later is no reason.
  const sysid::Run cut = run;
  BeginMeasured(&run, &notices);
  EXPECT_EQ(run.size(), cut.size());
  EXPECT_EQ(notices.size(), 1u);
}

TEST(ChannelEditsTest, AFilesNameMayHaveAnEqualsSign) {
  const std::vector<ChannelShift> shifts =
      ParseShifts("x=y.csv/joint1.q=0.01", "--shift");
  ASSERT_EQ(shifts.size(), 1u);
  EXPECT_EQ(shifts[0].name, "x=y.csv/joint1.q");
  EXPECT_EQ(shifts[0].delay, 0.01);
}

TEST(ChannelEditsTest, AShiftOfThisRunAloneWins) {
  const sysid::Run before = Recorded(0.01, 0.0, 0.0);
  sysid::Run run = before;
  Apply("a.csv/joint1.q=0.03,joint1.q=0.02,b.csv/joint1.q=0.5", "", &run);
  for (int k = 0; k + 3 < run.size(); ++k) {
    EXPECT_EQ(run.channels[0].values(k, 0),
              before.channels[0].values(k + 3, 0));
  }
}

// However many of its columns, or its joint, are named.
TEST(ChannelEditsTest, AGroupMovesOnce) {
  const sysid::Run before = Recorded(0.01, 0.0, 0.0);
  const auto by = [&](const std::vector<ChannelShift>& shifts) {
    sysid::Run run = before;
    ApplyEdits({shifts, {}}, Hinge(), &run, nullptr);
    int samples = 0;
    while (run.channels[0].values(0, 0) !=
           before.channels[0].values(samples, 0)) {
      ++samples;
    }
    return samples;
  };
  EXPECT_EQ(by(ParseShifts("joint1=0.03,joint1.q=0.03", "--shift")), 3);
  EXPECT_EQ(by(ParseShifts("joint1=0.05,joint1.q=0.03", "--shift")), 3);
  EXPECT_EQ(by(ParseShifts("joint1.q=0.05,a.csv/joint1=0.02", "--shift")), 2);
}

// A flag wins over a file where it moves all that the file's entry does.
TEST(ChannelEditsTest, OfFlagsAndFilesAreMergedByTheColumnsThatTheyMove) {
  const auto merged = [](const std::string& file, const std::string& flag) {
    std::string text;
    for (const ChannelShift& shift :
         MergeEdits({ParseShifts(file, "m.yaml:3:8"), {}},
                    {ParseShifts(flag, "--shift"), {}}, Hinge())
             .shifts) {
      text += ToString(shift) + ";";
    }
    return text;
  };
  EXPECT_EQ(merged("joint1.q=0.05", "joint1=0"), "joint1=0;");
  EXPECT_EQ(merged("joint1=0.05", "joint1.q=0"), "joint1.q=0;joint1=0.05;");
  EXPECT_EQ(merged("a.csv/joint1.q=0.05", "joint1.q=0"),
            "joint1.q=0;a.csv/joint1.q=0.05;");
}

TEST(ChannelEditsTest, ComponentsThatDifferAreAnError) {
  const Mechanism mechanism = Chain({{"ball", JointType::kSpherical}});
  sysid::Run run = Recorded(0.01, 0.0, 0.0);
  run.channels.clear();
  EXPECT_EQ(ErrorText([&] {
              ApplyEdits(
                  {ParseShifts("ball.wx=0.01,ball.wy=0.02", "--shift"), {}},
                  mechanism, &run, nullptr);
            }),
            "--shift: 'ball.wx' and 'ball.wy' are shifted together, and by "
            "different times\n  hint: name one of them");
}

TEST(ChannelEditsTest, SaysWhatThereWasNotToIgnore) {
  sysid::Run run = Recorded(0.01, 0.0, 0.0);
  const auto notices = [&](const std::string& ignore) {
    std::vector<std::string> notices;
    ApplyEdits({{}, ParseIgnored(ignore, "--ignore")}, Hinge(), &run, &notices);
    return notices;
  };
  EXPECT_THAT(notices("joint1.q@0.5:0.6,b.csv/joint1.q@7:8"), IsEmpty());
  EXPECT_THAT(notices("a.csv/joint1.q@7:8"),
              ElementsAre("runs/a.csv: has nothing of 'joint1.q' to ignore "
                          "between 7 s and 8 s"));
}

TEST(ChannelEditsTest, SaysWhatIsWrongWithAFlag) {
  const auto error = [](const std::string& shift, const std::string& ignore) {
    try {
      sysid::Run run = Recorded(0.01, 0.0, 0.0);
      Apply(shift, ignore, &run);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error("joint1.q", ""), HasSubstr("'joint1.q' is no shift"));
  EXPECT_THAT(error("joint1.q=x", ""), HasSubstr("'x' is not a number"));
  EXPECT_THAT(error("joint1.q=1e999", ""), HasSubstr("is not a number"));
  EXPECT_THAT(error("joint1.q=1,joint1.q=2", ""), HasSubstr("shifted twice"));
  EXPECT_THAT(error("jiont1.q=0.1", ""), HasSubstr("did you mean 'joint1.q'"));
  EXPECT_THAT(error("joint1.q=10", ""), HasSubstr("leaves little of runs/a"));
  EXPECT_THAT(error("", "joint1.q"), HasSubstr("is no span of a column"));
  EXPECT_THAT(error("", "joint1.q@2:1"), HasSubstr("ends before it begins"));
  EXPECT_THAT(error("", "joint1.tau@1:2"),
              HasSubstr("the effort 'joint1.tau' cannot be missing"));
}

}  // namespace
}  // namespace sysid
