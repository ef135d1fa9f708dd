#include "sysid/session/shared_runs.h"

#include <gmock/gmock.h>

#include "models/error.h"
#include "tests/support/program_folder.h"
#include "tests/support/thread_processes.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(ShareOut, MakesTheLargestShareAsSmallAsCanBe) {
  EXPECT_THAT(ShareOut({1, 1, 1, 1}, 2), ElementsAre(2, 2));
  EXPECT_THAT(ShareOut({1, 1, 1, 9, 1}, 3), ElementsAre(3, 1, 1));
  EXPECT_THAT(ShareOut({5, 1, 1, 1, 1}, 2), ElementsAre(1, 4));
}

TEST(ShareOut, LeavesProcessesWithoutARun) {
  EXPECT_THAT(ShareOut({3, 2}, 4), ElementsAre(1, 1, 0, 0));
  EXPECT_THAT(ShareOut({}, 2), ElementsAre(0, 0));
  EXPECT_THAT(ShareOut({7}, 1), ElementsAre(1));
}

TEST(OwnFiles, AreByTheirSizesInTheOrderOfTheList) {
  const ProgramFolder folder;
  std::vector<std::string> files;
  for (const int size : {10, 10, 500, 10}) {
    files.push_back(folder.Path(std::to_string(files.size())));
    folder.Write(std::to_string(files.size() - 1), std::string(size, 'x'));
  }
  ThreadProcesses(3).Run([&](const Processes& all) {
    const std::vector<std::string> own = OwnFiles(all, files);
    const std::vector<std::vector<std::string>> expected = {
        {files[0], files[1]}, {files[2]}, {files[3]}};
    EXPECT_EQ(own, expected[all.rank()]);
  });
  EXPECT_EQ(OwnFiles(Alone(), files), files);
}

TEST(DoAlike, ThrowsWhatTheFirstOneThrew) {
  ThreadProcesses(3).Run([](const Processes& all) {
    try {
      DoAlike(all, [&] {
        if (all.rank() == 0) return;
        throw InputError("run" + std::to_string(all.rank()) + ".csv",
                         "has no columns", "name some");
      });
      ADD_FAILURE() << "nothing was thrown";
    } catch (const InputError& error) {
      EXPECT_STREQ(error.what(), "run1.csv: has no columns\n  hint: name some");
      EXPECT_EQ(error.place(), "run1.csv");
    }
    DoAlike(all, [] {});
  });
}

TEST(OutlinesOfAll, SayWhatRunsHave) {
  ThreadProcesses(2).Run([](const Processes& all) {
    std::vector<sysid::Run> runs;
    if (all.rank() == 1) {
      sysid::Run& run = runs.emplace_back();
      run.name = "run.csv";
      run.t = {1.0, 1.5, 2.0};
      run.effort.setZero(3, 2);
      run.effort(1, 1) = -4.0;
      run.channels.push_back({ChannelKind::kPosition, 2, "joint3", {}, {}});
      run.channels[0].values.resize(3, 1);
      run.channels[0].values << 5.0, -1.0, 2.0;
      run.inputs.push_back({"joint1.cmd", true, {1.0, 2.0, 3.0}});
    }
    const std::vector<sysid::Run> outlines = OutlinesOfAll(all, runs);
    ASSERT_EQ(outlines.size(), 1u);
    const sysid::Run& outline = outlines[0];
    EXPECT_EQ(outline.name, "run.csv");
    EXPECT_THAT(outline.t, ElementsAre(1.0, 2.0));
    EXPECT_THAT(outline.effort.reshaped(), ElementsAre(0.0, 1.0));
    EXPECT_THAT(outline.channels[0].values.reshaped(), ElementsAre(-1.0, 5.0));
    EXPECT_EQ(outline.channels[0].target, 2);
    EXPECT_TRUE(HasInput(outline, "joint1.cmd"));
    EXPECT_FALSE(HasInput(outline, "joint2.cmd"));
  });
}

TEST(JoinLists, KeepsTheOrder) {
  ThreadProcesses(3).Run([](const Processes& all) {
    std::vector<std::string> own(all.rank(), std::to_string(all.rank()));
    EXPECT_THAT(JoinLists(all, own), ElementsAre("1", "2", "2"));
    EXPECT_THAT(JoinLists(all, {}), IsEmpty());
  });
}

}  // namespace
}  // namespace sysid
