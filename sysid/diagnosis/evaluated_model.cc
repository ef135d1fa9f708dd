#include "sysid/diagnosis/evaluated_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/state_weights.h"
#include "sysid/estimation/step_size.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

// The values of parameters of effects that the fit did not move, by name.
std::map<std::string, double> HeldValues(const EvaluatedModel& evaluated) {
  std::map<std::string, double> values;
  const Model& model = evaluated.fit.model;
  for (size_t i = 0; i < model.effects().parameters().size(); ++i) {
    values[model.effects().parameters()[i].name] = model.nominal().effects[i];
  }
  for (const ParameterEstimate& p : evaluated.fit.parameters) {
    values.erase(p.name);
  }
  return values;
}

// The theta of the problem with `values` instead of its starting ones; false
// where that is no possible body.
bool ThetaAt(const ShootingProblem& problem,
             const std::map<std::string, double>& values,
             Eigen::VectorXd* theta) {
  Eigen::VectorXd numbers(problem.free().size());
  for (int i = 0; i < numbers.size(); ++i) {
    const FreeParameter& free = problem.free()[i];
    const auto at = values.find(free.parameter.name);
    numbers[i] = at == values.end()
                     ? free.initial
                     : std::clamp(at->second, free.lower, free.upper);
  }
  return problem.map().ThetaOf(numbers, theta) &&
         problem.map().FirstImpossibleLink(theta->data()).empty();
}

Holdout OpenHoldoutOf(const DiagnosisProblem& problem,
                      const EvaluatedModel& evaluated) {
  return OpenHoldout(evaluated.fit.model, problem.holdout,
                     evaluated.problem->options(), evaluated.fit.point.rollout,
                     evaluated.fit.segment_s);
}

void Keep(Holdout holdout, EvaluatedModel* evaluated) {
  evaluated->holdout = std::move(holdout.errors);
  evaluated->holdout_point = std::move(holdout.point);
}

void SetCrossValidation(const DiagnosisProblem& problem,
                        EvaluatedModel* evaluated) {
  evaluated->cv = {};
  const ShootingProblem& posed = *evaluated->problem;
  // What ended at a bound stays there without a stretch too: beyond, it would
  // predict what no model of this kind can.
  std::map<std::string, double> at_bounds;
  for (const ParameterEstimate& p : evaluated->fit.parameters) {
    if (p.at_bound) at_bounds[p.name] = p.value;
  }
  const LinearizedFit linearized(posed, evaluated->fit.point, at_bounds);
  if (!linearized.Valid()) return;
  if (problem.holdout != nullptr &&
      !std::isfinite(evaluated->holdout_error())) {
    return;
  }
  evaluated->cv = CrossValidate(linearized);
  if (problem.holdout == nullptr) return;
  AddHeldOut(*problem.holdout, evaluated->holdout, ObservedStateDof(posed),
             &evaluated->cv);
}

// The held-out runs' states start from those of `before`, where there is one.
void Evaluate(const DiagnosisProblem& problem, const EvaluatedModel* before,
              EvaluatedModel* evaluated) {
  // Where the fitted runs are predicted so much better the start was bad; near
  // the noise, where little decides, a little is much.
  constexpr double kFar = 2.0, kFarDoubt = 1.5, kNearDoubt = 1.1;
  const auto judge = [&](const Solution* start) {
    Keep(EvaluateHoldout(OpenHoldoutOf(problem, *evaluated), start), evaluated);
  };
  if (problem.holdout != nullptr) {
    const double train = evaluated->train_error();
    const bool warm = before != nullptr &&
                      before->fit.segment_s == evaluated->fit.segment_s &&
                      !before->holdout_point.runs.empty();
    if (warm) {
      const Solution start = AdoptStates(
          before->fit.model, before->holdout_point, evaluated->fit.model);
      judge(&start);
    }
    const double doubt = train > kFar ? kFarDoubt : kNearDoubt;
    if (!warm || !(evaluated->holdout_error() < doubt * std::max(1.0, train))) {
      judge(nullptr);
    }
  }
  SetCrossValidation(problem, evaluated);
}

std::shared_ptr<const ShootingProblem> Pose(const DiagnosisProblem& problem,
                                            const EstimationOptions& options) {
  return std::make_shared<const ShootingProblem>(problem.model, problem.free,
                                                 problem.train, options);
}

// A model as it was, from where it ended.
EvaluatedModel OpenAgain(const DiagnosisProblem& problem,
                         const EvaluatedModel& before) {
  return OpenModel(problem, before.added, before.without_influence,
                   ValuesOf(before),
                   Coarse(problem.options, before.train_error()));
}

// A law that is so much stiffer than the model before, and would take as much
// longer, is not followed; nor is a motion that needs such steps over longer
// segments alone, which is chaos.
constexpr double kStiffer = 16.0;
constexpr double kFiner = 4.0;

void Limit(int most_iterations, double shortest_step,
           EvaluatedModel* evaluated) {
  EstimationOptions options = evaluated->problem->options();
  options.max_iterations = std::min(options.max_iterations, most_iterations);
  options.shortest_step = shortest_step;
  evaluated->problem = std::make_shared<const ShootingProblem>(
      evaluated->problem->With(options));
}

// The options for a model of which no more than the states will be fitted,
// which come no nearer to the data than those from the data.
EstimationOptions CoarseAtStart(const DiagnosisProblem& problem) {
  const auto posed = Pose(problem, problem.options);
  return Coarse(
      problem.options,
      EvaluateErrors(*posed, ShortSegments(*posed), 0.0).total.normalized_rms);
}

void FitFrom(Solution start, EvaluatedModel* evaluated) {
  start.rollout = evaluated->problem->options().rollout;
  evaluated->fit = RefitIndependentSegments(*evaluated->problem, start);
}

}  // namespace

EstimationOptions Coarse(EstimationOptions options, double error) {
  constexpr double kCoarse = 0.1;
  options.step_error *= std::max(1.0, kCoarse * error);
  return options;
}

EstimationOptions TrialOptions(const EstimationOptions& options, double error) {
  constexpr int kIterations = 25;
  constexpr double kMaterial = 0.01;  // of the error
  EstimationOptions trial = Coarse(options, error);
  trial.progress = nullptr;
  trial.max_iterations = kIterations;
  trial.least_gain = 2.0 * kMaterial;  // the cost is half the error's square
  return trial;
}

bool IsAtNoiseFloor(const EvaluatedModel& evaluated) {
  return evaluated.train_error() < NoiseFloor(evaluated.fit.train.dof) &&
         evaluated.holdout_error() < NoiseFloor(evaluated.holdout.dof);
}

EvaluatedModel OpenModel(const DiagnosisProblem& problem,
                         std::vector<std::shared_ptr<const Effect>> effects,
                         std::set<std::string> without_influence,
                         const std::map<std::string, double>& values,
                         const EstimationOptions& options) {
  const DiagnosisProblem with =
      WithEffects(problem, effects, without_influence, values);
  EvaluatedModel opened(with.model);
  opened.added = std::move(effects);
  opened.without_influence = std::move(without_influence);
  opened.problem = Pose(with, options);
  return opened;
}

EvaluatedModel OpenAtExpected(const DiagnosisProblem& problem,
                              const std::vector<ScreenedEffect>& effects,
                              const EstimationOptions& options) {
  std::vector<std::shared_ptr<const Effect>> added;
  std::set<std::string> without_influence;
  std::map<std::string, double> values;
  for (const ScreenedEffect& effect : effects) {
    added.push_back(effect.effect);
    without_influence.insert(effect.without_influence.begin(),
                             effect.without_influence.end());
    for (const ExpectedParameter& expected : effect.parameters) {
      values[expected.name] = expected.value;
    }
  }
  return OpenModel(problem, std::move(added), std::move(without_influence),
                   values, options);
}

EvaluatedModel EvaluateFrom(
    const DiagnosisProblem& problem, const EvaluatedModel& before,
    std::vector<std::shared_ptr<const Effect>> effects,
    std::set<std::string> without_influence,
    const std::vector<std::map<std::string, double>>& starts, double enough,
    const EstimationOptions& options) {
  EstimationOptions limited = options;
  if (options.rollout.step <= 0) {
    limited.shortest_step = before.fit.point.rollout.step / kStiffer;
  }
  EvaluatedModel after =
      OpenModel(problem, std::move(effects), std::move(without_influence),
                starts.front(), limited);
  const Solution from =
      AdoptStates(before.fit.model, before.fit.point, after.problem->model());
  Solution best;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& values : starts) {
    Solution start = from;
    if (!ThetaAt(*after.problem, values, &start.theta)) continue;
    if (options.rollout.step <= 0) {
      // Each with a step that can follow it.
      start.rollout = ChooseRollout(*after.problem, start, kStableError);
    }
    // The states first: they were those of the model before.
    start = SolveStates(
        *after.problem, std::move(start),
        {.twist_hold = kHeldSpin, .max_iterations = 5, .tolerance = 1e-3});
    const double squares = EvaluateErrors(*after.problem, start, 0.0).squares;
    if (best.runs.empty() || squares < least) {
      least = squares;
      best = std::move(start);
    }
    if (least < enough) break;
  }
  if (best.runs.empty()) {
    best = from;
    best.theta = after.problem->InitialTheta();
  }
  // Steps as short as the error needs that is left: those of the model before
  // would follow a motion that misses the data by far.
  const auto with_steps_for = [&](double error) {
    EstimationOptions own = after.problem->options();
    own.step_error = options.step_error;
    if (std::isfinite(error)) {
      own.step_error =
          std::max(own.step_error, Coarse(problem.options, error).step_error);
    }
    return own;
  };
  const auto fit_with = [&](EstimationOptions own, Solution start) {
    after.problem =
        std::make_shared<const ShootingProblem>(after.problem->With(own));
    FitFrom(std::move(start), &after);
  };
  const EstimationOptions first = with_steps_for(
      EvaluateErrors(*after.problem, best, 0.0).total.normalized_rms);
  fit_with(first, std::move(best));
  const EstimationOptions then = with_steps_for(after.train_error());
  if (then.step_error < 0.5 * first.step_error) fit_with(then, after.fit.point);
  if (IsDoubtful(before.fit) &&
      (HasBound(after.fit) || after.train_error() > before.train_error())) {
    // By segments that grow, then.
    EstimationOptions alike = limited;
    alike.segment = before.fit.segment_s;
    const auto staged =
        Pose(WithEffects(problem, after.added, after.without_influence,
                         HeldValues(after)),
             alike);
    Fit fit = FitIndependentSegments(*staged);
    if (fit.train.squares < after.fit.train.squares) {
      after.problem = staged;
      after.fit = std::move(fit);
    }
  }
  Evaluate(problem, &before, &after);
  return after;
}

std::map<std::string, double> ValuesOf(const EvaluatedModel& evaluated) {
  std::map<std::string, double> values = HeldValues(evaluated);
  for (const ParameterEstimate& p : evaluated.fit.parameters) {
    values[p.name] = p.value;
  }
  return values;
}

EvaluatedModel EvaluateGiven(const DiagnosisProblem& problem) {
  const bool states_only = problem.free.empty();
  EvaluatedModel base =
      OpenModel(problem, {}, {}, {},
                states_only ? CoarseAtStart(problem) : problem.options);
  base.fit = FitIndependentSegments(StartByInverseDynamics(*base.problem),
                                    problem.LongestToJudge());
  if (base.fit.converged && !states_only) {
    // Once more, as every other model will be: a refit holds the spins that no
    // sensor sees to where the last fit left them.
    std::vector<HistoryEntry> history = std::move(base.fit.history);
    FitFrom(base.fit.point, &base);
    base.fit.history = std::move(history);
  }
  Evaluate(problem, nullptr, &base);
  return base;
}

EvaluatedModel EvaluateByEquations(const DiagnosisProblem& problem,
                                   const EvaluatedModel& before,
                                   const std::vector<ScreenedEffect>& effects) {
  EvaluatedModel after = OpenAtExpected(
      problem, effects, Coarse(problem.options, before.train_error()));
  after.fit = StatesAtStart(
      StartByInverseDynamics(*after.problem),
      AdoptStates(before.fit.model, before.fit.point, after.problem->model()));
  Evaluate(problem, &before, &after);
  return after;
}

std::optional<EvaluatedModel> EvaluateLonger(const DiagnosisProblem& problem,
                                             const EvaluatedModel& before,
                                             double segment_s,
                                             int most_iterations,
                                             double worst) {
  EvaluatedModel after = OpenAgain(problem, before);
  Limit(most_iterations,
        problem.options.rollout.step > 0
            ? 0.0
            : before.fit.point.rollout.step / kFiner,
        &after);
  // Rolled out to the new cuts with the step that served before.
  FitFrom(Recut(*after.problem, before.fit.point, segment_s), &after);
  if (!after.fit.converged || !(after.train_error() <= worst)) {
    return std::nullopt;
  }
  Evaluate(problem, nullptr, &after);
  return after;
}

bool HasBlindStates(const EvaluatedModel& evaluated) {
  const ShootingProblem& problem = *evaluated.problem;
  return ObservedStateDof(problem) < problem.model().tangent_size();
}

EvaluatedModel EvaluateJoined(const DiagnosisProblem& problem,
                              const EvaluatedModel& before) {
  constexpr int kMostJoined = 100;
  EvaluatedModel after = OpenAgain(problem, before);
  EstimationOptions quiet = after.problem->options();
  quiet.progress = nullptr;
  // What takes longer is chaos, or another minimum.
  quiet.max_iterations = std::min(quiet.max_iterations, kMostJoined);
  const Fit joined = FitLevenbergMarquardt(after.problem->With(quiet));
  Solution start = Recut(*after.problem, joined.point, before.fit.segment_s);
  after.fit = RefitIndependentSegments(*after.problem, start);
  if (problem.holdout != nullptr) {
    Keep(EvaluateJoinedHoldout(OpenHoldoutOf(problem, after)), &after);
  }
  SetCrossValidation(problem, &after);
  return after;
}

EvaluatedModel EvaluateAgain(const DiagnosisProblem& problem,
                             EvaluatedModel evaluated) {
  evaluated.problem =
      std::make_shared<const ShootingProblem>(evaluated.problem->With(
          Coarse(problem.options, evaluated.train_error())));
  FitFrom(evaluated.fit.point, &evaluated);
  Evaluate(problem, &evaluated, &evaluated);
  return evaluated;
}

EvaluatedModel EvaluateOver(const DiagnosisProblem& problem,
                            const EvaluatedModel& evaluated,
                            const EvaluatedModel& segments) {
  EvaluatedModel over = OpenAgain(problem, evaluated);
  // What it does not follow so far is large, whatever the states, and with the
  // step that served before.
  Limit(kMostIterationsToFollow, evaluated.fit.point.rollout.step, &over);
  Solution cut = AdoptStates(segments.fit.model, segments.fit.point,
                             over.problem->model());
  cut.rollout = evaluated.fit.point.rollout;
  over.fit = StatesAtStart(*over.problem, cut);
  Evaluate(problem, nullptr, &over);
  return over;
}

void ExtendProblem(const DiagnosisProblem& problem,
                   const EvaluatedModel& evaluated, Model* model,
                   std::vector<FreeParameter>* free) {
  DiagnosisProblem with =
      WithEffects(problem, evaluated.added, evaluated.without_influence,
                  ValuesOf(evaluated));
  *model = with.model;
  *free = std::move(with.free);
}

}  // namespace sysid
