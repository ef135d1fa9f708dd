#include "sysid/session/diagnosis_session.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "models/effects/force_table.h"
#include "models/error.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/estimation/run_parts.h"
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

int ThinForSearch(DiagnosisProblem* problem) {
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
  const int n = ThinForSearch(&problem);
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

FinalFit FitFinal(const Session& session, const DiagnosisProblem& problem,
                  const Diagnosis& diagnosis) {
  Model model = session.model;
  std::vector<FreeParameter> free = session.free;
  ExtendProblem(problem, diagnosis.last(), &model, &free);
  FinalFit final{session, nullptr, Fit(model), std::nullopt};
  if (diagnosis.by_equations) {
    AddWhatArmsHave(diagnosis.look, model, &free, &final.session.options);
  }
  final.session.model = model;
  final.session.free = free;
  final.session.effects = model.effects().names();
  final.problem = std::make_shared<const ShootingProblem>(
      model, free, session.runs, final.session.options);
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
