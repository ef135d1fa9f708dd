#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/fit_summary.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/preflight.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/stages.h"

// The schedules of Levenberg-Marquardt: how segments grow, and how tightly they
// hang together, from the data to one trajectory a run or to segments that are
// independent of each other.

namespace sysid {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Segments grow by this factor a stage.
constexpr double kStageGrowth = 4.0;
// Above this many times the noise a model misses something, and one trajectory
// through all of a chaotic run is not to be had (nor worth anything).
constexpr double kMissing = 2.0;

// What a fit took.
struct Clock {
  double start_s = Now(), start_cpu_s = CpuSeconds();
  void Read(Fit* fit) const {
    fit->wall_time_s = Now() - start_s;
    fit->cpu_time_s = CpuSeconds() - start_cpu_s;
  }
};

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
  StageSummary last = stages->Run(held);
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

// From short segments to those over which the motion is regular. Returns
// whether that is less than could be.
bool Grow(Stages* stages, bool whole) {
  const ShootingProblem& problem = stages->problem();
  if (whole) {
    // No shorter segments to begin with: hold the spin instead.
    stages->Run({"first steps", kLooseDefect, 1e-2, 30, stages->Error()});
  } else {
    stages->Run({"short segments", kLooseDefect, 1e-3, 30});
  }
  const double regular = ChooseSegment(problem, stages->solution);
  const double possible =
      std::min(kLongestLength, problem.data().LongestDuration());
  const double given = problem.options().segment;
  const double last_length = given > 0 ? given : regular;
  for (double length = kFirstLength * kStageGrowth;
       length * kStageGrowth < last_length; length *= kStageGrowth) {
    stages->Cut(length);
    stages->Run({"growing segments", kMiddleDefect, 1e-3, 10});
  }
  stages->Cut(last_length);
  stages->ShortenStep();
  return regular < possible * (1 - 1e-9);
}

Ended SolveJoined(Stages* stages) {
  const bool whole = stages->IsWhole();
  const bool chaotic = Grow(stages, whole);
  if (!whole) {
    // Joined by degrees: what the short segments leave open (a spin, a stiff
    // damping) would otherwise start the joined ones far off.
    for (const double defect : {kMiddleDefect, kCloseDefect}) {
      stages->Run({"long segments", defect, 1e-3, 10});
    }
    stages->Run({"joined segments", kJoinedDefect, 1e-4});
  }
  const bool one_trajectory = !chaotic || stages->Error() < kMissing;
  Ended ended;
  ended.defect = one_trajectory ? TightDefect(stages->solution) : kJoinedDefect;
  stages->RefineStep(ended.defect);
  ended.last = stages->Run({"one trajectory", ended.defect, 1e-7});
  return ended;
}

Fit MakeFit(const ShootingProblem& problem) {
  Fit fit(problem.model());
  fit.samples = problem.data().samples();
  fit.noise = problem.data().PooledNoise();
  return fit;
}

// What a fit says of where its stages ended.
void Finish(const Stages& stages, const Ended& ended, Fit* fit) {
  fit->defect = ended.defect;
  fit->converged = ended.last.converged;
  fit->termination = ended.last.message;
  fit->iterations = stages.iterations;
  fit->evaluations = stages.evaluations;
  fit->history = stages.history;
  double states = 0.0;  // that were estimated
  for (const Solution::Nodes& nodes : stages.solution.runs) {
    states += std::isinf(ended.defect) ? nodes.segments() : 1;
  }
  const ShootingProblem& problem = stages.problem();
  SummarizeFit(problem, stages.solution,
               problem.map().size() + ObservedStateDof(problem) * states, fit);
}

// What a stage that was stopped leaves: Ceres keeps its last successful step in
// the solution, and the stages before ended at theirs. False where that is the
// start.
bool KeepBest(const Stages& stages, Ended* ended) {
  const int iterations =
      stages.history.empty() ? 0 : stages.history.back().iteration;
  if (!stages.problem().options().keep_best || iterations == 0) return false;
  ended->defect = kJoinedDefect;
  ended->last.message =
      InterruptedWords("after " + std::to_string(iterations) +
                       " iterations, in the stage of " + stages.doing());
  return true;
}

// Starts from the data, if there is any use.
void StartFromData(Stages* stages, std::string* hopeless) {
  const ShootingProblem& problem = stages->problem();
  stages->solution = CutPoint(problem, problem.InitialTheta(),
                              AllStatesFromData(problem), kFirstLength);
  stages->ShortenStep();
  *hopeless = WhyHopeless(problem, stages->solution, stages->Segments().get());
}

}  // namespace

Fit FitLevenbergMarquardt(const ShootingProblem& problem) {
  const Clock clock;
  Fit fit = MakeFit(problem);
  Stages stages(problem, clock.start_s);
  Ended ended;
  StartFromData(&stages, &ended.last.message);
  ended.defect = kJoinedDefect;
  if (ended.last.message.empty()) {
    try {
      ended = SolveJoined(&stages);
    } catch (const Cancelled&) {
      if (!KeepBest(stages, &ended)) throw;
      stages.iterations = stages.history.back().iteration;
    }
  }
  Finish(stages, ended, &fit);
  // What is left is short, and makes the point one that is worth keeping.
  EstimationOptions options = problem.options();
  if (options.keep_best) options.stop = {};
  const ShootingProblem rest = problem.With(options);
  fit.horizon = EvaluateHorizon(rest, stages.solution);
  fit.open = EvaluateOpen(rest, stages.solution);
  clock.Read(&fit);
  return fit;
}

Fit FitIndependentSegments(const ShootingProblem& problem) {
  const Clock clock;
  Fit fit = MakeFit(problem);
  Stages stages(problem, clock.start_s);
  Ended ended;
  StartFromData(&stages, &ended.last.message);
  if (ended.last.message.empty()) {
    const bool whole = stages.IsWhole();
    Grow(&stages, whole);
    // From the data: what the joined segments made of a spin that no sensor
    // sees is worth nothing.
    stages.solution = WithStatesFromData(problem, stages.solution);
    ended = SolveIndependent(&stages);
  } else {
    ended.defect = kJoinedDefect;
  }
  Finish(stages, ended, &fit);
  clock.Read(&fit);
  return fit;
}

Fit StatesAtStart(const ShootingProblem& problem, const Solution& cut) {
  const Clock clock;
  Fit fit = MakeFit(problem);
  Stages stages(problem, clock.start_s);
  Solution start = WithStatesFromData(problem, cut);
  start.theta = problem.InitialTheta();
  stages.solution = SolveStates(problem, start, {.twist_hold = kHeldSpin});
  Finish(stages, {}, &fit);
  clock.Read(&fit);
  return fit;
}

Fit RefitIndependentSegments(const ShootingProblem& problem,
                             const Solution& start) {
  const Clock clock;
  Fit fit = MakeFit(problem);
  Stages stages(problem, clock.start_s);
  stages.solution = start;
  stages.ShortenStep();
  Finish(stages, SolveIndependent(&stages), &fit);
  clock.Read(&fit);
  return fit;
}

}  // namespace sysid
