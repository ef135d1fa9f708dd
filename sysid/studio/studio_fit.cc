#include <cmath>

#include "models/error.h"
#include "sysid/diagnosis/diagnose.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/clock.h"
#include "sysid/io/csv.h"
#include "sysid/linearization/linearized_fit.h"
#include "sysid/linearization/screening.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/studio/studio_model.h"

namespace sysid {
namespace {

using Effects = std::vector<std::shared_ptr<const Effect>>;

// What a change makes of the model as given.
struct Changed {
  Effects effects;
  StudioModel::Start start;
};

StudioModel::Start StartOf(const ScreenedEffect& screened) {
  StudioModel::Start start;
  for (const ExpectedParameter& p : screened.parameters) {
    if (std::isfinite(p.value)) start.values[p.name] = p.value;
  }
  start.without_influence.insert(screened.without_influence.begin(),
                                 screened.without_influence.end());
  return start;
}

StudioModel::Start StartOf(const CandidateEffect& candidate) {
  StudioModel::Start start = StartOf(candidate.screened);
  if (candidate.confirmed) {
    for (const ParameterEstimate& p : candidate.confirmed->parameters) {
      if (std::isfinite(p.value)) start.values[p.name] = p.value;
    }
  }
  return start;
}

// The problem of a changed model. A fit of it reports to `progress`.
DiagnosisProblem ProblemOf(
    const StudioSetup& setup, const Changed& changed,
    const std::stop_token& stop,
    const std::function<void(const Progress&)>& progress) {
  DiagnosisProblem problem =
      WithEffects(setup.problem, changed.effects,
                  changed.start.without_influence, changed.start.values);
  problem.options.stop = stop;
  problem.options.progress = progress;
  return problem;
}

// Where an effect starts that was no candidate of the model that it is added
// to, a law that a user typed among them: where the screening of that model, as
// it was fitted, expects it.
StudioModel::Start Screen(const DiagnosisProblem& before,
                          const std::shared_ptr<const Effect>& effect) {
  const EvaluatedModel evaluated = EvaluateGiven(before);
  const LinearizedFit linearized(*evaluated.problem, evaluated.fit.point);
  if (linearized.Valid()) {
    const Screening screening =
        ScreenEffects(linearized, evaluated.fit.model, {effect}, before.known);
    if (!screening.effects.empty()) return StartOf(screening.effects[0]);
  }
  throw InputError(
      "effect",
      "the data say nothing of '" + effect->name() + "' in this model",
      "its parameters are known or free already, or it does "
      "nothing in this motion");
}

// The model that is changed, and what is added to it.
Changed Apply(const StudioSetup& setup, const StudioChange& change,
              const std::stop_token& stop,
              const std::function<void(const Progress&)>& progress) {
  Changed changed;
  if (change.from == nullptr) return changed;
  const Catalogue catalogue;
  const Mechanism& mechanism = setup.session.model.mechanism();
  changed.start = change.from->start;
  for (const std::string& name : change.from->effects) {
    const auto effect = catalogue.Make(name, mechanism, "effect");
    if (name != change.remove) {
      changed.effects.push_back(effect);
      continue;
    }
    // What it stood for goes back to what it was.
    for (const std::string& parameter : effect->ParameterNames()) {
      changed.start.values.erase(parameter);
      changed.start.without_influence.erase(parameter);
    }
  }
  const Changed before = changed;
  for (const std::string& name : change.add) {
    const auto effect = catalogue.Make(name, mechanism, "effect");
    const auto known = change.from->candidates.find(name);
    const StudioModel::Start start =
        known != change.from->candidates.end()
            ? known->second
            : Screen(ProblemOf(setup, before, stop, progress), effect);
    changed.effects.push_back(effect);
    for (const auto& [parameter, value] : start.values) {
      changed.start.values[parameter] = value;
    }
    changed.start.without_influence.insert(start.without_influence.begin(),
                                           start.without_influence.end());
  }
  return changed;
}

// What a fit of the changed model holds, as --fix takes it.
std::vector<std::string> Held(const Changed& changed) {
  const StudioModel::Start& start = changed.start;
  std::vector<std::string> held = {start.without_influence.begin(),
                                   start.without_influence.end()};
  for (const auto& effect : changed.effects) {
    for (const EffectParameter& parameter : effect->parameters()) {
      const auto at = start.values.find(parameter.name);
      if (!parameter.whole || at == start.values.end()) continue;
      held.push_back(parameter.name + "=" + ShortestText(at->second));
    }
  }
  return held;
}

// Where a model that comes of this one starts: where it ended. What a fit that
// is in doubt made of its parameters, for want of an effect, may be far from
// where another model wants them: those start where they always did.
StudioModel::Start StartAfter(const StudioSetup& setup, const Fit& fit,
                              const Changed& changed) {
  StudioModel::Start start{{}, changed.start.without_influence};
  const EffectSet& effects = fit.model.effects();
  for (size_t i = 0; i < effects.parameters().size(); ++i) {
    start.values[effects.parameters()[i].name] = fit.model.nominal().effects[i];
  }
  for (const ParameterEstimate& p : fit.parameters) {
    if (std::isfinite(p.value)) start.values[p.name] = p.value;
  }
  if (!IsDoubtful(fit)) return start;
  for (const FreeParameter& free : setup.problem.free) {
    start.values.erase(free.parameter.name);
  }
  return start;
}

Json StepOf(const StudioChange& change, const Diagnosis& diagnosis, int id) {
  if (change.from == nullptr) return nullptr;
  DiagnosisStep step;
  step.effects = change.add;
  step.removed = change.remove;
  step.segment_s = diagnosis.base.fit.segment_s;
  if (change.add.size() == 1) {
    for (const Json& c : change.from->page.at("candidates")) {
      const std::string name = c.at("effect").get<std::string>() + "@" +
                               c.at("target").get<std::string>();
      const Json& predicted = c.at("predictedError");
      if (name == change.add[0] && predicted.is_number()) {
        step.predicted = predicted.get<double>();
      }
    }
  }
  step.train_before = change.from->Error("trainError");
  step.holdout_before = change.from->Error("holdoutError");
  step.train_after = diagnosis.base.train_error();
  step.holdout_after = diagnosis.base.holdout_error();
  return PageStep(step, id, change.from->id);
}

}  // namespace

PageSource SourceOf(const StudioSetup& setup) {
  PageSource source = setup.page;
  source.live = true;
  source.session = &setup.session;
  source.train = setup.problem.train.get();
  source.holdout = setup.problem.holdout.get();
  return source;
}

StudioModel FitStudioModel(
    const StudioSetup& setup, const StudioChange& change, int id,
    const std::stop_token& stop,
    const std::function<void(const Progress&)>& progress) {
  const double start_s = Now(), start_cpu_s = CpuSeconds();
  const Changed changed = Apply(setup, change, stop, progress);
  const DiagnosisProblem problem = ProblemOf(setup, changed, stop, progress);
  Session session = setup.session;
  session.model = problem.model;
  session.free = problem.free;
  session.effects = problem.model.effects().names();
  session.options.stop = stop;
  session.options.progress = progress;
  const Diagnosis diagnosis = Diagnose(problem, setup.candidates, {});
  FinalFit final = FitFinal(session, problem, diagnosis);

  StudioModel model;
  model.id = id;
  model.parent = change.from == nullptr ? -1 : change.from->id;
  for (const auto& effect : changed.effects) {
    // Another may have taken its place.
    if (!problem.model.effects().Contains(effect->name())) continue;
    model.effects.push_back(effect->name());
  }
  model.start = StartAfter(setup, diagnosis.base.fit, changed);
  for (const CandidateEffect& candidate : diagnosis.candidates) {
    model.candidates[candidate.screened.name()] = StartOf(candidate);
  }
  PageSource source = SourceOf(setup);
  source.fit_command = [&](const std::string& add, const std::string& fix) {
    std::vector<std::string> all = model.effects;
    if (!add.empty()) all.push_back(add);
    std::vector<std::string> held = Held(changed);
    if (!fix.empty()) held.push_back(fix);
    return setup.page.fit_command(Join(all, ","), Join(held, ","));
  };
  const ShownModel judged =
      OpenEvaluatedModel(session, problem, diagnosis.base);
  PageFit fit = judged.Show(id, model.effects.empty()
                                    ? "as given"
                                    : "+ " + Join(model.effects, " + "));
  const NextStep next = ChooseNext(session, diagnosis);
  fit.next_command =
      source.fit_command(AddText(next), FixText(next)) + SolverText(next);
  model.page = PageModel(source, fit, &diagnosis);
  model.page["wholeRuns"] = PageWholeRuns(final);
  model.step = StepOf(change, diagnosis, id);
  // All that passed, the search too.
  final.fit.wall_time_s = Now() - start_s;
  final.fit.cpu_time_s = CpuSeconds() - start_cpu_s;
  const PageFit whole = ShowFinal(final, id);
  for (const ModelFile& file : ModelFiles()) {
    model.files[file.name] = ModelFileText(whole, file.name);
  }
  ThrowIfCancelled(stop);
  return model;
}

}  // namespace sysid
