#include <gmock/gmock.h>

#include <cmath>
#include <memory>

#include "tests/sysid/report/page_setup.h"

namespace sysid {
namespace {

CrossValidation Of(const std::vector<double>& errors) {
  CrossValidation cv;
  for (const double error : errors) {
    const double t = static_cast<double>(cv.stretches.size());
    cv.stretches.push_back(
        {50.0 * error * error, error > 0 ? 50.0 : 0.0, "run.csv", t, t + 1.0});
  }
  return cv;
}

TEST(CrossValidationJson, HasTheErrorOfEachStretch) {
  const CrossValidation cv = Of({1.0, 4.0, 0.0});
  const Json json = CrossValidationJson(cv);
  ExpectKeys("CrossValidationData", json);
  EXPECT_NEAR(json["error"].get<double>(), 2.0, 1e-12);
  EXPECT_EQ(json["stdError"], cv.std_error());
  ASSERT_EQ(json["stretches"].size(), 3u);
  const Json& second = json["stretches"][1];
  EXPECT_EQ(second["trajectory"], "run.csv");
  EXPECT_EQ(second["t_start"], 1.0);
  EXPECT_EQ(second["t_end"], 2.0);
  EXPECT_EQ(second["error"], 4.0);
  EXPECT_TRUE(json["stretches"][2]["error"].is_null());  // nothing is in it
}

TEST(CrossValidationJson, IsNoneWhereNothingWasLeftOut) {
  EXPECT_TRUE(CrossValidationJson({}).is_null());
  EXPECT_TRUE(CrossValidationJson(Of({2.0}))["stdError"].is_null());
}

TEST(RivalsJson, NamesWhatWouldTellThemApart) {
  Diagnosis diagnosis(Shipped("pendulum1"));
  EXPECT_EQ(RivalsJson(diagnosis), Json::array());
  const auto model = std::make_shared<EvaluatedModel>(Shipped("pendulum1"));
  model->cv = Of({1.0, 4.0});
  model->holdout.total.normalized_rms = 2.5;
  diagnosis.rivals = {{{"a@j"}, "", true, model},
                      {{"b@j"}, "slow motion", false, model}};
  const Json json = RivalsJson(diagnosis);
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[0]["effects"], Json::array({"a@j"}));
  EXPECT_EQ(json[1]["separatedBy"], "slow motion");
  EXPECT_EQ(json[1]["sameForce"], false);
  EXPECT_EQ(json[1]["crossValidation"], CrossValidationJson(model->cv));
  EXPECT_EQ(json[1]["holdoutError"], 2.5);
}

TEST(ProposalsJson, HaveTheCommandThatAddsThem) {
  Diagnosis diagnosis(Shipped("pendulum1"));
  PageSource source;
  source.fit_command = [](const std::string& add, const std::string&) {
    return "sysid_fit --add " + add;
  };
  EXPECT_EQ(ProposalsJson(source, diagnosis), Json::array());
  FormulaProposal proposal;
  proposal.laws = {"custom@joint1: c1*q^2"};
  proposal.beside = {"spring@joint1"};
  proposal.parameters.resize(1);
  proposal.parameters[0].name = "joint1.c1";
  proposal.parameters[0].value = -0.5;
  proposal.cv_error = 1.02;
  proposal.holdout = NAN;
  diagnosis.proposals = {proposal};
  const Json json = ProposalsJson(source, diagnosis).at(0);
  ExpectKeys("ProposalData", json);
  EXPECT_EQ(json["effects"],
            Json::array({"custom@joint1: c1*q^2", "spring@joint1"}));
  EXPECT_EQ(json["parameters"][0]["value"], -0.5);
  EXPECT_EQ(json["crossValidatedError"], 1.02);
  EXPECT_TRUE(json["holdoutError"].is_null());
  EXPECT_EQ(json["command"],
            "sysid_fit --add custom@joint1: c1*q^2,spring@joint1");
}

TEST(StandInsJson, SaysWhereAnEffectIsNotConstant) {
  ParameterByStrata one;
  one.effect = "spring@joint1";
  one.parameter = "joint1.stiffness";
  one.strata = Strata::kAmplitude;
  one.estimates = {{0.1, 0.5, -2.0, 0.1}, {0.5, 1.0, -1.0, NAN}};
  one.trend = Trend::kFalls;
  const Json by = StabilityJson({one}).at(0);
  ExpectKeys("StabilityData", by);
  EXPECT_EQ(by["strata"], "amplitude");
  EXPECT_EQ(by["estimates"][0]["value"], -2.0);
  EXPECT_TRUE(by["estimates"][1]["std_error"].is_null());
  const Json stand_in = StandInsJson({one}).at(0);
  EXPECT_EQ(stand_in["effect"], "spring@joint1");
  EXPECT_EQ(stand_in["strata"], "amplitude");
}

TEST(LeftOutJson, ComparesTheFinalModelWithItselfWithoutAnEffect) {
  ModelComparison comparison;
  EXPECT_TRUE(LeftOutJson(comparison).is_null());
  ModelErrors final, without;
  final.effects = {"a@j", "b@j"};
  final.cv = Of({1.0, 1.0});
  without.change = "b@j";
  without.cv = Of({3.0, 3.0});
  comparison.path = {ModelErrors(), final};
  comparison.left_out = {without};
  const Json json = LeftOutJson(comparison);
  EXPECT_EQ(json["effects"], Json::array({"a@j", "b@j"}));
  EXPECT_NEAR(json["with"]["error"].get<double>(), 1.0, 1e-12);
  ASSERT_EQ(json["without"].size(), 1u);
  EXPECT_EQ(json["without"][0]["effect"], "b@j");
  EXPECT_NEAR(json["without"][0]["crossValidation"]["error"].get<double>(), 3.0,
              1e-12);
}

TEST(PageStep, ComparesOverTheSegmentsBefore) {
  DiagnosisStep step;
  step.segment_s = 1.5;
  EXPECT_TRUE(PageStep(step, 1, 0)["crossValidationBefore"].is_null());
  step.cv_before = Of({3.0, 3.0});
  const Json json = PageStep(step, 1, 0);
  EXPECT_EQ(json["segment_s"], 1.5);
  EXPECT_NEAR(json["crossValidationBefore"]["error"].get<double>(), 3.0, 1e-12);
}

}  // namespace
}  // namespace sysid
