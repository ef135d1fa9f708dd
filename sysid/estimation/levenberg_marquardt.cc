#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "models/math/constants.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/preflight.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/stage_log.h"
#include "sysid/estimation/stages.h"
#include "sysid/estimation/stop_later.h"

// The schedules of Levenberg-Marquardt: how segments grow, and how tightly they
// hang together, from the data to one trajectory a run or to segments that are
// independent of each other.

namespace sysid {
namespace {

// Segments grow by this factor a stage.
constexpr double kStageGrowth = 4.0;
// Rounds of weights and fit, which settle in two or three.
constexpr int kMostWeighed = 4;

// How a schedule ended.
struct Ended {
  double defect = kInfinity;
  StageSummary last;
};

// Independent segments of the solution as it is cut.
Ended SolveIndependent(Stages* stages) {
  // To compare models: a hundredth of what makes a difference between two.
  constexpr double kEnough = 1e-5;
  constexpr double kNear = 2.0, kThere = 1.3;  // times the noise
  const StageGoal held{"independent segments", kInfinity, kEnough,
                       StageGoal().most, kHeldSpin};
  const bool states_alone = stages->problem().map().size() == 0;
  StageSummary last =
      states_alone ? stages->RunSegments(held) : stages->Run(held);
  for (int i = 0; i < kMostWeighed && stages->Weigh(); ++i) {
    last = stages->Run(held);
  }
  // A model that is nearly right may say itself how it spins, and the errors of
  // the step would look like something missing; one that so comes to the noise
  // was right.
  if (last.converged && stages->Error() < kNear) {
    const Solution before = stages->solution;
    stages->RefineStep(kInfinity);
    StageGoal loose = held;
    loose.misfit = 0.0;
    const StageSummary free = stages->Run(loose);
    if (stages->Error() < kThere) {
      last = free;
    } else {
      stages->solution = before;
    }
  }
  return {kInfinity, last};
}

// Follows the motion with the solution's parameters, over independent
// segments as long as it is regular. Returns whether those are shorter than
// could be.
bool Follow(Stages* stages) {
  const ShootingProblem& problem = stages->problem();
  const double regular =
      ChooseSegment(problem, stages->solution, Drift::kLinear);
  const double given = problem.options().segment;
  stages->Cut(given > 0 ? given : regular);
  stages->solution = WithStatesFromData(problem, stages->solution);
  stages->ShortenStep();
  stages->RunSegments({"states", kInfinity, 1e-4, StageGoal().most, kHeldSpin});
  return regular < LongestSegment(problem) * (1 - 1e-9);
}

// Independent segments together with the equations of motion, (6.10).
Ended SolveWithEquations(Stages* stages) {
  // Of the log-likelihood, of which z standard errors are worth z^2 / 2: a step
  // that gains less moves no parameter by a fifth of its standard error.
  constexpr double kNews = 0.02;
  StageGoal goal{"segments and equations", kInfinity, 0.0, StageGoal().most,
                 kHeldSpin};
  Ended ended;
  stages->Weigh();
  for (int i = 0; i < kMostWeighed; ++i) {
    goal.equations = stages->EquationsWeight();
    goal.news = kNews * goal.equations * goal.equations;
    ended.last = stages->Run(goal);
    if (!stages->Weigh()) break;
  }
  return ended;
}

// Over short segments, from the data. Returns the error.
double Begin(Stages* stages, int most) {
  if (stages->IsWhole()) {
    // No shorter segments to begin with: hold the spin instead.
    stages->Run({"first steps", stages->Defect(kLooseDefect), 1e-2, most,
                 stages->Error()});
  } else {
    stages->Run({"short segments", stages->Defect(kLooseDefect), 1e-3, most});
  }
  return stages->Error();
}

// From short segments to those over which the motion is regular, `longest` at
// most. Returns whether that is less than could be.
bool Grow(Stages* stages, double longest, Drift allowed) {
  const ShootingProblem& problem = stages->problem();
  const double regular = ChooseSegment(problem, stages->solution, allowed,
                                       stages->Segments().get());
  const double given = problem.options().segment;
  const double last_length = given > 0 ? given : std::min(regular, longest);
  for (double length = kFirstLength * kStageGrowth;
       length * kStageGrowth < last_length; length *= kStageGrowth) {
    stages->Cut(length);
    stages->Run({"growing segments", stages->Defect(kMiddleDefect), 1e-3, 10});
  }
  stages->Cut(last_length);
  stages->ShortenStep();
  return regular < LongestSegment(problem) * (1 - 1e-9);
}

// Joins the segments of the solution as it is cut, by degrees: what independent
// ones leave open (a spin, a stiff damping) would otherwise start the joined
// ones far off.
Ended JoinSegments(Stages* stages, bool chaotic) {
  if (!stages->IsWhole()) {
    stages->Run({"long segments", stages->Defect(kMiddleDefect), 1e-3, 10});
    if (chaotic && stages->LosesMotion(chaotic)) {
      stages->Weigh();
      return SolveIndependent(stages);
    }
    // A model that follows the data to its noise is near enough to one
    // trajectory; one that does not is led there by degrees.
    if (!(stages->Error() < kMissing)) {
      stages->Run({"long segments", stages->Defect(kCloseDefect), 1e-3, 10});
      stages->Run({"joined segments", stages->Defect(kJoinedDefect), 1e-4});
    }
  }
  const bool follows = stages->Error() < kMissing;
  const bool one_trajectory = !chaotic || follows;
  Ended ended;
  ended.defect = one_trajectory
                     ? TightDefect(stages->problem(), stages->solution)
                     : kJoinedDefect;
  // First with the steps that segments need by themselves, which cost less.
  if (follows && !stages->IsWhole()) {
    stages->Run({"joined segments", ended.defect, 1e-4});
  }
  stages->RefineStep(ended.defect);
  StageGoal goal{"one trajectory", ended.defect, 1e-7};
  goal.exact = true;
  goal.wanted = stages->problem().options().wanted_error;
  ended.last = stages->Run(goal);
  for (int i = 0;
       i < kMostWeighed && stages->Error() <= goal.wanted && stages->Weigh();
       ++i) {
    ended.last = stages->Run(goal);
  }
  return ended;
}

// From the data to one trajectory a run.
Ended SolveJoined(Stages* stages) {
  if (stages->problem().equations() != nullptr) {
    const Solution start = stages->solution;
    const bool chaotic = Follow(stages);
    const Solution followed = stages->solution;
    const bool lost = stages->LosesMotion(chaotic);
    stages->solution = start;
    // From there a model that is right comes to the noise of short segments in
    // a few iterations of Gauss and Newton.
    if (lost && Begin(stages, 10) > kMissing) {
      stages->solution = followed;
      return SolveWithEquations(stages);
    }
  }
  Begin(stages, 30);
  return JoinSegments(stages, Grow(stages, kInfinity, Drift::kLinear));
}

// What a fit says of where its stages ended.
Fit Finish(const Stages& stages, const Ended& ended) {
  const ShootingProblem& problem = stages.problem();
  Fit fit(problem.model());
  fit.samples = problem.data().samples();
  fit.noise = problem.data().PooledNoise();
  fit.defect = ended.defect;
  fit.converged = ended.last.converged;
  fit.termination = ended.last.message;
  fit.iterations = stages.iterations;
  fit.stages = stages.ended;
  fit.evaluations = stages.evaluations;
  fit.history = stages.history;
  double states = 0.0;  // that were estimated
  for (const Solution::Nodes& nodes : stages.solution.runs) {
    states += std::isinf(ended.defect) ? nodes.segments() : 1;
  }
  states = SumOver(problem.processes(), states);
  SummarizeFit(problem, stages.solution,
               problem.map().size() + ObservedStateDof(problem) * states, &fit,
               stages.TangentStep());
  stages.ReadClocks(&fit);
  return fit;
}

// What a stage that was stopped leaves: Ceres keeps its last successful step in
// the solution, and the stages before ended at theirs. False where that is the
// start.
bool KeepBest(const Stages& stages, Ended* ended) {
  const int iterations =
      stages.history.empty() ? 0 : stages.history.back().iteration;
  if (!stages.problem().options().keep_best || iterations == 0) return false;
  ended->defect = stages.defect();
  ended->last.message =
      InterruptedWords("after " + std::to_string(iterations) +
                       " iterations, in the stage of " + stages.doing());
  return true;
}

// Starts from the data. False, with the reason, where that is of no use.
bool StartFromData(Stages* stages, Ended* ended) {
  const ShootingProblem& problem = stages->problem();
  stages->solution = CutPoint(problem, problem.InitialTheta(),
                              AllStatesFromData(problem), kFirstLength);
  stages->ShortenStep();
  ended->defect = kJoinedDefect;
  ended->last.message =
      WhyHopeless(problem, stages->solution, stages->Segments().get());
  return ended->last.message.empty();
}

// A fit by a schedule that joins its segments.
Fit FitJoined(const ShootingProblem& problem,
              const std::function<Ended(Stages*)>& solve,
              StageLog* log = nullptr) {
  Stages stages(problem, true, log);
  Ended ended;
  try {
    ended = solve(&stages);
  } catch (const Cancelled&) {
    if (!KeepBest(stages, &ended)) throw;
    stages.iterations = stages.history.back().iteration;
  }
  Fit fit = Finish(stages, ended);
  if (std::isfinite(problem.options().wanted_error)) return fit;
  const StopLater later(problem.options().stop);
  const EstimationOptions options = WithGrace(problem, later);
  try {
    const ShootingProblem rest = problem.With(options);
    // The noise of a window leaves its state by more than a fifth of it, which
    // is all that a step of ChooseRollout does to one.
    fit.horizon = EvaluateHorizon(rest, stages.Unrefined());
    fit.open = EvaluateOpen(rest, stages.solution);
  } catch (const Cancelled&) {
    if (!options.keep_best) throw;
  }
  stages.ReadClocks(&fit);
  return fit;
}

}  // namespace

Fit FitLevenbergMarquardt(const ShootingProblem& problem) {
  return FitLevenbergMarquardt(problem, nullptr);
}

Fit FitLevenbergMarquardt(const ShootingProblem& problem, StageLog* log) {
  return FitJoined(
      problem,
      [](Stages* stages) {
        Ended ended;
        return StartFromData(stages, &ended) ? SolveJoined(stages) : ended;
      },
      log);
}

Fit FitLevenbergMarquardtFrom(const ShootingProblem& problem, double length) {
  return FitJoined(problem, [&](Stages* stages) {
    stages->solution = StatesFromScratch(problem, length, kInfinity);
    stages->ShortenStep();
    stages->Measure();
    return JoinSegments(stages, !IsRegular(problem, stages->solution));
  });
}

Fit FitIndependentSegments(const ShootingProblem& problem, double longest) {
  Stages stages(problem);
  Ended ended;
  if (StartFromData(&stages, &ended)) {
    if (problem.map().size() > 0) {
      Begin(&stages, 30);
      Grow(&stages, longest, Drift::kLittle);
    } else {
      const double given = problem.options().segment;
      stages.Cut(given > 0 ? given
                           : std::min(ChooseSegment(problem, stages.solution,
                                                    Drift::kLittle),
                                      longest));
    }
    const Solution joined = stages.solution;
    const double had = stages.Error();
    // From the data: what the joined segments made of a spin that no sensor
    // sees is worth nothing.
    stages.solution = WithStatesFromData(problem, joined);
    ended = SolveIndependent(&stages);
    // Segments that need not join cannot be worse than those that do, but in
    // another minimum: then from the joined ones.
    const double from_data = stages.Error();
    if (problem.map().size() > 0 && !(from_data <= had)) {
      const Solution data = std::exchange(stages.solution, joined);
      const Ended ended_from_data =
          std::exchange(ended, SolveIndependent(&stages));
      if (!(stages.Error() < from_data)) {
        stages.solution = data;
        ended = ended_from_data;
      }
    }
  }
  return Finish(stages, ended);
}

Fit StatesAtStart(const ShootingProblem& problem, const Solution& cut) {
  Stages stages(problem);
  Solution start = WithStatesFromData(problem, cut);
  start.theta = problem.InitialTheta();
  stages.solution = start;
  stages.ShortenStep();
  StateOptions options{.twist_hold = kHeldSpin};
  options.max_iterations =
      std::min(options.max_iterations, problem.options().max_iterations);
  stages.solution = SolveSegments(problem, stages.solution, options);
  return Finish(stages, {});
}

Fit RefitIndependentSegments(const ShootingProblem& problem,
                             const Solution& start) {
  Stages stages(problem);
  stages.solution = start;
  stages.ShortenStep();
  const Ended ended = SolveIndependent(&stages);
  return Finish(stages, ended);
}

}  // namespace sysid
