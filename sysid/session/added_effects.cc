#include "sysid/session/added_effects.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <vector>

#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/table_range.h"

namespace sysid {
namespace {

// The model without some of its effects.
Model Without(const Model& model, const std::vector<std::string>& names) {
  Model without(model.mechanism());
  MechanismParameters<double> nominal = model.nominal();
  nominal.effects.clear();
  for (int i = 0; i < model.effects().size(); ++i) {
    const auto& effect = model.effects().shared(i);
    if (std::find(names.begin(), names.end(), effect->name()) != names.end()) {
      continue;
    }
    without.AddEffect(effect, effect->name());
    const int first = model.effects().offset(i);
    for (size_t k = 0; k < effect->parameters().size(); ++k) {
      nominal.effects.push_back(model.nominal().effects[first + k]);
    }
  }
  without.SetNominal(nominal);
  return without;
}

// The errors of a model without the effects of a session, and with them, each
// at the values of the equations of motion and over segments of kFirstLength
// from states of the data: a fit without that many would be far off, and long.
std::optional<AddedEffects> TryByEquations(
    const DiagnosisProblem& without, const Session& session,
    const std::vector<std::string>& tried) {
  const auto error = [](const ShootingProblem& problem) {
    return EvaluateErrors(problem, ShortSegments(problem), 0.0)
        .total.normalized_rms;
  };
  const auto start = [&](const Model& model,
                         const std::vector<FreeParameter>& free) {
    return StartByInverseDynamics(
        ShootingProblem(model, free, without.train, without.options));
  };
  const ShootingProblem before = start(without.model, without.free);
  const ShootingProblem after = start(session.model, session.free);
  AddedEffects result;
  result.effects = tried;
  result.train_before = error(before);
  result.train_after = error(after);
  if (!std::isfinite(result.train_before) ||
      !std::isfinite(result.train_after)) {
    return std::nullopt;
  }
  if (without.holdout != nullptr) {
    result.holdout_before = error(before.WithData(without.holdout));
    result.holdout_after = error(after.WithData(without.holdout));
  }
  Eigen::VectorXd values(after.map().size());
  after.map().ValuesOf<double>(after.InitialTheta().data(), values.data());
  for (int i = 0; i < values.size(); ++i) {
    const std::string& name = after.free()[i].parameter.name;
    if (session.freed_by_added.count(name) > 0) result.found[name] = values[i];
  }
  return result;
}

// Where a refit starts: part of the way to what is expected, where the
// screening knows that at all.
double StartOf(const Effect& effect, const ExpectedParameter& expected,
               double part) {
  constexpr double kKnown = 2.0;  // standard errors
  if (expected.searched) return expected.value;
  for (const EffectParameter& own : effect.parameters()) {
    // Part of the way the law would still be off.
    if (own.name == expected.name && own.start) return expected.value;
  }
  double change = expected.value - expected.null_value;
  if (std::abs(change) < kKnown * expected.std_error) {
    for (const EffectParameter& own : effect.parameters()) {
      if (own.name != expected.name) continue;
      change = std::clamp(change, -own.typical_scale, own.typical_scale);
    }
  }
  return expected.null_value + part * change;
}

// The squares of a start that is no overshoot: it gains half of what the
// screening promises of one of the effects. (Of a cost that is quadratic along
// the step, with its minimum at s of it, the whole step gains 2 - 1/s of the
// promise and 0.3 of it gains 0.6 - 0.09/s: more, where the whole step gains
// less than 0.46.)
double EnoughOf(const std::vector<ScreenedEffect>& effects,
                const EvaluatedModel& before) {
  constexpr double kOfPromise = 0.5;
  double promised = before.train_error();
  for (const ScreenedEffect& effect : effects) {
    promised = std::min(promised, effect.predicted_error);
  }
  const double left = std::pow(promised / before.train_error(), 2);
  return (1.0 - kOfPromise * (1.0 - left)) * before.fit.train.squares;
}

// `before` with further effects, fitted from where the screening expects them,
// or less far: its first order may overshoot.
EvaluatedModel FitWith(const DiagnosisProblem& problem,
                       const EvaluatedModel& before,
                       const std::vector<ScreenedEffect>& effects) {
  std::map<std::string, double> from = ValuesOf(before);
  if (IsDoubtful(before.fit)) {
    // What a model made of its parameters for want of an effect may be far from
    // where this one wants them: from where they started.
    for (const FreeParameter& free : problem.free) {
      from.erase(free.parameter.name);
    }
  }
  std::vector<std::map<std::string, double>> starts;
  std::vector<std::shared_ptr<const Effect>> added;
  std::set<std::string> without_influence;
  for (const double part : {1.0, 0.3, 0.0}) {
    starts.push_back(from);
    for (const ScreenedEffect& effect : effects) {
      for (const ExpectedParameter& expected : effect.parameters) {
        starts.back()[expected.name] = StartOf(*effect.effect, expected, part);
      }
    }
  }
  for (const ScreenedEffect& effect : effects) {
    added.push_back(effect.effect);
    without_influence.insert(effect.without_influence.begin(),
                             effect.without_influence.end());
  }
  return EvaluateFrom(problem, before, std::move(added),
                      std::move(without_influence), starts,
                      EnoughOf(effects, before), problem.options);
}

}  // namespace

std::optional<AddedEffects> TryAddedEffects(const Catalogue& catalogue,
                                            const Session& session) {
  std::vector<std::shared_ptr<const Effect>> added;
  std::vector<std::string> tried;
  for (const std::string& name : session.added) {
    const auto effect =
        catalogue.Make(name, session.model.mechanism(), "--add");
    const std::vector<EffectParameter>& own = effect->parameters();
    const auto is_fixed = [&](const EffectParameter& p) {
      return std::find(session.fixed.begin(), session.fixed.end(), p.name) !=
             session.fixed.end();
    };
    // One that is held as it is has nothing to try.
    if (!own.empty() && std::all_of(own.begin(), own.end(), is_fixed)) continue;
    if (std::any_of(own.begin(), own.end(), [&](const EffectParameter& p) {
          return p.whole && is_fixed(p);
        })) {
      return std::nullopt;
    }
    // It starts at none, over the range of the runs (table_range.h).
    if (IsForceTable(*effect)) return std::nullopt;
    added.push_back(effect);
    tried.push_back(name);
  }
  if (added.empty()) return std::nullopt;
  DiagnosisProblem problem(Without(session.model, tried));
  std::map<std::string, Parameter> plain;
  for (const Parameter& p : AllParameters(problem.model)) plain[p.name] = p;
  for (const FreeParameter& free : session.free) {
    const auto at = plain.find(free.parameter.name);
    if (session.freed_by_added.count(free.parameter.name) > 0 ||
        at == plain.end()) {
      continue;
    }
    problem.free.push_back(free);
    problem.free.back().parameter = at->second;
  }
  problem.options = session.options;
  problem.known = {session.fixed.begin(), session.fixed.end()};
  problem.SetRuns(session.runs, session.holdout);
  ThinForSearch(&problem);
  if (added.size() > size_t{kMostEffectsBySegments}) {
    return TryByEquations(problem, session, tried);
  }
  const EvaluatedModel before = EvaluateGiven(problem);
  const LinearizedFit linearized(*before.problem, before.fit.point);
  if (!linearized.Valid()) return std::nullopt;
  const Screening screening =
      ScreenEffects(linearized, before.fit.model, added, problem.known);
  const std::vector<ScreenedEffect>& screened = screening.effects;
  if (screened.empty()) return std::nullopt;
  const EvaluatedModel after = FitWith(problem, before, screened);
  if (!std::isfinite(after.train_error())) return std::nullopt;
  AddedEffects result;
  result.effects = tried;
  for (const ParameterEstimate& p : after.fit.parameters) {
    if (session.freed_by_added.count(p.name) > 0) {
      result.found[p.name] = p.value;
    }
  }
  const EffectSet& found = after.fit.model.effects();
  for (size_t i = 0; i < found.parameters().size(); ++i) {
    if (!found.parameters()[i].whole) continue;
    result.found[found.parameters()[i].name] =
        after.fit.model.nominal().effects[i];
  }
  if (screened.size() == 1) result.predicted = screened[0].predicted_error;
  result.train_before = before.train_error();
  result.train_after = after.train_error();
  result.holdout_before = before.holdout_error();
  result.holdout_after = after.holdout_error();
  return result;
}

namespace {

// Parameters of effects that have a start of their own, which is better than
// what a trial found that gained nothing.
std::set<std::string> KeepStart(const AddedEffects& added,
                                const EffectSet& effects) {
  std::set<std::string> names;
  if (added.train_after < added.train_before) return names;
  for (int i = 0; i < effects.size(); ++i) {
    const std::vector<EffectParameter>& own = effects.effect(i).parameters();
    if (std::any_of(own.begin(), own.end(), [](const EffectParameter& p) {
          return p.start.has_value();
        })) {
      for (const EffectParameter& p : own) names.insert(p.name);
    }
  }
  return names;
}

}  // namespace

Session StartedFrom(const AddedEffects& added, Session session) {
  const std::set<std::string> kept = KeepStart(added, session.model.effects());
  for (FreeParameter& free : session.free) {
    if (kept.contains(free.parameter.name)) continue;
    const auto at = added.found.find(free.parameter.name);
    bool given = free.initial != free.parameter.nominal;
    if (given && free.parameter.kind == ParameterKind::kEffect) {
      // Or by the effect, for want of better.
      const EffectParameter& own =
          session.model.effects().parameters()[free.parameter.index];
      given = own.start != free.initial;
    }
    if (at == added.found.end() || given) continue;
    free.initial = std::clamp(at->second, free.lower, free.upper);
  }
  for (const EffectParameter& parameter :
       session.model.effects().parameters()) {
    const auto at = added.found.find(parameter.name);
    if (!parameter.whole || at == added.found.end()) continue;
    session.model.SetEffectParameter(parameter.name, at->second);
  }
  return session;
}

}  // namespace sysid
