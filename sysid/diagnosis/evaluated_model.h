#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "sysid/diagnosis/cross_validation.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/holdout.h"
#include "sysid/linearization/screening.h"

namespace sysid {

using Candidates = std::vector<std::shared_ptr<const Effect>>;

// What a diagnosis starts from: a model with what is free in it, data to fit
// and data to judge by (null: none). Every model that is tried shares both.
struct DiagnosisProblem {
  Model model;
  std::vector<FreeParameter> free;
  std::shared_ptr<const DataSet> train, holdout;
  // Whether the held-out runs are runs of their own, not the ends of the
  // others.
  bool judged_by_others = true;
  // Names of parameters that are known to be right: no candidate moves them.
  std::set<std::string> known;
  EstimationOptions options;

  explicit DiagnosisProblem(const Model& m) : model(m) {}
  // The data sets of runs; those that are held out have the others' noise.
  void SetRuns(std::vector<Run> train_runs, std::vector<Run> holdout_runs);
  // As long, in s, as segments may be at first to leave enough of them, fitted
  // and held out, to judge models by; and no longer than the longest run.
  double LongestToJudge() const;
};

// A model that was fitted to the training runs, in independent segments, and
// judged by the held-out ones. Errors of both are of prediction over a segment
// from its own state.
struct EvaluatedModel {
  // Beside the effects of the problem's own model, in the order of adding.
  std::vector<std::shared_ptr<const Effect>> added;
  // Parameters of those that the data says nothing of: held where they are.
  std::set<std::string> without_influence;
  std::shared_ptr<const ShootingProblem> problem;
  Fit fit;
  RunErrors holdout;
  Solution holdout_point;  // its states
  // What models are chosen by; no stretches where the dynamics fail.
  CrossValidation cv;

  explicit EvaluatedModel(const Model& m) : fit(m) {}
  double train_error() const { return fit.train.total.normalized_rms; }
  double holdout_error() const { return holdout.total.normalized_rms; }
};

// The problem's model with effects at these values, yet to be fitted.
EvaluatedModel OpenModel(const DiagnosisProblem& problem,
                         std::vector<std::shared_ptr<const Effect>> effects,
                         std::set<std::string> without_influence,
                         const std::map<std::string, double>& values,
                         const EstimationOptions& options);

// The same where a screening expects the effects.
EvaluatedModel OpenAtExpected(const DiagnosisProblem& problem,
                              const std::vector<ScreenedEffect>& effects,
                              const EstimationOptions& options);

// The values of a fit, and of the effects' parameters that it did not move.
std::map<std::string, double> ValuesOf(const EvaluatedModel& evaluated);

// The problem's own model, from its start.
EvaluatedModel EvaluateGiven(const DiagnosisProblem& problem);

// The problem's model with effects, at the values of the equations of motion
// (StartByInverseDynamics): the motion is predicted, not fitted. Its states
// start from those of `before`, the model without them.
EvaluatedModel EvaluateByEquations(const DiagnosisProblem& problem,
                                   const EvaluatedModel& before,
                                   const std::vector<ScreenedEffect>& effects);

// The problem's model with these effects, fitted in the segments of `before`
// from the best of several starts, values by name; the first of them alone if
// it comes down to `enough` squares.
EvaluatedModel EvaluateFrom(
    const DiagnosisProblem& problem, const EvaluatedModel& before,
    std::vector<std::shared_ptr<const Effect>> effects,
    std::set<std::string> without_influence,
    const std::vector<std::map<std::string, double>>& starts, double enough,
    const EstimationOptions& options);

// The options for a model whose error stays at so many times the noise: it
// needs no step as fine as the noise.
EstimationOptions Coarse(EstimationOptions options, double error);

// Of a fit that is to be judged, not kept: it ends after some iterations, or
// where those left would not gain what is worth a refit. `error` is about the
// one that it comes to.
EstimationOptions TrialOptions(const EstimationOptions& options, double error);

// Whether the errors may be noise alone, on both kinds of runs.
bool IsAtNoiseFloor(const EvaluatedModel& evaluated);

// The same model from where it ended, until the fit has converged.
EvaluatedModel EvaluateAgain(const DiagnosisProblem& problem,
                             EvaluatedModel evaluated);

// The same model in longer segments, s, which show what adds up slowly, fitted
// in so many iterations at most. Nothing where that does not converge, or to an
// error above `worst`: its held-out runs are not looked at, which of a motion
// that is not followed takes longest.
std::optional<EvaluatedModel> EvaluateLonger(const DiagnosisProblem& problem,
                                             const EvaluatedModel& before,
                                             double segment_s,
                                             int most_iterations, double worst);

// The same model from one trajectory a run, joined over all segments. Where no
// sensor sees a spin, the states of single segments may each be caught in a
// wrong one, and no effect helps; over a whole run the motion itself tells.
EvaluatedModel EvaluateJoined(const DiagnosisProblem& problem,
                              const EvaluatedModel& before);

// Whether there are states of a joint that the data does not show.
bool HasBlindStates(const EvaluatedModel& evaluated);

// A model at its values over the segments of another, its states alone fitted:
// errors of the same horizon.
EvaluatedModel EvaluateOver(const DiagnosisProblem& problem,
                            const EvaluatedModel& evaluated,
                            const EvaluatedModel& segments);

// The problem's own model with the effects that were added, their parameters
// free and starting where the fit ended: for a fit of other runs.
void ExtendProblem(const DiagnosisProblem& problem,
                   const EvaluatedModel& evaluated, Model* model,
                   std::vector<FreeParameter>* free);

// The problem with effects in its model: all parameters start at `values`, by
// name, or else where they did; those that are `without_influence` or whole
// numbers are set and not free. An effect takes the place of an earlier one
// with which it shares parameters.
DiagnosisProblem WithEffects(
    const DiagnosisProblem& problem,
    const std::vector<std::shared_ptr<const Effect>>& effects,
    const std::set<std::string>& without_influence,
    const std::map<std::string, double>& values);

}  // namespace sysid
