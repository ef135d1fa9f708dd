#include <gmock/gmock.h>

#include <cmath>
#include <optional>

#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "tests/sysid/report/page_setup.h"

namespace sysid {
namespace {

using ::testing::IsEmpty;

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
