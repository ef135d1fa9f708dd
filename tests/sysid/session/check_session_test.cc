#include "sysid/session/check_session.h"

#include <gtest/gtest.h>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"

namespace sysid {
namespace {

TEST(CheckedLine, SaysWhatWasUndone) {
  Session session(MakeModel(LoadUrdf(FindModel("pendulum1")), Catalogue()));
  session.run_names = {"a.csv"};
  session.checked = true;
  session.findings.resize(2);
  session.undone = {{"degrees", "a.csv: joint1.q", "columns",
                     "joint1.q=joint1.q*pi/180",
                     "--columns 'joint1.q=joint1.q*pi/180'", 9.0}};
  EXPECT_EQ(CheckedLine(session),
            "  checked: undone: degrees (a.csv: joint1.q) with --columns "
            "'joint1.q=joint1.q*pi/180'; 1 more\n");
}

// Nothing is said to be right that nobody looked at.
TEST(CheckedLine, SaysHowMuchWasNotTested) {
  Session session(MakeModel(LoadUrdf(FindModel("pendulum1")), Catalogue()));
  session.run_names = {"a.csv", "b.csv"};
  EXPECT_EQ(CheckedLine(session), "");
  session.checked = true;
  EXPECT_EQ(CheckedLine(session), "  checked: nothing wrong with 2 runs\n");
  session.not_checked = 3;
  EXPECT_EQ(CheckedLine(session),
            "  checked: nothing wrong with 2 runs; 3 kinds of fault not "
            "tested\n");
  session.findings.emplace_back().fault = "drift";
  session.not_checked = 1;
  EXPECT_EQ(CheckedLine(session),
            "  checked: 1 finding in 2 runs, first drift; 1 kind of fault not "
            "tested\n");
}

}  // namespace
}  // namespace sysid
