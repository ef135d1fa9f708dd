#include "sysid/diagnosis/diagnose.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "sysid/diagnosis/comparison.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/report/diagnosis_report.h"
#include "tests/support/measured_run.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"

namespace sysid {
namespace {

using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::UnorderedElementsAre;
using ::testing::UnorderedElementsAreArray;

const std::vector<Value> kLengths{{"link1.length", 0.5}, {"link2.length", 0.5}};
// What is free, and right.
std::vector<Value> FreeOf(const std::string& robot) {
  if (robot != "cartpole") return kLengths;
  std::vector<Value> free;
  for (const Parameter& p :
       FindParameters(Shipped(robot), {"cart.mass", "pole.length"}, "test")) {
    free.push_back({p.name, p.nominal});
  }
  return free;
}

Diagnosis Diagnosed(const DiagnosisProblem& problem, bool add = true) {
  DiagnosisOptions options;
  options.add = add;
  return Diagnose(problem, AllCandidates(problem.model), options);
}

// What a machine hides: effects, and values of parameters.
struct Hidden {
  std::string robot;
  std::vector<std::string> effects;
  std::vector<Value> values;
};

std::vector<sysid::Run> RecordAll(const Hidden& hidden, int runs,
                                  const Recording& recording = {}) {
  const Model truth = Shipped(hidden.robot, hidden.effects, hidden.values);
  Recording driven = recording;
  if (hidden.robot == "cartpole") driven.level = 0.3;
  std::vector<Run> recorded;
  for (int seed = 1; seed <= runs; ++seed) {
    recorded.push_back(Record(truth, seed, driven));
  }
  return recorded;
}

DiagnosisProblem ProblemOf(const Hidden& hidden) {
  return MakeProblem(Shipped(hidden.robot), FreeOf(hidden.robot),
                     RecordAll(hidden, 3));
}

std::string Print(const Diagnosis& diagnosis) {
  std::string text = DiagnosisSentence(diagnosis) + "\n";
  for (const auto& candidate : diagnosis.candidates) {
    if (!candidate.confirmed) continue;
    char line[200];
    std::snprintf(line, sizeof(line), "%s: train %.3g, held out %.3g, %s\n",
                  candidate.screened.name().c_str(), candidate.confirmed->train,
                  candidate.confirmed->holdout,
                  candidate.confirmed->refused.c_str());
    text += line;
  }
  for (const DiagnosisStep& step : diagnosis.steps) {
    for (const std::string& name : step.effects) text += "+ " + name + " ";
    if (!step.removed.empty()) text += "- " + step.removed + " ";
    text += std::to_string(step.train_after) + "\n";
  }
  return text;
}

const CandidateEffect* Find(const Diagnosis& diagnosis,
                            const std::string& name) {
  for (const CandidateEffect& candidate : diagnosis.candidates) {
    if (candidate.screened.name() == name) return &candidate;
  }
  return nullptr;
}

class HiddenEffects : public testing::TestWithParam<Hidden> {};

// Why people come: one thing is missing, and they are told which, and how
// large it is.
TEST_P(HiddenEffects, AreFoundAndAdded) {
  const DiagnosisProblem problem = ProblemOf(GetParam());
  const Diagnosis diagnosis = Diagnosed(problem);
  SCOPED_TRACE(Print(diagnosis));
  EXPECT_EQ(diagnosis.final_verdict, Verdict::kAdequate);
  EXPECT_THAT(diagnosis.doubts, IsEmpty());
  EXPECT_GT(diagnosis.base.holdout_error(), 1.5);
  ASSERT_FALSE(diagnosis.candidates.empty());
  const CandidateEffect& first = diagnosis.candidates.front();
  const Value& hidden = GetParam().values.front();
  const std::string effect =
      GetParam().effects.empty()
          ? "mass@" + hidden.name.substr(0, hidden.name.find('.'))
          : GetParam().effects.front();
  EXPECT_EQ(first.screened.name(), effect);
  ASSERT_TRUE(first.confirmed);
  EXPECT_TRUE(first.confirmed->accepted);
  EXPECT_LT(first.screened.p_value, 1e-3);
  // Where another one does the same in this mechanism, both are named.
  const bool undecided =
      std::any_of(diagnosis.rivals.begin(), diagnosis.rivals.end(),
                  [](const RivalModel& rival) { return !rival.same_force; });
  EXPECT_EQ(diagnosis.verdict,
            undecided ? Verdict::kUndecided : Verdict::kMissingEffect);
  EXPECT_THAT(
      DiagnosisSentence(diagnosis),
      HasSubstr(undecided ? "explain the data equally well: " + effect + "; "
                : diagnosis.rivals.empty()
                    ? effect + " is missing"
                    : effect + " (in this data the same force as "));
  // One step, and it is over.
  ASSERT_EQ(diagnosis.steps.size(), 1u);
  const DiagnosisStep& step = diagnosis.steps.front();
  EXPECT_THAT(step.effects, ElementsAre(effect));
  EXPECT_EQ(step.train_before, diagnosis.base.train_error());
  EXPECT_EQ(step.holdout_before, diagnosis.base.holdout_error());
  EXPECT_LT(step.train_after, 1.1);
  EXPECT_LT(step.holdout_after, 1.1);
  EXPECT_GT(step.holdout_after, 0.85);
  // What was right stays so, what was hidden is known.
  const Fit& fit = diagnosis.last().fit;
  EXPECT_TRUE(fit.converged);
  EXPECT_LT(std::abs(Deviation(fit, hidden)), 4.0) << hidden.name;
  for (const Value& right : FreeOf(GetParam().robot)) {
    EXPECT_LT(std::abs(Deviation(fit, right)), 4.0) << right.name;
  }
}

INSTANTIATE_TEST_SUITE_P(
    One, HiddenEffects,
    testing::Values(
        Hidden{"pendulum2_planar",
               {"viscous_damping@joint1"},
               {{"joint1.damping", 0.05}}},
        Hidden{"pendulum2_planar",
               {"coulomb_friction@joint2"},
               {{"joint2.friction", 0.02}}},
        Hidden{"pendulum2_planar",
               {"gravity_tilt@base"},
               {{"gravity_tilt_y", 0.03}}},
        // Of the two masses a swing shows the ratio: the first is named.
        Hidden{"pendulum2_planar", {}, {{"link1.mass", 1.3}}},
        Hidden{"cartpole", {"effort_delay@base"}, {{"effort_delay", 0.03}}},
        Hidden{
            "cartpole", {"effort_gain@slider"}, {{"slider.effort_gain", 0.1}}}),
    [](const auto& info) {
      std::string name = info.param.values.front().name;
      std::replace(name.begin(), name.end(), '.', '_');
      return info.param.robot + "_" + name;
    });

// Without --auto nothing is added, and the list is the same.
TEST(Diagnose, AddsNothingUnasked) {
  const Hidden hidden{"pendulum2_planar",
                      {"viscous_damping@joint1"},
                      {{"joint1.damping", 0.05}}};
  const Diagnosis diagnosis = Diagnosed(ProblemOf(hidden), false);
  EXPECT_EQ(diagnosis.verdict, Verdict::kMissingEffect);
  EXPECT_THAT(diagnosis.steps, IsEmpty());
  EXPECT_THAT(diagnosis.added(), IsEmpty());
  EXPECT_FALSE(diagnosis.final);
  EXPECT_EQ(diagnosis.candidates.front().screened.name(),
            "viscous_damping@joint1");
}

// Both of a pair, whatever came first.
TEST(Diagnose, FindsTwoEffects) {
  const Hidden hidden{
      "pendulum2_planar",
      {"viscous_damping@joint1", "sensor_offset@joint2"},
      {{"joint1.damping", 0.02}, {"joint2.sensor_offset", 0.03}}};
  const Diagnosis diagnosis = Diagnosed(ProblemOf(hidden));
  SCOPED_TRACE(Print(diagnosis));
  EXPECT_THAT(diagnosis.added(), UnorderedElementsAre("viscous_damping@joint1",
                                                      "sensor_offset@joint2"));
  EXPECT_EQ(diagnosis.final_verdict, Verdict::kAdequate);
  EXPECT_LT(diagnosis.last().train_error(), 1.1);
  EXPECT_LT(diagnosis.last().holdout_error(), 1.1);
  for (const Value& value : hidden.values) {
    EXPECT_LT(std::abs(Deviation(diagnosis.last().fit, value)), 4.0)
        << value.name;
  }
  // Every step lowered both errors, and began where the one before ended.
  for (size_t i = 0; i < diagnosis.steps.size(); ++i) {
    const DiagnosisStep& step = diagnosis.steps[i];
    EXPECT_LT(step.train_after, step.train_before);
    EXPECT_LT(step.holdout_after, step.holdout_before);
    // In longer segments, where the better model can be followed.
    if (i == 0 || step.segment_s != diagnosis.steps[i - 1].segment_s) continue;
    EXPECT_NEAR(step.train_before, diagnosis.steps[i - 1].train_after,
                0.02 * step.train_before);
  }
  // All models beside each other, over the segments of the last: none of its
  // neighbours predicts better.
  const ModelComparison& models = diagnosis.comparison;
  ASSERT_EQ(models.path.size(), diagnosis.steps.size() + 1);
  EXPECT_THAT(models.path[0].effects, IsEmpty());
  EXPECT_THAT(models.path.back().effects,
              UnorderedElementsAreArray(diagnosis.added()));
  EXPECT_EQ(models.path.back().cv.error(), diagnosis.last().cv.error());
  EXPECT_GT(models.path[0].cv.error(), 2.0 * models.path.back().cv.error());
  for (const ModelErrors& model : models.path) {
    EXPECT_EQ(model.segment_s, diagnosis.last().fit.segment_s);
  }
  std::vector<std::string> left_out;
  for (const ModelErrors& model : models.left_out) {
    left_out.push_back(model.change);
    EXPECT_EQ(model.effects.size() + 1, diagnosis.added().size());
    EXPECT_EQ(model.segment_s, diagnosis.last().fit.segment_s);
    EXPECT_GT(
        DifferenceOf(model.cv.LogErrors(), models.path.back().cv.LogErrors())
            .mean,
        std::log1p(kMatters))
        << model.change;
  }
  EXPECT_THAT(left_out, UnorderedElementsAreArray(diagnosis.added()));
  for (const ModelErrors& model : models.added) {
    EXPECT_LT(
        DifferenceOf(models.path.back().cv.LogErrors(), model.cv.LogErrors())
            .mean,
        std::log1p(kMatters))
        << model.change;
  }
}

// Between a friction of every speed and a drag of the fast a damping looks like
// both: what stood in for others is no part of the answer.
TEST(Diagnose, LeavesOutWhatStoodInForOthers) {
  const Hidden hidden{
      "pendulum2_planar",
      {"coulomb_friction@joint1", "quadratic_drag@joint1"},
      {{"joint1.friction", 0.05}, {"joint1.quadratic_drag", 0.03}}};
  const Diagnosis diagnosis = Diagnosed(ProblemOf(hidden));
  SCOPED_TRACE(Print(diagnosis));
  EXPECT_THAT(diagnosis.added(),
              UnorderedElementsAre(hidden.effects[0], hidden.effects[1]));
  // The list ends as the search does: what stayed is first and accepted.
  ASSERT_GE(diagnosis.candidates.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    const CandidateEffect& candidate = diagnosis.candidates[i];
    EXPECT_THAT(diagnosis.added(), Contains(candidate.screened.name()));
    ASSERT_TRUE(candidate.confirmed);
    EXPECT_TRUE(candidate.confirmed->accepted);
    // Its errors are those of the last model only where it says so.
    const bool together = !candidate.confirmed->together_with.empty();
    const EvaluatedModel& of = together ? diagnosis.last() : diagnosis.base;
    EXPECT_EQ(candidate.confirmed->segment_s, of.fit.segment_s);
    if (together) {
      EXPECT_THAT(candidate.confirmed->together_with,
                  ElementsAre(Not(candidate.screened.name())));
    }
    EXPECT_EQ(together,
              candidate.confirmed->train == diagnosis.last().train_error());
    EXPECT_THAT(candidate.indistinguishable_from,
                Not(Contains("viscous_damping@joint1")));
  }
  const CandidateEffect* gone = Find(diagnosis, "viscous_damping@joint1");
  ASSERT_TRUE(gone);
  EXPECT_FALSE(gone->confirmed && gone->confirmed->accepted);
  EXPECT_EQ(diagnosis.final_verdict, Verdict::kAdequate);
  EXPECT_LT(diagnosis.last().holdout_error(), 1.1);
  for (const Value& value : hidden.values) {
    EXPECT_LT(std::abs(Deviation(diagnosis.last().fit, value)), 4.0)
        << value.name;
  }
}

// A model that lacks nothing is told so, with what it could not have hidden.
TEST(Diagnose, FindsNothingMissingInACompleteModel) {
  for (const std::string robot : {"pendulum2_planar", "cartpole"}) {
    SCOPED_TRACE(robot);
    const Diagnosis diagnosis = Diagnosed(ProblemOf({robot, {}, {}}));
    SCOPED_TRACE(Print(diagnosis));
    EXPECT_EQ(diagnosis.verdict, Verdict::kAdequate);
    EXPECT_EQ(diagnosis.final_verdict, Verdict::kAdequate);
    EXPECT_THAT(diagnosis.steps, IsEmpty());
    EXPECT_THAT(diagnosis.added(), IsEmpty());
    EXPECT_THAT(diagnosis.doubts, IsEmpty());
    EXPECT_NEAR(diagnosis.base.train_error(), 1.0, 0.1);
    EXPECT_NEAR(diagnosis.base.holdout_error(), 1.0, 0.1);
    EXPECT_THAT(DiagnosisSentence(diagnosis),
                HasSubstr("no relevant effect is missing"));
    EXPECT_GE(diagnosis.candidates.size(), 15u);
    EXPECT_GT(diagnosis.tests, 15);
    for (const CandidateEffect& candidate : diagnosis.candidates) {
      EXPECT_FALSE(candidate.confirmed && candidate.confirmed->accepted)
          << candidate.screened.name();
      EXPECT_THAT(candidate.indistinguishable_from, IsEmpty());
      for (const ExpectedParameter& p : candidate.screened.parameters) {
        // But for one that a bound holds at none.
        EXPECT_TRUE(p.searched || p.detectable > 0.0 || p.value == p.null_value)
            << p.name;
      }
    }
    // A friction of half a newton metre would not have been missed.
    if (robot == "cartpole") continue;
    EXPECT_LT(Find(diagnosis, "viscous_damping@joint1")
                  ->screened.parameters[0]
                  .detectable,
              0.01);
  }
}

// What decides is data that was never fitted: a damping that only the fitted
// runs have lowers their error as far as it can, and is refused.
TEST(Diagnose, RefusesWhatLowersOnlyTheFittedError) {
  const Hidden damped{"pendulum2_planar",
                      {"viscous_damping@joint1"},
                      {{"joint1.damping", 0.05}}};
  DiagnosisProblem problem = ProblemOf(damped);
  problem.SetRuns(RunsOf(*problem.train),
                  RecordAll({"pendulum2_planar", {}, {}}, 1));
  const Diagnosis diagnosis = Diagnosed(problem);
  SCOPED_TRACE(Print(diagnosis));
  const CandidateEffect* damping = Find(diagnosis, "viscous_damping@joint1");
  ASSERT_NE(damping, nullptr);
  ASSERT_TRUE(damping->confirmed);
  EXPECT_LT(damping->confirmed->train, 1.1);  // a perfect fit
  EXPECT_GT(damping->confirmed->holdout, diagnosis.base.holdout_error());
  EXPECT_FALSE(damping->confirmed->accepted);
  EXPECT_THAT(damping->confirmed->refused,
              AnyOf("it does not lower the error of the held-out runs",
                    "it does not improve the prediction of held-out data"));
  EXPECT_EQ(diagnosis.verdict, Verdict::kUnexplained);
  EXPECT_THAT(diagnosis.added(), Not(Contains("viscous_damping@joint1")));
}

// A run under efforts that are not in it: bursts at random, as if someone
// knocked against it.
Run Knocked(const Model& truth, std::uint64_t seed) {
  Run run = Record(truth, seed, {.duration = 4.0, .noise = 0.0});
  Random random(seed);
  Run knocked = run;
  for (int k = 0; k < run.size(); ++k) {
    for (int j = 0; j < truth.nv(); ++j) {
      // A fresh force every 50 ms.
      knocked.effort(k, j) =
          k % 5 == 0 ? 0.5 * random.Normal() : knocked.effort(k - 1, j);
    }
  }
  const Eigen::VectorXd x0 = RandomState(truth, 1.0, seed);
  const RowMatrixXd states = StatesOf(truth, knocked, x0);
  for (Channel& channel : run.channels) {
    for (int k = 0; k < run.size(); ++k) {
      channel.values.row(k) =
          (Measured(truth.mechanism(), channel, states.row(k).transpose()) +
           kSetupNoise * random.NormalVector(1))
              .transpose();
    }
  }
  return run;
}

// Both masses free: a passive swing then shows neither them nor a damping, only
// their ratios; that a damping is missing it shows all the same.
TEST(Diagnose, FindsWhatOtherParametersHideInPart) {
  const Hidden hidden = {"pendulum2_planar",
                         {"viscous_damping@joint1"},
                         {{"joint1.damping", 0.05}}};
  const Diagnosis diagnosis = Diagnosed(MakeProblem(Shipped(hidden.robot),
                                                    {{"link1.length", 0.5},
                                                     {"link2.length", 0.5},
                                                     {"link1.mass", 1.0},
                                                     {"link2.mass", 1.0}},
                                                    RecordAll(hidden, 3)));
  SCOPED_TRACE(Print(diagnosis));
  EXPECT_EQ(diagnosis.verdict, Verdict::kMissingEffect);
  EXPECT_THAT(diagnosis.doubts, Not(IsEmpty()));
  ASSERT_FALSE(diagnosis.proposed.empty());
  EXPECT_EQ(diagnosis.proposed.front(), "viscous_damping@joint1");
  EXPECT_EQ(diagnosis.final_verdict, Verdict::kAdequate);
}

// Where the catalogue has no answer the honest one is none.
TEST(Diagnose, ClaimsNothingWhereNoEffectExplainsTheError) {
  const Model truth = Shipped("pendulum2_planar");
  const Diagnosis diagnosis = Diagnosed(
      MakeProblem(truth, kLengths,
                  {Knocked(truth, 1), Knocked(truth, 2), Knocked(truth, 3)}));
  SCOPED_TRACE(Print(diagnosis));
  EXPECT_GT(diagnosis.base.train_error(), 3.0);
  EXPECT_EQ(diagnosis.verdict, Verdict::kUnexplained);
  EXPECT_EQ(diagnosis.final_verdict, Verdict::kUnexplained);
  EXPECT_THAT(diagnosis.added(), IsEmpty());
  EXPECT_THAT(DiagnosisSentence(diagnosis),
              HasSubstr("no effect of the catalogue"));
}

// First things first: a fit that is not to be trusted is not argued from in
// silence.
TEST(Diagnose, DoubtsAFitAtABound) {
  DiagnosisProblem problem = ProblemOf({"pendulum2_planar", {}, {}});
  problem.free[0].initial = 0.4;
  problem.free[0].upper = 0.45;
  const Diagnosis diagnosis = Diagnosed(problem, false);
  SCOPED_TRACE(Print(diagnosis));
  EXPECT_THAT(diagnosis.doubts, Contains("link1.length ended at its bound"));
  EXPECT_NE(diagnosis.verdict, Verdict::kAdequate);
}

TEST(Diagnose, DoubtsAFitThatTheDataDoesNotDetermine) {
  DiagnosisProblem problem = ProblemOf({"pendulum2_planar", {}, {}});
  problem.free = FreeFrom(
      problem.model,
      {{"link1.length", 0.5}, {"link1.mass", 1.0}, {"link2.mass", 1.0}});
  const Diagnosis diagnosis = Diagnosed(problem, false);
  SCOPED_TRACE(Print(diagnosis));
  EXPECT_THAT(diagnosis.doubts,
              ElementsAre("link1.mass, link2.mass are not separately "
                          "identifiable from this data"));
  EXPECT_EQ(diagnosis.verdict, Verdict::kAdequate);
}

// What was weighed is not moved, though a change of it would explain it all.
TEST(Diagnose, NeverMovesWhatIsKnown) {
  DiagnosisProblem problem =
      ProblemOf({"pendulum2_planar", {}, {{"link2.mass", 1.3}}});
  problem.known = {"link1.mass", "link2.mass"};
  const Diagnosis diagnosis = Diagnosed(problem);
  SCOPED_TRACE(Print(diagnosis));
  EXPECT_EQ(Find(diagnosis, "mass@link2"), nullptr);
  EXPECT_EQ(Find(diagnosis, "mass@link1"), nullptr);
  for (const DiagnosisStep& step : diagnosis.steps) {
    for (const ParameterEstimate& p : step.parameters) {
      EXPECT_EQ(problem.known.count(p.name), 0u) << p.name;
    }
  }
  for (const ParameterEstimate& p : diagnosis.last().fit.parameters) {
    EXPECT_EQ(problem.known.count(p.name), 0u) << p.name;
  }
}

// Everything known but what is missing.
TEST(Diagnose, NeedsNoFreeParameters) {
  DiagnosisProblem problem = ProblemOf({"pendulum2_planar",
                                        {"viscous_damping@joint1"},
                                        {{"joint1.damping", 0.05}}});
  problem.free.clear();
  const Diagnosis diagnosis = Diagnosed(problem);
  SCOPED_TRACE(Print(diagnosis));
  EXPECT_EQ(diagnosis.verdict, Verdict::kMissingEffect);
  EXPECT_THAT(diagnosis.added(), ElementsAre("viscous_damping@joint1"));
  ASSERT_EQ(diagnosis.last().fit.parameters.size(), 1u);
  EXPECT_LT(std::abs(Deviation(diagnosis.last().fit, {"joint1.damping", 0.05})),
            4.0);
}

}  // namespace
}  // namespace sysid
