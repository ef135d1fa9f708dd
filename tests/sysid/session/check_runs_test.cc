#include "sysid/session/check_runs.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <limits>

#include "tests/support/error_text.h"
#include "tests/sysid/io/chain.h"
#include "tests/sysid/io/scratch_file.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;

// A position that changes at each of these times.
sysid::Run At(const std::vector<double>& t) {
  sysid::Run run;
  run.name = "run.csv";
  run.t = t;
  Channel channel;
  channel.target = 0;
  channel.name = "joint1";
  channel.values = RowMatrixXd::Zero(run.size(), 1);
  for (int k = 0; k < run.size(); ++k) channel.values(k, 0) = 0.1 * k;
  run.channels.push_back(channel);
  run.effort = RowMatrixXd::Zero(run.size(), 2);
  return run;
}

// So many samples, so far apart.
sysid::Run Even(int samples, double period) {
  std::vector<double> t;
  for (int k = 0; k < samples; ++k) t.push_back(period * k);
  return At(t);
}

std::string TimesError(const sysid::Run& run) {
  return ErrorText([&] { CheckTimes({run}); });
}

TEST(CheckTimes, RefusesTooFewSamples) {
  EXPECT_EQ(TimesError(Even(4, 0.01)),
            "run.csv: has 4 samples: too few to fit anything\n"
            "  hint: at least 5 are needed");
  EXPECT_EQ(TimesError(Even(5, 0.01)), "no error");
}

TEST(CheckTimes, TakesTimesThatAreFarApartForMilliseconds) {
  EXPECT_EQ(TimesError(Even(50, 10)),
            "run.csv: its samples are 10 s apart: is the time in "
            "milliseconds?\n"
            "  hint: --columns t=t*0.001  (if it is seconds after all: t=t*1)");
  EXPECT_EQ(TimesError(Even(50, 1.0)), "no error");
}

TEST(CheckTimes, RepeatsTheColumnThatTheTimeIsMappedFrom) {
  sysid::Run run = Even(50, 10);
  run.time_source = "(clock-5)";
  EXPECT_THAT(TimesError(run), HasSubstr("--columns t=(clock-5)*0.001  (if"));
  // A user who gave a factor knows the unit.
  run.time_source = "";
  EXPECT_EQ(TimesError(run), "no error");
}

TEST(CheckTimes, RefusesPausesThatNoPredictionCrosses) {
  // Ten seconds, or a thousand samples where those are slow.
  std::vector<double> t;
  for (int k = 0; k < 20; ++k) t.push_back(0.05 * k + (k < 10 ? 0.0 : 10.0));
  EXPECT_EQ(TimesError(At(t)), "no error");
  for (int k = 10; k < 20; ++k) t[k] += 50.5;
  EXPECT_EQ(TimesError(At(t)),
            "run.csv: nothing was sampled from 0.45 s to 61 s: too long to "
            "predict across\n"
            "  hint: split it there into two files, and give both");
}

TEST(CheckMotion, AsksForOneNumberThatChanges) {
  sysid::Run still = Even(10, 0.01), moving = still;
  still.channels[0].values.setConstant(0.3);
  // What is missing is no change.
  still.channels[0].values(4, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ErrorText([&] {
              CheckMotion({still, still});
            }),
            "run.csv: nothing that was measured ever changes\n"
            "  hint: a mechanism at rest tells nothing of its parameters: "
            "record a motion");
  EXPECT_EQ(ErrorText([&] { CheckMotion({still, moving}); }), "no error");
  EXPECT_EQ(ErrorText([&] { CheckMotion({}); }), "no error");
}

TEST(CheckDistinct, RefusesAFileThatIsGivenTwice) {
  EXPECT_EQ(ErrorText([] {
              CheckDistinct({"a.csv", "b.csv", "a.csv"}, {});
            }),
            "--traj: 'a.csv' is given twice\n"
            "  hint: give each recording once: what is counted twice makes the "
            "intervals too narrow");
  EXPECT_EQ(ErrorText([] {
              CheckDistinct({"a.csv"}, {"b.csv", "a.csv"});
            }),
            "--holdout: 'a.csv' is fitted too, or given twice\n"
            "  hint: hold out recordings that are not in --traj");
  EXPECT_EQ(ErrorText([] {
              CheckDistinct({"a.csv"}, {"b.csv", "b.csv"});
            }),
            "--holdout: 'b.csv' is fitted too, or given twice\n"
            "  hint: hold out recordings that are not in --traj");
  EXPECT_EQ(ErrorText([] { CheckDistinct({"a.csv"}, {"b.csv"}); }), "no error");
}

TEST(CheckDistinct, KnowsAFileByAnyPath) {
  const ScratchFile file("run.csv", "t\n");
  const std::filesystem::path path = file.path();
  const std::string other =
      (path.parent_path() / "." / path.filename()).string();
  EXPECT_THAT(ErrorText([&] {
                CheckDistinct({file.path(), other}, {});
              }),
              HasSubstr("is given twice"));
}

TEST(CheckRunNames, RefusesANameThatIsForNoneOfTheRuns) {
  const auto error = [](const std::string& columns, const ChannelEdits& edits) {
    return ErrorText([&] {
      CheckRunNames(ParseColumnMap(columns), edits, Hinges(),
                    {"dir/a.csv", "b.csv"});
    });
  };
  const std::string none =
      ": there is no run 'c.csv'\n"
      "  hint: --traj and --holdout name dir/a.csv, b.csv";
  EXPECT_EQ(error("c.csv/joint1.q=x", {}), "--columns" + none);
  EXPECT_EQ(error("", {ParseShifts("c.csv/joint1.q=0.1", "--shift"), {}}),
            "--shift" + none);
  EXPECT_EQ(error("", {{}, ParseIgnored("c.csv/joint1.q@1:2", "--ignore")}),
            "--ignore" + none);
  EXPECT_EQ(error("a.csv/joint1.q=x,joint2.q=y",
                  {ParseShifts("b.csv/joint1.q=0.1", "--shift"), {}}),
            "no error");
}

}  // namespace
}  // namespace sysid
