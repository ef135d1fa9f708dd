#include "tests/acceptance/hidden/outcome.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "sysid/diagnosis/diagnose.h"
#include "sysid/diagnosis/effect_search.h"
#include "sysid/session/diagnosis_session.h"

namespace sysid {
namespace {

EstimationOptions Options() {
  EstimationOptions options;  // everything from the data, as a user has it
  options.threads = 1;        // the cases run beside each other
  return options;
}

// All of a case: it has no other threads.
double CpuSecondsOfThread() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return now.tv_sec + 1e-9 * now.tv_nsec;
}

// From errors over the noise that was estimated to those over the planted.
double Scale(const HiddenData& data, double estimated_noise) {
  return estimated_noise / data.info.noise;
}

Fit FitCase(const HiddenData& data, const Model& model,
            const std::vector<FreeParameter>& free) {
  ShootingProblem problem(model, free, data.train, Options());
  return FitIndependentSegments(problem);
}

// The plain model with these of the planted effects, fitted from the truth.
Fit FitWith(const HiddenData& data, const std::vector<PlantedEffect>& effects) {
  // What is wrong of bodies stays at the truth; parameters of effects are
  // free, but for those that no solver moves.
  const Model model = WithEffects(data.truth, effects);
  std::vector<FreeParameter> free = data.mechanism.free;
  for (FreeParameter& f : free) {
    f.parameter = FindParameters(model, {f.parameter.name}, "test").front();
    f.initial = f.parameter.nominal;
  }
  for (const EffectParameter& p : model.effects().parameters()) {
    if (p.whole) continue;
    FreeParameter f;
    f.parameter = FindParameters(model, {p.name}, "test").front();
    f.initial = f.parameter.nominal;
    f.lower = f.parameter.lower;
    f.upper = f.parameter.upper;
    free.push_back(f);
  }
  return FitCase(data, model, free);
}

Outcome OutcomeOf(const HiddenData& data, const Diagnosis& diagnosis) {
  Outcome outcome;
  const double scale = Scale(data, diagnosis.base.fit.noise);
  outcome.verdict = ToString(diagnosis.verdict);
  for (const CandidateEffect& candidate : diagnosis.candidates) {
    outcome.ranked.push_back(
        {candidate.screened.name(), candidate.indistinguishable_from});
  }
  const std::vector<std::string> kept = diagnosis.added();
  for (const DiagnosisStep& step : diagnosis.steps) {
    for (size_t k = 0; k < step.effects.size(); ++k) {
      const std::string& name = step.effects[k];
      // Those that were not taken out again.
      if (std::find(kept.begin(), kept.end(), name) == kept.end()) continue;
      Outcome::Step added;
      added.added = {name, step.indistinguishable_from[k]};
      added.train_before = scale * step.train_before;
      added.train_after = scale * step.train_after;
      added.holdout_before = scale * step.holdout_before;
      added.holdout_after = scale * step.holdout_after;
      added.predicted_after = scale * step.predicted;
      outcome.added.push_back(added);
    }
  }
  for (const ParameterByStrata& one : diagnosis.stand_ins) {
    outcome.stand_ins.push_back(one.effect);
  }
  outcome.train_before = scale * diagnosis.base.train_error();
  outcome.holdout_before = scale * diagnosis.base.holdout_error();
  outcome.train_after = scale * diagnosis.last().train_error();
  outcome.holdout_after = scale * diagnosis.last().holdout_error();
  return outcome;
}

DiagnosisProblem ProblemOf(const HiddenData& data, Way way) {
  DiagnosisProblem problem(data.mechanism.plain);
  problem.free = data.mechanism.free;
  problem.options = Options();
  std::vector<sysid::Run> runs = data.train;
  runs.push_back(data.holdout);
  if (way == Way::kPerturbed) Perturb(&runs);
  const sysid::Run holdout = runs.back();
  runs.pop_back();
  problem.SetRuns(runs, {holdout});
  return problem;
}

// What another way finds.
void Search(const HiddenData& data, Candidates candidates, Way way,
            Outcome* outcome) {
  std::vector<std::string> planted;
  for (const PlantedEffect& effect : data.planted) {
    planted.push_back(effect.name);
  }
  const std::vector<int> start =
      BeginOn(way, data.info.seed, planted, &candidates);
  const DiagnosisProblem problem = ProblemOf(data, way);
  EffectSearch search(problem, candidates, [](const std::string&, double) {});
  const EffectSearch::Answer answer = search.Run(start);
  outcome->train_before = Scale(data, answer.base->model.fit.noise) *
                          answer.base->model.train_error();
  outcome->verdict = answer.explains ? "explained" : "unexplained";
  for (const int e : answer.order) {
    Outcome::Step step;
    step.added.name = candidates[e]->name();
    outcome->added.push_back(step);
  }
}

}  // namespace

double ErrorWith(const HiddenData& data,
                 const std::vector<PlantedEffect>& effects) {
  const Fit fit = FitWith(data, effects);
  return fit.train.total.normalized_rms * Scale(data, fit.noise);
}

Outcome DiagnoseCase(const HiddenData& data, bool withheld, Way way) {
  const double start = CpuSecondsOfThread();
  const Catalogue catalogue;
  Session session(data.mechanism.plain);
  session.runs = data.train;
  session.holdout = {data.holdout};
  Candidates candidates = ChooseCandidates(catalogue, session, {}, "test");
  for (const PlantedEffect& effect : data.planted) {
    const std::string kind = effect.kind();
    std::erase_if(candidates,
                  [&](const auto& one) { return one->kind() == kind; });
    if (withheld) continue;
    // On every target: a drive's also where no effort acts.
    for (const auto& one :
         ChooseCandidates(catalogue, session, {kind}, "test")) {
      candidates.push_back(one);
    }
  }
  Outcome outcome;
  if (way == Way::kGiven) {
    DiagnosisOptions options;
    options.add = true;
    outcome =
        OutcomeOf(data, Diagnose(ProblemOf(data, way), candidates, options));
  } else {
    Search(data, candidates, way, &outcome);
  }
  outcome.seconds = CpuSecondsOfThread() - start;
  return outcome;
}

Outcome AskOracle(const HiddenData& data) {
  const auto start = std::chrono::steady_clock::now();
  Outcome outcome;
  const Fit before = FitCase(data, data.mechanism.plain, data.mechanism.free);
  outcome.train_before =
      before.train.total.normalized_rms * Scale(data, before.noise);
  if (!before.converged) outcome.fault = "plain: " + before.termination;
  outcome.verdict = data.planted.empty() ? "adequate" : "missing_effect";
  outcome.train_after = outcome.train_before;
  if (!data.planted.empty()) {
    const Fit after = FitWith(data, data.planted);
    outcome.train_after =
        after.train.total.normalized_rms * Scale(data, after.noise);
    if (!after.converged) outcome.fault += " full: " + after.termination;
    for (const PlantedEffect& effect : data.planted) {
      outcome.ranked.push_back({effect.name, {}});
      Outcome::Step step;
      step.added.name = effect.name;
      step.train_before = outcome.train_before;
      step.train_after = step.predicted_after = outcome.train_after;
      outcome.added.push_back(step);
    }
  }
  outcome.holdout_before = outcome.holdout_after = std::nan("");
  outcome.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start)
          .count();
  return outcome;
}

}  // namespace sysid
