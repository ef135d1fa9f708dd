#include "sysid/session/session.h"

#include <gmock/gmock.h>

#include <cmath>

#include "sysid/session/named_values.h"
#include "tests/support/error_text.h"
#include "tests/support/program_folder.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// A rod with what its URDF says of its joint.
std::string Rod(const std::string& dynamics = "") {
  return R"(<robot name="rod"><link name="base"/>
<joint name="j" type="continuous"><parent link="base"/><child link="arm"/>
<axis xyz="0 1 0"/>)" +
         dynamics + R"(</joint>
<link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
</robot>)";
}

// A swing with these columns, whatever they are.
std::string Swing(const std::string& header) {
  std::string text = header + "\n";
  for (int k = 0; k < 50; ++k) {
    text += std::to_string(0.01 * k);
    for (const char c : header) {
      if (c == ',') text += "," + std::to_string(0.3 * std::cos(0.05 * k));
    }
    text += "\n";
  }
  return text;
}

class SessionTest : public testing::Test {
 protected:
  SessionTest() {
    folder_.Write("rod.urdf", Rod());
    folder_.Write("run.csv", Swing("t,j.q"));
    request_.model = folder_.Path("rod.urdf");
    request_.traj = {folder_.Path("run.csv")};
  }
  Session Open() const { return OpenSession(request_, Catalogue()); }
  std::string Error() const {
    return ErrorText([&] { Open(); });
  }
  std::vector<std::string> FreeNames() const {
    std::vector<std::string> names;
    for (const FreeParameter& free : Open().free) {
      names.push_back(free.parameter.name);
    }
    return names;
  }

  ProgramFolder folder_;
  FitRequest request_;
};

TEST_F(SessionTest, TakesTheSpecificationBesideTheModel) {
  folder_.Write("rod.sysid.yaml", "free: [arm.mass]\n");
  EXPECT_THAT(FreeNames(), ElementsAre("arm.mass"));
  EXPECT_EQ(Open().spec_file, folder_.Path("rod.sysid.yaml"));
  folder_.Write("other.yaml", "free: [arm.length]\n");
  request_.spec = folder_.Path("other.yaml");
  EXPECT_THAT(FreeNames(), ElementsAre("arm.length"));
  request_.free = SplitAssignments("gravity", "--free");
  EXPECT_THAT(FreeNames(), ElementsAre("gravity"));
}

TEST_F(SessionTest, TakesTheModelThatTheSpecificationNames) {
  folder_.Write("fit.yaml", "model: rod.urdf\nfree: [arm.mass]\n");
  request_.spec = folder_.Path("fit.yaml");
  request_.model = "";
  const Session session = Open();
  EXPECT_EQ(session.model_name, "rod");
  EXPECT_EQ(session.model_file, folder_.Path("rod.urdf"));
  folder_.Write("fit.yaml", "model: pendulum9\nfree: [arm.mass]\n");
  EXPECT_THAT(Error(), HasSubstr("fit.yaml:1:8: no shipped model is named "
                                 "'pendulum9'"));
}

TEST_F(SessionTest, AsksForModelAndRuns) {
  request_.free = SplitAssignments("arm.mass", "--free");
  request_.traj = {};
  EXPECT_EQ(Error(),
            "--traj: is missing\n"
            "  hint: give the recordings to fit: --traj run1.csv,run2.csv");
  request_.model = "";
  EXPECT_THAT(Error(), StartsWith("--model: is missing\n  hint: give a URDF "
                                  "file or a shipped model: arm7, cartpole"));
}

// What may be read wrong comes before what the model has.
TEST_F(SessionTest, SaysFirstWhatItSaysOfRuns) {
  folder_.Write("rod.urdf",
                Rod("<dynamics damping=\"0.25\" friction=\"0.5\"/>"));
  folder_.Write("run.csv", Swing("t,j.q,cur"));
  request_.free = SplitAssignments("arm.mass", "--free");
  EXPECT_THAT(
      Open().notices,
      ElementsAre(request_.traj[0] +
                      ": no column is read as the effort of j; ignored the "
                      "column cur: --columns j.tau=COLUMN maps one",
                  "joint 'j': <dynamics> damping 0.25 is in the model as "
                  "viscous_damping",
                  "joint 'j': <dynamics> friction 0.5 is in the model as "
                  "coulomb_friction"));
}

TEST_F(SessionTest, SaysNothingOfCompleteRuns) {
  request_.free = SplitAssignments("arm.mass", "--free");
  EXPECT_THAT(Open().notices, IsEmpty());
}

TEST_F(SessionTest, ReadsRunsAsFlagsAndSpecificationSay) {
  folder_.Write("run.csv", Swing("time,pos,j.q"));
  folder_.Write("fit.yaml",
                "free: [arm.mass]\n"
                "columns: {t: time, j.q: pos}\nignore: \"j.q@0.1:0.2\"\n");
  request_.spec = folder_.Path("fit.yaml");
  Session session = Open();
  const RowMatrixXd& q = session.runs[0].channels[0].values;
  EXPECT_EQ(q(0, 0), 0.3);
  EXPECT_TRUE(std::isnan(q(15, 0)));
  EXPECT_EQ(session.columns.size(), 2u);
  EXPECT_THAT(session.flag_columns, IsEmpty());
  // The flag wins for its column alone.
  request_.columns = ParseColumnMap("j.q=pos*2");
  request_.traj.push_back(folder_.Path("other.csv"));
  folder_.Write("other.csv", Swing("time,pos,j.q"));
  session = Open();
  EXPECT_EQ(session.runs[1].channels[0].values(0, 0), 0.6);
  EXPECT_EQ(session.columns.size(), 2u);
  EXPECT_EQ(session.flag_columns.size(), 1u);
}

TEST_F(SessionTest, OpensAModelWhoseRunsAreNotThere) {
  request_.free = SplitAssignments("arm.mass", "--free");
  request_.traj = {"nowhere.csv"};
  EXPECT_THAT(Error(), HasSubstr("nowhere.csv"));
  const Session session = OpenModelSession(request_, Catalogue());
  EXPECT_EQ(session.model_name, "rod");
  EXPECT_THAT(session.runs, IsEmpty());
}

// Which no notice doubts: unlike one that another run has and this one lacks.
TEST_F(SessionTest, TakesARecordedEffortOfZeroAsOne) {
  request_.free = SplitAssignments("arm.mass", "--free");
  request_.traj.push_back(folder_.Path("other.csv"));
  folder_.Write("run.csv", Swing("t,j.q,j.tau"));
  folder_.Write("other.csv", Swing("t,j.q"));
  EXPECT_THAT(Open().notices,
              ElementsAre(HasSubstr("other.csv: no effort acts on joint 'j'")));
  std::string still = "t,j.q,j.tau\n";
  for (int k = 0; k < 50; ++k) {
    still += std::to_string(0.01 * k) + "," + std::to_string(0.2 * k) + ",0\n";
  }
  folder_.Write("other.csv", still);
  EXPECT_THAT(Open().notices, IsEmpty());
}

TEST_F(SessionTest, TakesASegmentThatIsLongerThanTheRun) {
  request_.free = SplitAssignments("arm.mass", "--free");
  request_.segment = 0.5;  // of 0.49 s
  EXPECT_EQ(Open().options.segment, Open().runs[0].t.back());
  EXPECT_THAT(Open().notices, IsEmpty());
}

}  // namespace
}  // namespace sysid
