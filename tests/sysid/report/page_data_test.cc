#include "sysid/report/page_data.h"

#include <gmock/gmock.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/page_parts.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

std::vector<double> Decode(const Json& series) {
  const std::string digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> bytes;
  std::uint32_t bits = 0;
  int count = 0;
  const bool drawn = series.contains("u16");
  const std::string text = series.at(drawn ? "u16" : "f32");
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<std::uint32_t>(digits.find(c));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::uint8_t>(bits >> count));
  }
  std::vector<double> values;
  for (size_t i = 0; drawn && i + 2 <= bytes.size(); i += 2) {
    const int place = bytes[i] | bytes[i + 1] << 8;
    values.push_back(place == 65535
                         ? NAN
                         : series.at("offset").get<double>() +
                               place * series.at("step").get<double>());
  }
  if (drawn) return values;
  for (size_t i = 0; i + 4 <= bytes.size(); i += 4) {
    const std::uint32_t single = bytes[i] | bytes[i + 1] << 8 |
                                 bytes[i + 2] << 16 |
                                 std::uint32_t{bytes[i + 3]} << 24;
    values.push_back(std::bit_cast<float>(single) +
                     series.value("offset", 0.0));
  }
  return values;
}

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

Session OpenOn(const DiagnosisProblem& problem) {
  Session session(problem.model);
  session.model_name = "pendulum2_planar";
  session.free = problem.free;
  session.runs = RunsOf(*problem.train);
  session.holdout = RunsOf(*problem.holdout);
  session.options = problem.options;
  session.effects = problem.model.effects().names();
  return session;
}

PageSource SourceOf(const Session& session, const DiagnosisProblem& problem) {
  PageSource source;
  source.program = "sysid_diagnose";
  source.command = "sysid_diagnose --auto";
  source.session = &session;
  source.train = problem.train.get();
  source.holdout = problem.holdout.get();
  source.fit_command = [](const std::string& add, const std::string& fix) {
    return "sysid_fit --add " + add + (fix.empty() ? "" : " --fix " + fix);
  };
  return source;
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
  EXPECT_EQ((*page_)["current"], 0);
  EXPECT_EQ((*page_)["compared"], 1);
  const Json& step = (*page_)["steps"].at(0);
  EXPECT_EQ(step["model"], 1);
  EXPECT_EQ(step["from"], 0);
  EXPECT_EQ(step["trainBefore"], models[0]["trainError"]);
  EXPECT_EQ(step["trainAfter"], models[1]["trainError"]);
  EXPECT_EQ(step["holdoutAfter"], models[1]["holdoutError"]);
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
  ASSERT_EQ(whole["parameters"].size(), models[2]["parameters"].size());
  EXPECT_EQ(whole["parameters"][0]["value"],
            models[2]["parameters"][0]["value"]);
}

// A final fit of whole runs that fails is said to, whatever segments say.
TEST_F(DiagnosedPage, DoesNotCallAFinalFitThatFailsAnEnd) {
  const double error = final_->fit.train.total.normalized_rms;
  final_->fit.train.total.normalized_rms = 8.754;
  EXPECT_FALSE(EndsWell(*diagnosis_, *final_));
  EXPECT_THAT(
      EndSentence(*diagnosis_, *final_),
      AllOf(HasSubstr("the error is 8.75 times the noise"),
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

// The members of the interfaces of page_data.ts, by interface; "?" are
// optional.
std::map<std::string, std::set<std::string>> Interfaces() {
  std::ifstream file(SYSID_SOURCE "/web/src/page_data.ts");
  EXPECT_TRUE(file.good());
  std::map<std::string, std::set<std::string>> interfaces;
  std::string line, name;
  std::smatch match;
  const std::regex begin("export interface (\\w+) \\{"), member("  (\\w+): .*");
  while (std::getline(file, line)) {
    if (std::regex_match(line, match, begin)) name = match[1];
    if (line == "}") name.clear();
    if (!name.empty() && std::regex_match(line, match, member)) {
      interfaces[name].insert(match[1]);
    }
  }
  return interfaces;
}

void ExpectKeys(const std::string& name, const Json& json) {
  SCOPED_TRACE(name);
  static const auto interfaces = Interfaces();
  const auto keys = interfaces.find(name);
  ASSERT_NE(keys, interfaces.end());
  std::set<std::string> found;
  for (const auto& item : json.items()) found.insert(item.key());
  EXPECT_THAT(found, ::testing::IsSupersetOf(keys->second));
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
  ExpectKeys("Series", page["runs"][0]["t"]);
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

// A driven cart and pole, the pole not seen for half a second of the second
// fitted run.
class EffortPage : public ::testing::Test {
 protected:
  EffortPage() : problem_(MakeProblem(Shipped("cartpole"), kFree, Runs())) {
    session_ = OpenOn(problem_);
    const ShootingProblem shooting(problem_.model, problem_.free,
                                   problem_.train, problem_.options);
    const Fit fit = FitInverseDynamics(shooting);
    percent_ = fit.effort;
    const Holdout holdout =
        EvaluateHoldout(OpenHoldout(fit.model, problem_.holdout,
                                    problem_.options, fit.point.rollout, 1.0),
                        nullptr);
    PageFit shown;
    shown.title = "as given";
    shown.session = &*session_;
    shown.problem = &shooting;
    shown.fit = &fit;
    shown.holdout = &holdout;
    model_ = PageModel(SourceOf(*session_, problem_), shown, nullptr);
  }

  static std::vector<sysid::Run> Runs() {
    std::vector<sysid::Run> runs;
    for (int seed = 1; seed <= 3; ++seed) {
      runs.push_back(
          Record(Shipped("cartpole"), seed, {.duration = 4.0, .level = 1.0}));
    }
    sysid::Run& gapped = runs[2];
    for (int k = 0; k < gapped.size(); ++k) {
      if (gapped.t[k] < 2.0 || gapped.t[k] > 2.5) continue;
      gapped.channels[1].values.row(k).setConstant(NAN);
    }
    return runs;
  }

  static inline const std::vector<Value> kFree{{"cart.mass", 1.0}};
  DiagnosisProblem problem_;
  std::optional<Session> session_;
  std::vector<EffortError> percent_;
  Json model_;
};

TEST_F(EffortPage, HasWhatTheInverseDynamicsLeaveOfEachJoint) {
  for (const char* which : {"efforts", "holdoutEfforts"}) {
    const Json& efforts = model_[which];
    ASSERT_FALSE(efforts.is_null()) << which;
    ExpectKeys("EffortErrorsData", efforts);
    EXPECT_GT(efforts["cutOff_hz"], 1.0);
    ASSERT_EQ(efforts["joints"].size(), 2u);
    EXPECT_EQ(efforts["joints"][0]["joint"], "slider");
    EXPECT_EQ(efforts["joints"][0]["unit"], "N");
    EXPECT_EQ(efforts["joints"][1]["unit"], "N m");
  }
  ASSERT_EQ(percent_.size(), 2u);
  for (int j = 0; j < 2; ++j) {
    EXPECT_EQ(model_["efforts"]["joints"][j]["rms"], percent_[j].rms);
    EXPECT_EQ(model_["efforts"]["joints"][j]["percent"], percent_[j].percent);
  }
}

// What is drawn has the rms that is said, run by run and joint by joint.
TEST_F(EffortPage, DrawsTheEffortsOfWhichItIsSaid) {
  const Json& predictions = model_["predictions"];
  ASSERT_EQ(predictions.size(), 3u);  // two fitted ones, then the held-out one
  for (const bool held_out : {false, true}) {
    const Json& said = model_[held_out ? "holdoutEfforts" : "efforts"];
    for (int j = 0; j < 2; ++j) {
      double left = 0.0, all = 0.0;
      for (size_t r = held_out ? 2 : 0; r < (held_out ? 3 : 2); ++r) {
        const Json& efforts = predictions[r]["efforts"];
        ASSERT_FALSE(efforts.is_null());
        ExpectKeys("EffortCurvesData", efforts);
        const Json& curve = efforts["curves"].at(j);
        EXPECT_EQ(curve["joint"], said["joints"][j]["joint"]);
        EXPECT_EQ(curve["unit"], said["joints"][j]["unit"]);
        const auto measured = Decode(curve["measured"]);
        const auto predicted = Decode(curve["predicted"]);
        ASSERT_EQ(measured.size(), Decode(efforts["t"]).size());
        ASSERT_EQ(measured.size(), predicted.size());
        for (size_t k = 0; k < measured.size(); ++k) {
          if (std::isnan(measured[k])) continue;
          left += std::pow(measured[k] - predicted[k], 2);
          all += std::pow(measured[k], 2);
        }
      }
      const double percent = said["joints"][j]["percent"];
      EXPECT_NEAR(100.0 * std::sqrt(left / all), percent,
                  0.01 + 0.01 * percent);
    }
  }
}

TEST_F(EffortPage, DrawsNoLineAcrossWhatWasNotMeasured) {
  const auto missing = [&](int run) {
    const Json& efforts = model_["predictions"][run]["efforts"];
    const auto t = Decode(efforts["t"]);
    const auto measured = Decode(efforts["curves"][0]["measured"]);
    std::vector<double> times;
    for (size_t k = 0; k < t.size(); ++k) {
      EXPECT_TRUE(k == 0 || t[k] > t[k - 1]);
      if (std::isnan(measured[k])) times.push_back(t[k]);
    }
    return times;
  };
  EXPECT_THAT(missing(0), IsEmpty());
  const std::vector<double> in_gap = missing(1);
  ASSERT_EQ(in_gap.size(), 1u);
  EXPECT_NEAR(in_gap.front(), 2.25, 0.2);
}

}  // namespace
}  // namespace sysid
