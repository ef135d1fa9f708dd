#include <gmock/gmock.h>

#include <cmath>
#include <sstream>

#include "models/effects/force_table.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/json.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;

FormulaProposal SomeProposal() {
  FormulaProposal proposal;
  proposal.laws = {"custom@joint1: c1*q^2*qd", "custom@joint2: c1*max(0,q-s1)"};
  proposal.beside = {"spring@joint1"};
  ParameterEstimate c1;
  c1.name = "joint1.c1";
  c1.value = -0.5;
  proposal.parameters = {c1};
  proposal.cv_error = 1.02;
  proposal.holdout = 1.25;
  proposal.segment_s = 6.0;
  return proposal;
}

class ProposalsTest : public ::testing::Test {
 protected:
  Json Written() const {
    return Json::parse(DiagnosisJson(session_, diagnosis_, nullptr, {}));
  }

  const Model model_ = Shipped("pendulum2_planar");
  const Session session_{model_};
  Diagnosis diagnosis_{model_};
};

TEST_F(ProposalsTest, AreAnEmptyListWhereThereAreNone) {
  EXPECT_EQ(Written()["proposals"], Json::array());
}

TEST_F(ProposalsTest, AreWrittenAsAddTakesThem) {
  diagnosis_.proposals = {SomeProposal()};
  const Json proposals = Written()["proposals"];
  ASSERT_EQ(proposals.size(), 1u);
  EXPECT_EQ(proposals[0]["custom"],
            "custom@joint1: c1*q^2*qd,custom@joint2: c1*max(0,q-s1)");
  EXPECT_EQ(proposals[0]["with"], Json::array({"spring@joint1"}));
  EXPECT_EQ(proposals[0]["parameters"]["joint1.c1"], -0.5);
  EXPECT_EQ(proposals[0]["cv_error"], 1.02);
  EXPECT_EQ(proposals[0]["holdout"], 1.25);
  EXPECT_EQ(proposals[0]["segment_s"], 6.0);
}

TEST_F(ProposalsTest, AreInTheSentenceOfWhatIsUnexplained) {
  diagnosis_.verdict = Verdict::kUnexplained;
  EXPECT_THAT(DiagnosisSentence(diagnosis_),
              testing::Not(HasSubstr("A formula")));
  diagnosis_.proposals = {SomeProposal()};
  EXPECT_THAT(DiagnosisSentence(diagnosis_),
              HasSubstr("A formula that is read off the data, custom@joint1: "
                        "c1*q^2*qd and custom@joint2: c1*max(0,q-s1) and "
                        "spring@joint1, leaves 1.02 times the noise (held out "
                        "1.25)."));
}

TEST_F(ProposalsTest, OfChosenCandidatesTheCatalogueIsNotBlamed) {
  diagnosis_.verdict = Verdict::kUnexplained;
  EXPECT_THAT(DiagnosisSentence(diagnosis_),
              HasSubstr("no effect of the catalogue explains it"));
  diagnosis_.narrowed = true;
  EXPECT_THAT(DiagnosisSentence(diagnosis_),
              HasSubstr("none of the chosen candidates explains it"));
}

// Of an arm: efforts in per cent, what is missing, and what of the URDF is not
// this machine's.
TEST(ArmSentence, SaysWhatIsLeftOfTheEfforts) {
  Diagnosis diagnosis(Shipped("pendulum1"));
  diagnosis.by_equations = true;
  diagnosis.base.fit.effort = {{"joint1", 5.0, 89.72}};
  diagnosis.verdict = Verdict::kMissingEffect;
  diagnosis.proposed = {"viscous_damping@joint1"};
  diagnosis.look.bodies = {1};
  EXPECT_EQ(DiagnosisSentence(diagnosis),
            "The equations of motion leave of the efforts joint1 89.7 % (rms): "
            "missing are viscous_damping@joint1, and the bodies are not those "
            "of the URDF.");
  diagnosis.verdict = Verdict::kUnexplained;
  diagnosis.look = {};
  EXPECT_THAT(DiagnosisSentence(diagnosis),
              HasSubstr("no effects of the catalogue explain most of that"));
  FreeParameter law;
  law.parameter.name = "joint1.damping";
  diagnosis.look.given_laws = {law};
  EXPECT_THAT(DiagnosisSentence(diagnosis),
              HasSubstr("the friction of the URDF is not this machine's (free "
                        "joint1.damping)"));
}

// Where the values rise towards zero their size falls.
TEST(StandInSentence, SaysHowTheValueOrItsSizeChanges) {
  Diagnosis diagnosis(Shipped("pendulum1"));
  diagnosis.verdict = Verdict::kUnexplained;
  ParameterByStrata one;
  one.effect = "sensor_gain@joint1";
  one.parameter = "joint1.sensor_gain";
  one.joint = "joint1";
  one.strata = Strata::kPosition;
  one.trend = Trend::kFalls;
  one.estimates = {{-1.0, 0.0, -0.06, 0.004}, {0.0, 1.0, -0.02, 0.004}};
  diagnosis.stand_ins = {one};
  EXPECT_THAT(DiagnosisSentence(diagnosis),
              HasSubstr("joint1.sensor_gain falls in size with the position of "
                        "joint1: -0.06"));
  for (StratumEstimate& at : diagnosis.stand_ins[0].estimates) at.value *= -1.0;
  EXPECT_THAT(DiagnosisSentence(diagnosis),
              HasSubstr("joint1.sensor_gain falls with the position"));
}

TEST(ForceTableFiles, HaveTheForceOnAGridOverTheRange) {
  const Model model = Shipped("pendulum2_planar", {"force_table@joint2"},
                              {{"joint2.table_0_0", 0.3},
                               {"joint2.table_1_1", -0.2},
                               {"joint2.table_below", 0.5},
                               {"joint2.table_above", 1.5},
                               {"joint2.table_speed", 4.0}});
  const auto files = ForceTableFiles(model);
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(files[0].name, "joint2.force_table.csv");
  std::istringstream lines(files[0].text);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "joint2.q,joint2.qd,joint2.force");
  const auto& effect = model.effects().effect(0);
  int rows = 0;
  double low = 0.0, high = 0.0, fast = 0.0, largest = 0.0;
  while (std::getline(lines, line)) {
    ++rows;
    double q = 0.0, qd = 0.0, force = 0.0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &q, &qd, &force), 3);
    low = std::min(low, q);
    high = std::max(high, q);
    fast = std::max(fast, qd);
    double expected = 0.0;
    effect.HooksFor(ScalarTag<double>())
        .AddEffort({JointType::kRevolute, 1, &q, &qd},
                   model.nominal().effects.data(), &expected);
    EXPECT_NEAR(force, expected, 1e-12);
    largest = std::max(largest, std::abs(force));
  }
  EXPECT_EQ(rows, 25 * 25);
  EXPECT_DOUBLE_EQ(low, -0.5);
  EXPECT_DOUBLE_EQ(high, 1.5);
  EXPECT_DOUBLE_EQ(fast, 4.0);
  EXPECT_GT(largest, 0.1);
}

TEST(ForceTableFiles, AreNoneOfAModelWithoutATable) {
  EXPECT_TRUE(ForceTableFiles(Shipped("pendulum1")).empty());
}

}  // namespace
}  // namespace sysid
