#include "sysid/api/diagnose.h"

#include <gmock/gmock.h>

#include "sysid/api/identify.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/io/write_file.h"
#include "sysid/io/write_run.h"
#include "sysid/report/diagnosis_report.h"
#include "tests/support/error_text.h"
#include "tests/sysid/api/api_test_case.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

DiagnoseRequest AskForFriction() {
  DiagnoseRequest request{RubbingRequest()};
  request.candidates = {"coulomb_friction", "viscous_damping", "spring"};
  return request;
}

TEST(Diagnose, NamesWhatIsMissingOfAModelInMemory) {
  const DiagnoseRequest request = AskForFriction();
  const DiagnoseResult found = Diagnose(request);
  EXPECT_EQ(found.diagnosis.verdict, Verdict::kMissingEffect);
  EXPECT_THAT(found.next.add, ElementsAre("coulomb_friction@joint1"));
  EXPECT_FALSE(found.final);
  EXPECT_FALSE(found.is_elsewhere);
  EXPECT_THAT(DiagnosisText(found, {}, false),
              HasSubstr("coulomb_friction@joint1 is missing"));
  EXPECT_THAT(DiagnosisJson(found, {}), HasSubstr("\"missing_effect\""));
  const IdentifyResult mended = Identify({WithStep(request, found.next)});
  EXPECT_LT(mended.fit().train.total.normalized_rms, 1.1);
}

TEST(Diagnose, FitsWholeRunsWhereItIsAsked) {
  DiagnoseRequest request = AskForFriction();
  request.candidates = {"coulomb_friction@joint1"};
  request.add_found = true;
  const DiagnoseResult found = Diagnose(request);
  EXPECT_THAT(found.diagnosis.added(), ElementsAre("coulomb_friction@joint1"));
  ASSERT_TRUE(found.final);
  EXPECT_TRUE(found.final->fit.converged);
  EXPECT_TRUE(
      found.final->fit.model.effects().Contains("coulomb_friction@joint1"));
}

// Of a pendulum whose first joint rubs, and is recorded backwards.
class WrongRecording : public ::testing::Test {
 protected:
  WrongRecording() {
    request_ = AskForFriction();
    request_.model_in_memory = nullptr;
    request_.model = "pendulum2_planar";
    request_.check = CheckLevel::kAll;
    request_.add_found = true;
    for (auto [runs, files] : {std::pair(&request_.runs, &request_.traj),
                               {&request_.holdout_runs, &request_.holdout}}) {
      sysid::Run run = runs->front();
      run.channels[0].values *= -1.0;
      files->push_back(folder_ + (files == &request_.traj ? "a.csv" : "b.csv"));
      WriteFileAtomically(files->back(),
                          FormatRun(PlanarPendulum().mechanism(), run, {}));
      runs->clear();
    }
  }
  const std::string folder_ = ::testing::TempDir() + "wrong_recording_";
  DiagnoseRequest request_;
};

TEST_F(WrongRecording, IsReadRightlyBeforeAnythingIsConcluded) {
  const DiagnoseResult found = Diagnose(request_);
  ASSERT_EQ(found.session.undone.size(), 1u);
  const UndoneFault& fault = found.session.undone[0];
  EXPECT_EQ(fault.hypothesis, "axis_flipped");
  EXPECT_EQ(fault.flag, "columns");
  EXPECT_EQ(fault.value, "joint1.q=-joint1.q");
  EXPECT_GT(fault.gain, 2.0);
  EXPECT_EQ(found.session.findings.front().fault, "axis_flipped");
  EXPECT_EQ(found.diagnosis.verdict, Verdict::kMissingEffect);
  EXPECT_THAT(found.diagnosis.added(), ElementsAre("coulomb_friction@joint1"));
  EXPECT_LT(found.diagnosis.last().train_error(), 1.1);
  const bool is_in_json =
      DiagnosisJson(found, {}).find(
          "\"columns\": \"--columns joint1.q=-joint1.q\"") != std::string::npos;
  EXPECT_TRUE(is_in_json);
  EXPECT_THAT(found.diagnosis.ConfirmedBy(), ::testing::Contains("segments"));
}

TEST(Diagnose, SaysWhatIsWrongWithARequest) {
  DiagnoseRequest request = AskForFriction();
  request.candidates = {"colomb_friction"};
  EXPECT_THAT(ErrorText([&] { Diagnose(request); }),
              HasSubstr("--candidates: unknown effect 'colomb_friction'"));
  request = AskForFriction();
  request.solver = "adam";
  EXPECT_THAT(ErrorText([&] { Diagnose(request); }),
              HasSubstr("--solver: this program has no solver 'adam'"));
}

TEST(Diagnose, IsStopped) {
  DiagnoseRequest request = AskForFriction();
  std::stop_source source;
  source.request_stop();
  request.callbacks.stop = source.get_token();
  EXPECT_THROW(Diagnose(request), Cancelled);
}

}  // namespace
}  // namespace sysid
