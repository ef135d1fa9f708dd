#include "sysid/session/diagnosis_session.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "models/effects/force_table.h"
#include "models/error.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/diagnosis/search_runs.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "sysid/io/csv.h"
#include "sysid/parameters/patterns.h"
#include "sysid/session/check_runs.h"
#include "sysid/session/effect_inputs.h"
#include "sysid/session/law_values.h"
#include "sysid/session/rest_at_end.h"
#include "sysid/session/table_range.h"
#include "sysid/unexplained_force/discrepancy.h"

namespace sysid {
namespace {

// More samples than this are thinned to this rate, Hz, for the search.
constexpr int kManySamples = 6000;
constexpr double kSearchRate = 100.0;
// The motion must exceed the noise by this to show a law.
constexpr double kLeastMotion = 10.0;

// The largest range of a channel of a run over its noise.
double MotionOverNoise(const RunData& data) {
  double most = 0.0;
  for (size_t c = 0; c < data.sigma.size(); ++c) {
    most = std::max(most, Range(data.run.channels[c]) / data.sigma[c]);
  }
  return most;
}

// That the ends of the runs, which are held out, say something.
void CheckEndsMeasured(const DataSet& ends) {
  for (const auto& data : ends.runs()) {
    for (const Channel& channel : data->run.channels) {
      if (!channel.values.array().isNaN().all()) return;
    }
  }
  if (ends.runs().empty()) return;
  throw InputError("--traj",
                   "nothing was measured in the last quarter of " +
                       ends.runs().front()->run.name +
                       ", which is held out to decide between effects",
                   "cut the file where the measurements end, or hold out "
                   "another run (--holdout)");
}

void CheckDecidable(const DiagnosisProblem& problem,
                    std::vector<std::string>* notices) {
  // Of the shortest segments, each with more numbers than its state.
  const int fewest =
      static_cast<int>(kFewestSegments *
                       MinSegmentSamples(ShootingProblem(
                           problem.model, {}, problem.train, problem.options)));
  int longest = 0;
  for (const auto& data : problem.train->runs()) {
    longest = std::max(longest, data->run.size());
  }
  if (longest < fewest) {
    throw InputError(
        "--traj",
        "too short to decide anything: the longest run has " +
            std::to_string(longest) + " samples to fit, and " +
            std::to_string(fewest) + " are the fewest",
        "record some seconds of motion, and hold out another run (--holdout)");
  }
  double motion = 0.0;
  for (const auto& data : problem.train->runs()) {
    const double moved = MotionOverNoise(*data);
    motion = std::max(motion, moved);
    if (moved > kLeastMotion) continue;
    notices->push_back(data->run.name + " hardly moves: it decides nothing");
  }
  if (!(motion > kLeastMotion)) {
    throw InputError("--traj",
                     "too still to decide anything: the widest motion is " +
                         ShortestText(std::round(motion * 10) / 10) +
                         " times the noise, and " + ShortestText(kLeastMotion) +
                         " times is the least",
                     "record motion that is wide beside the noise");
  }
  if (!problem.judged_by_others) {
    CheckEndsMeasured(*problem.holdout);
    return;
  }
  for (const auto& data : problem.holdout->runs()) {
    const Run& run = data->run;
    if (run.size() < fewest) {
      throw InputError("--holdout",
                       run.name + " is too short to judge by: it has " +
                           std::to_string(run.size()) + " samples, and " +
                           std::to_string(fewest) + " are the fewest",
                       "hold out some seconds of motion, or nothing: then the "
                       "last quarter of every run is");
    }
    if (!(MotionOverNoise(*data) > kLeastMotion)) {
      throw InputError("--holdout",
                       run.name +
                           " is too still to judge by: its widest "
                           "motion is less than " +
                           ShortestText(kLeastMotion) + " times the noise",
                       "hold out motion, or nothing: then the last quarter of "
                       "every run is");
    }
  }
}

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

// Thins many samples for the search; by how much. The noise is that of all
// samples: of fewer it is harder to tell.
int Thin(DiagnosisProblem* problem) {
  if (problem->train->samples() <= kManySamples) return 1;
  const std::shared_ptr<const DataSet> all = problem->train;
  std::vector<Run> train = RunsOf(*all);
  const int n = ThinRuns(kSearchRate, &train);
  problem->train =
      MakeDataSetLike(problem->model, std::move(train), problem->options, *all);
  if (problem->holdout != nullptr) {
    std::vector<Run> holdout = RunsOf(*problem->holdout);
    ThinRuns(kSearchRate, &holdout);
    problem->holdout = MakeDataSetLike(problem->model, std::move(holdout),
                                       problem->options, *all);
  }
  return n;
}

// Whether an effort of the joint, -1: of any, was recorded that ever acts.
bool IsDriven(const Mechanism& mechanism, int joint,
              const std::vector<Run>& runs) {
  return std::any_of(runs.begin(), runs.end(), [&](const Run& run) {
    if (joint < 0) return !run.effort.isZero(0.0);
    const Joint& at = mechanism.joints[joint];
    return !run.effort.middleCols(at.v_index, VelocitySize(at)).isZero(0.0);
  });
}

// What sensors may have that are at motors.
std::vector<std::string> OfMeasuredMotors(const Catalogue& catalogue,
                                          const Session& session) {
  const Mechanism& mechanism = session.model.mechanism();
  std::vector<std::string> all;
  const std::vector<const Run*> runs = AllRunsOf(session);
  for (const Body& body : session.model.movers()) {
    if (!MeasureMotor(runs, body.joint)) continue;
    for (std::string& name : catalogue.NamesOnMotor(mechanism, body.joint)) {
      all.push_back(std::move(name));
    }
  }
  return all;
}

}  // namespace

DiagnosisProblem OpenDiagnosis(const Session& session,
                               std::vector<std::string>* notices) {
  DiagnosisProblem problem(session.model);
  problem.free = session.free;
  problem.options = session.options;
  problem.known = {session.fixed.begin(), session.fixed.end()};
  problem.judged_by_others = !session.holdout.empty();
  std::vector<Run> train = session.runs, holdout = session.holdout;
  LeaveOutRestAtEnd(&train, notices);
  LeaveOutRestAtEnd(&holdout, notices);
  if (!problem.judged_by_others) {
    holdout = HoldOutLastQuarter(&train);
    notices->push_back(
        "no --holdout: the last quarter of every run is held out to judge by");
  }
  problem.SetRuns(std::move(train), std::move(holdout));
  CheckDecidable(problem, notices);
  const int n = Thin(&problem);
  if (n > 1) {
    notices->push_back("the search uses one sample in " + std::to_string(n) +
                       "; the last fit uses all");
  }
  return problem;
}

std::vector<std::shared_ptr<const Effect>> ChooseCandidates(
    const Catalogue& catalogue, const Session& session,
    const std::vector<std::string>& names, const std::string& place) {
  const Mechanism& mechanism = session.model.mechanism();
  const Vocabulary vocabulary = EffectVocabulary(
      catalogue, mechanism, OfMeasuredMotors(catalogue, session));
  const std::vector<std::string> kinds = catalogue.kinds();
  std::vector<Located<std::string>> listed;
  for (const std::string& name : names) {
    const bool targeted = name.find('@') != std::string::npos;
    if (!targeted && name.find_first_of("*?[") == std::string::npos &&
        std::find(kinds.begin(), kinds.end(), name) == kinds.end()) {
      throw InputError(place, "unknown effect '" + name + "'",
                       NameHint(name, kinds));
    }
    listed.push_back({targeted ? name : name + "@*", place});
  }
  if (names.empty()) {
    for (const std::string& name : vocabulary.names) {
      listed.push_back({name, place});
    }
  }
  const std::vector<const Run*> runs = AllRunsOf(session);
  std::vector<std::shared_ptr<const Effect>> candidates;
  for (const Located<std::string>& one :
       ExpandPatterns(listed, &Located<std::string>::value, vocabulary)) {
    candidates.push_back(catalogue.Make(one.value, mechanism, place));
  }
  for (const std::string& name : names) {
    const auto named = std::find_if(
        candidates.begin(), candidates.end(),
        [&](const auto& effect) { return effect->name() == name; });
    if (named == candidates.end()) continue;
    CheckCanRead(**named, runs, place);
    CheckHasValues(**named, mechanism, runs, place);
  }
  for (const std::string& name : names) {
    if (!name.starts_with(ForceTable::kName)) continue;
    throw InputError(place,
                     "'" + name + "' is no candidate: a table explains nothing",
                     "put it into the model: --add " + name);
  }
  std::erase_if(candidates, [&](const auto& effect) {
    if (IsForceTable(*effect)) return true;
    if (!CanRead(*effect, runs)) return true;
    return names.empty() && effect->NeedsDrive() &&
           !IsDriven(mechanism, effect->joint(), session.runs);
  });
  return candidates;
}

namespace {

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
  Thin(&problem);
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
  const EvaluatedModel after =
      EvaluateWith(problem, before, screened, problem.options);
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

FinalFit FitFinal(const Session& session, const DiagnosisProblem& problem,
                  const Diagnosis& diagnosis) {
  Model model = session.model;
  std::vector<FreeParameter> free = session.free;
  ExtendProblem(problem, diagnosis.last(), &model, &free);
  FinalFit final{session, nullptr, Fit(model), std::nullopt};
  final.session.model = model;
  final.session.free = free;
  final.session.effects = model.effects().names();
  final.problem = std::make_shared<const ShootingProblem>(
      model, free, session.runs, session.options);
  if (diagnosis.by_equations) {
    final.fit = FitInverseDynamics(*final.problem);
  } else {
    final.fit = FitLevenbergMarquardtFrom(*final.problem,
                                          diagnosis.last().fit.segment_s);
    AddDiscrepancy(*final.problem, &final.fit);
  }
  if (!session.holdout.empty()) {
    const auto held_out = MakeDataSetLike(
        session.model, session.holdout, session.options, final.problem->data());
    final.holdout = PredictHoldout(
        OpenHoldout(final.fit.model, held_out, final.problem->options(),
                    final.fit.point.rollout, final.fit.segment_s));
  }
  return final;
}

}  // namespace sysid
