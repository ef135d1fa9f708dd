#include "sysid/report/page_data.h"

#include <gmock/gmock.h>

#include <cmath>
#include <sstream>

#include "sysid/report/diagnosis_report.h"
#include "sysid/report/fit_report.h"
#include "tests/sysid/report/page_setup.h"

namespace sysid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

TEST(Series, AreLittleEndianSinglesInBase64) {
  EXPECT_EQ(Series({1.0, NAN, -2.5}).at("f32"), "AACAPwAAwH8AACDA");
  EXPECT_EQ(Series({}).at("f32"), "");
  EXPECT_EQ(Series({1.0}).at("f32"), "AACAPw==");
  EXPECT_TRUE(std::isnan(Decode(Series({INFINITY})).front()));
  const Json drawn = DrawnSeries({-1.0, NAN, 0.0, 1.0});
  EXPECT_EQ(drawn.at("u16"), "AAD///9//v8=");  // 0, missing, 32767, 65534
  EXPECT_EQ(drawn.at("offset"), -1.0);
  EXPECT_EQ(drawn.at("step"), 2.0 / 65534);
  EXPECT_EQ(DrawnSeries({5.0, 5.0}).at("u16"), "AAAAAA==");
  EXPECT_EQ(DrawnSeries({NAN}).at("u16"), "//8=");
}

TEST(TimeSeries, TellSamplesApartThatLieFarFromZero) {
  const std::vector<double> t{1.7e9, 1.7e9 + 0.01, 1.7e9 + 0.02};
  const std::vector<double> read = Decode(TimeSeries(t));
  for (size_t i = 0; i < t.size(); ++i) EXPECT_NEAR(read[i], t[i], 1e-6);
  EXPECT_FALSE(TimeSeries({0.0, 0.01}).contains("offset"));
}

// Two runs of 8 s and one held out, of a pendulum with a damped joint,
// diagnosed once for all tests.
class DiagnosedPage : public ::testing::Test {
 protected:
  static constexpr char kRun[] = "</script><!--<script>\u2028.csv";

  static void SetUpTestSuite() {
    const Model truth = Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                                {{"joint1.damping", 0.05}});
    std::vector<sysid::Run> runs;
    for (int seed = 1; seed <= 3; ++seed) {
      runs.push_back(Record(truth, seed, {.duration = 8.0}));
    }
    runs[1].name = kRun;
    problem_ = new DiagnosisProblem(
        MakeProblem(Shipped("pendulum2_planar"),
                    {{"link1.length", 0.5}, {"link2.length", 0.5}}, runs));
    session_ = new Session(OpenOn(*problem_));
    DiagnosisOptions options;
    options.add = true;
    diagnosis_ = new Diagnosis(
        Diagnose(*problem_, AllCandidates(problem_->model), options));
    final_ = new FinalFit(FitFinal(*session_, *problem_, *diagnosis_));
    page_ = new Json(DiagnosisPage(SourceOf(*session_, *problem_), *problem_,
                                   *diagnosis_, final_));
  }
  static void TearDownTestSuite() {
    delete page_;
    delete final_;
    delete diagnosis_;
    delete session_;
    delete problem_;
  }

  static const Json& CandidateNamed(const std::string& effect,
                                    const std::string& target) {
    for (const Json& candidate : (*page_)["models"][0]["candidates"]) {
      if (candidate["effect"] == effect && candidate["target"] == target) {
        return candidate;
      }
    }
    ADD_FAILURE() << "no " << effect << "@" << target;
    static const Json none;
    return none;
  }

  static inline DiagnosisProblem* problem_;
  static inline Session* session_;
  static inline Diagnosis* diagnosis_;
  static inline FinalFit* final_;
  static inline Json* page_;
};

TEST_F(DiagnosedPage, HasTheModelAsGivenAndOneAfterEachStep) {
  const Json& models = (*page_)["models"];
  ASSERT_EQ(diagnosis_->steps.size(), 1u);
  ASSERT_EQ(models.size(), 3u);
  EXPECT_EQ(models[0]["title"], "as given");
  EXPECT_EQ(models[0]["verdict"], "missing_effect");
  EXPECT_EQ(models[1]["title"], "+ viscous_damping@joint1");
  EXPECT_EQ(models[1]["effects"], Json::array({"viscous_damping@joint1"}));
  EXPECT_EQ(models[1]["verdict"], "adequate");
  EXPECT_EQ(models[2]["title"], "final fit, whole runs");
  for (const Json& model : models) EXPECT_FALSE(model["horizon"].empty());
  EXPECT_EQ(models[1]["crossValidation"],
            CrossValidationJson(diagnosis_->final->cv));
  EXPECT_TRUE(models[2]["crossValidation"].is_null());
  EXPECT_EQ((*page_)["current"], 0);
  EXPECT_EQ((*page_)["compared"], 1);
  const Json& step = (*page_)["steps"].at(0);
  EXPECT_EQ(step["model"], 1);
  EXPECT_EQ(step["from"], 0);
  // Both errors are over the segments of the model that it led to.
  const ModelErrors& given = diagnosis_->comparison.path.at(0);
  EXPECT_GT(given.segment_s, models[0]["segment_s"].get<double>());
  EXPECT_EQ(step["segment_s"], models[1]["segment_s"]);
  EXPECT_EQ(step["trainBefore"], given.train.normalized_rms);
  EXPECT_EQ(step["holdoutBefore"], given.holdout.normalized_rms);
  EXPECT_EQ(step["crossValidationBefore"], CrossValidationJson(given.cv));
  EXPECT_EQ(step["trainAfter"], models[1]["trainError"]);
  EXPECT_EQ(step["holdoutAfter"], models[1]["holdoutError"]);
  EXPECT_TRUE(step["predicted"].is_null());
  for (const Json& parameter : models[1]["parameters"]) {
    EXPECT_EQ(parameter["ofEffect"], parameter["name"] == "joint1.damping"
                                         ? Json("viscous_damping@joint1")
                                         : Json(nullptr));
  }
}

// The page opens with the model as given; what came of the search must not be
// looked for.
TEST_F(DiagnosedPage, SaysWhereTheSearchEnded) {
  const Json& conclusion = (*page_)["conclusion"];
  EXPECT_EQ(conclusion["good"], true);
  const std::string sentence = conclusion["sentence"];
  EXPECT_THAT(sentence, StartsWith("The search ended with viscous_damping@"
                                   "joint1: over segments of "));
  EXPECT_THAT(sentence, HasSubstr("), and no relevant effect is missing. "
                                  "Fitted once more, as one trajectory over "
                                  "each whole run, the error is "));
  const Json& models = (*page_)["models"];
  EXPECT_FALSE(models[0]["joined"]);
  EXPECT_TRUE(models[2]["joined"]);
  EXPECT_TRUE(models[0]["wholeRuns"].is_null());
  const Json& whole = models[1]["wholeRuns"];
  EXPECT_EQ(whole["trainError"], models[2]["trainError"]);
  EXPECT_EQ(whole["holdoutError"], models[2]["holdoutError"]);
  EXPECT_EQ(whole["sentence"], models[2]["sentence"]);
  EXPECT_EQ(whole["open"], models[2]["open"]);
  ASSERT_EQ(whole["open"].size(), 3u);
  EXPECT_EQ(whole["open"][2]["held_out"], true);
  EXPECT_GT(whole["open"][2]["channels"][0]["fit_percent"], 90.0);
  ASSERT_EQ(whole["parameters"].size(), models[2]["parameters"].size());
  EXPECT_EQ(whole["parameters"][0]["value"],
            models[2]["parameters"][0]["value"]);
}

// Whether the law that was added is constant: of the model that lacked it, and
// of that which has it.
TEST_F(DiagnosedPage, HasHowConstantTheAddedLawIs) {
  const Json& models = (*page_)["models"];
  const Json& stability = models[0]["stability"];
  ASSERT_GE(stability.size(), 3u);
  for (const Json& one : stability) {
    EXPECT_EQ(one["parameter"], "joint1.damping");
    EXPECT_EQ(one["constant"], true);
  }
  EXPECT_EQ(models[1]["stability"], stability);
  EXPECT_THAT(models[2]["stability"], IsEmpty());
  for (const Json& model : models) EXPECT_THAT(model["standIns"], IsEmpty());
}

// A final fit of whole runs that fails is said to, whatever segments say.
TEST_F(DiagnosedPage, DoesNotCallAFinalFitThatFailsAnEnd) {
  const double error = final_->fit.train.total.normalized_rms;
  final_->fit.train.total.normalized_rms = 8.754;
  EXPECT_FALSE(EndsWell(*diagnosis_, *final_));
  EXPECT_THAT(
      EndSentence(*diagnosis_, *final_),
      AllOf(HasSubstr(", 8.75 times the noise"),
            HasSubstr("the model does not explain the data. What is small over "
                      "a segment adds up over a whole run.")));
  final_->fit.train.total.normalized_rms = error;
  EXPECT_TRUE(EndsWell(*diagnosis_, *final_));
}

TEST_F(DiagnosedPage, PredictsNothingWhereItPromisesNothing) {
  const Json& model = (*page_)["models"][0];
  const double error = model["trainError"];
  int with = 0;
  for (const Json& candidate : model["candidates"]) {
    const bool has = !candidate["predictedError"].is_null();
    EXPECT_EQ(candidate["noPrediction"] == "", has) << candidate["effect"];
    if (has) {
      EXPECT_LT(candidate["predictedError"], error);
    }
    with += has ? 1 : 0;
  }
  EXPECT_GT(with, 0);
  // Seen from a model that is nearer than the linearisation.
  Diagnosis near(diagnosis_->base.fit.model);
  near.candidates = {diagnosis_->candidates.front()};
  near.candidates[0].screened.predicted_error = 1200;
  near.base.fit.train.total.normalized_rms = 1090;
  const Json candidate =
      CandidatesJson(SourceOf(*session_, *problem_), near)[0];
  EXPECT_TRUE(candidate["predictedError"].is_null());
  EXPECT_THAT(candidate["noPrediction"].get<std::string>(),
              HasSubstr("too far from this data"));
  DiagnosisStep step;
  step.predicted = 1200;
  step.train_before = 1090;
  EXPECT_TRUE(PageStep(step, 1, 0)["predicted"].is_null());
}

TEST_F(DiagnosedPage, SaysWhatNoiseAloneWouldMakeOfTheHorizon) {
  for (const Json& model : (*page_)["models"]) {
    for (const Json& h : model["horizon"]) {
      EXPECT_GE(h["noise_rms"].get<double>(), 0.99 * kSetupNoise);
    }
  }
}

TEST_F(DiagnosedPage, HasResidualsInUnitsOfTheNoise) {
  const Json& runs = (*page_)["runs"];
  ASSERT_EQ(runs.size(), 3u);
  EXPECT_TRUE(runs[2]["heldOut"]);
  for (const Json& model : (*page_)["models"]) {
    for (size_t r = 0; r < runs.size(); ++r) {
      for (size_t c = 0; c < runs[r]["channels"].size(); ++c) {
        const Json& channel = runs[r]["channels"][c];
        const Json& prediction = model["predictions"][r]["channels"][c];
        const auto measured = Decode(channel["measured"][0]);
        const auto predicted = Decode(prediction["predicted"][0]);
        const auto residual = Decode(prediction["residual"][0]);
        ASSERT_EQ(residual.size(), 801u);
        double squares = 0.0;
        for (size_t k = 0; k < residual.size(); ++k) {
          // Single precision of angles of some rad.
          EXPECT_NEAR(residual[k], (measured[k] - predicted[k]) / 1e-3, 2e-3);
          squares += residual[k] * residual[k];
        }
        if (model["id"] == 0) continue;
        EXPECT_NEAR(std::sqrt(squares / residual.size()), 1.0, 0.15);
      }
    }
  }
}

TEST_F(DiagnosedPage, PredictsWhatTheTableDoes) {
  const Json& model = (*page_)["models"][2];
  std::istringstream rows(
      PredictionCsv(*final_->problem, final_->fit, nullptr));
  std::string header, row;
  std::getline(rows, header);
  ASSERT_THAT(header, HasSubstr("t,run,t_run,joint1.q.measured,joint1.q.pred"));
  const auto t = Decode((*page_)["runs"][0]["t"]);
  const auto measured =
      Decode((*page_)["runs"][0]["channels"][0]["measured"][0]);
  const auto predicted =
      Decode(model["predictions"][0]["channels"][0]["predicted"][0]);
  const Json& drawn = model["predictions"][0]["q"][0];
  const auto q = Decode(drawn);
  const double half = 0.5 * drawn.at("step").get<double>();
  for (size_t k = 0; k < t.size(); ++k) {
    ASSERT_TRUE(std::getline(rows, row));
    double cells[5];
    std::istringstream line(row);
    for (double& cell : cells) {
      std::string text;
      std::getline(line, text, ',');
      cell = std::stod(text);
    }
    EXPECT_NEAR(t[k], cells[2], 1e-6);
    EXPECT_NEAR(measured[k], cells[3], 1e-6);
    EXPECT_NEAR(predicted[k], cells[4], 1e-6);
    EXPECT_NEAR(q[k], cells[4], half + 1e-6);
  }
}

TEST_F(DiagnosedPage, HasTheForceThatADampingWouldAdd) {
  const Json& candidate = CandidateNamed("viscous_damping", "joint1");
  const Json& curves = (*page_)["models"][0]["force"];
  ASSERT_EQ(candidate["force"].size(), curves.size());
  const double damping = candidate["expected"][0]["value"];
  EXPECT_GT(damping, 0.0);
  EXPECT_EQ(candidate["law"], "-d qd");
  EXPECT_EQ(candidate["command"], "sysid_fit --add viscous_damping@joint1");
  for (size_t i = 0; i < curves.size(); ++i) {
    const auto force = Decode(candidate["force"][i]);
    const auto velocity = Decode(curves[i]["velocity"]);
    ASSERT_EQ(force.size(), Decode(curves[i]["t"]).size());
    ASSERT_EQ(force.size(), velocity.size());
    const bool own = curves[i]["joint"] == "joint1";
    for (size_t k = 0; k < force.size(); ++k) {
      EXPECT_NEAR(force[k], own ? -damping * velocity[k] : 0.0, 1e-6);
    }
    EXPECT_THAT(Decode(curves[i]["effort"]), IsEmpty());  // none was measured
  }
}

TEST_F(DiagnosedPage, HasForcesOfEveryKindOfEffect) {
  // As few effects as are shown act on sensors only, without a force.
  int with_force = 0;
  const Json& model = (*page_)["models"][0];
  for (const Json& candidate : model["candidates"]) {
    EXPECT_THAT(candidate["law"].get<std::string>(), Not(IsEmpty()));
    if (candidate["effect"] == "sensor_offset") {
      EXPECT_THAT(candidate["force"], IsEmpty());
    }
    if (candidate["force"].empty()) continue;
    ++with_force;
    double most = 0.0;
    for (const Json& series : candidate["force"]) {
      for (const double f : Decode(series)) {
        ASSERT_TRUE(std::isfinite(f));
        most = std::max(most, std::abs(f));
      }
    }
    EXPECT_GT(most, 0.0) << candidate["effect"];
  }
  EXPECT_GE(with_force, 6);
}

TEST_F(DiagnosedPage, HasEveryKeyThatThePageReads) {
  const Json& page = *page_;
  const Json& model = page["models"][0];
  ExpectKeys("PageData", page);
  ExpectKeys("MechanismData", page["mechanism"]);
  ExpectKeys("JointData", page["mechanism"]["joints"][0]);
  ExpectKeys("RunData", page["runs"][0]);
  ExpectKeys("ChannelData", page["runs"][0]["channels"][0]);
  ExpectKeys("ModelData", model);
  ExpectKeys("PredictionData", model["predictions"][0]);
  ExpectKeys("Series", page["runs"][0]["t"]);
  ExpectKeys("DrawnSeries", model["predictions"][0]["q"][0]);
  ExpectKeys("ParameterData", model["parameters"][0]);
  ExpectKeys("CandidateData", model["candidates"][0]);
  ExpectKeys("ForceData", model["force"][0]);
  ExpectKeys("StepData", page["steps"][0]);
  ExpectKeys("WholeRunsData", page["models"][1]["wholeRuns"]);
  ExpectKeys("OpenData", page["models"][2]["open"][0]);
  ExpectKeys("CrossValidationData", model["crossValidation"]);
}

TEST_F(DiagnosedPage, StandsInAnHtmlOfLessThanThreeMegabytes) {
  if (!WhyNoPage().empty()) GTEST_SKIP() << WhyNoPage();
  const std::string html = ReportHtml(*page_);
  EXPECT_LT(html.size(), 3u << 20);
  const std::string element =
      "<script id=\"page-data\" type=\"application/json\">";
  const size_t begin = html.find(element) + element.size();
  const std::string text =
      html.substr(begin, html.find("</script>", begin) - begin);
  EXPECT_THAT(text, Not(HasSubstr("<")));
  EXPECT_THAT(text, Not(HasSubstr("\u2028")));
  EXPECT_EQ(Json::parse(text), *page_);
  EXPECT_EQ(Json::parse(text)["runs"][0]["name"], kRun);
  EXPECT_THAT(LivePage(), HasSubstr(element + "</script>"));
}

TEST_F(DiagnosedPage, HasTheFilesOfEveryModel) {
  for (const Json& model : (*page_)["models"]) {
    ASSERT_EQ(model["files"].size(), 4u);
    for (const Json& file : model["files"]) {
      const bool left_out = file["name"] == "prediction.csv" &&
                            model["id"] != (*page_)["models"].size() - 1;
      EXPECT_EQ(file["text"].is_null(), left_out) << file["name"];
    }
    EXPECT_EQ(
        Json::parse(model["files"][0]["text"].get<std::string>())["effects"],
        model["effects"]);
    const size_t n = model["correlationNames"].size();
    ASSERT_EQ(model["correlation"].size(), n);
    for (size_t i = 0; i < n; ++i) {
      EXPECT_NEAR(model["correlation"][i][i].get<double>(), 1.0, 1e-12);
    }
  }
}

TEST_F(DiagnosedPage, ComparesNoEffortsWhereNoneWereMeasured) {
  for (const Json& model : (*page_)["models"]) {
    EXPECT_TRUE(model["efforts"].is_null());
    EXPECT_TRUE(model["holdoutEfforts"].is_null());
    for (const Json& prediction : model["predictions"]) {
      EXPECT_TRUE(prediction["efforts"].is_null());
    }
  }
}

}  // namespace
}  // namespace sysid
