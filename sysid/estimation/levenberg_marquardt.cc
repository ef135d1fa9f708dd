#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/preflight.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/step_size.h"

// The schedules of Levenberg-Marquardt: how segments grow, and how tightly they
// hang together, from the data to one trajectory a run or to segments that are
// independent of each other.

namespace sysid {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Segments grow by this factor a stage.
constexpr double kStageGrowth = 4.0;
// Predictions that are off by this have lost the motion.
constexpr double kLost = 1.0;  // rad or m
// Above this many times the noise a model misses something, and one trajectory
// through all of a chaotic run is not to be had (nor worth anything).
constexpr double kMissing = 2.0;
// Rounds of weights and fit, which settle in two or three.
constexpr int kMostWeighed = 4;

// One stage of a schedule: how tightly its segments hang together, and how long
// it goes on. What it does is the minimiser's (ShootingStage).
struct StageGoal {
  std::string doing;  // in words, for the progress line
  double defect = kJoinedDefect;
  double tolerance = 1e-7;  // of the cost
  int most = 1 << 30;       // iterations, but for those of the fit
  double misfit = 0.0;      // times the noise, where the start is far off
  double equations = 0.0;   // times those of theta, (6.10)
  double news = 1e-6;       // the least gain of a step, of the cost
};

// The stages of one fit: each starts where the last ended. A schedule says how
// segments grow from stage to stage.
class Stages {
 public:
  // A search that compares models does so in the noise of all channels, and
  // does not weigh them.
  explicit Stages(const ShootingProblem& problem, bool weighs = false)
      : problem_(problem),
        choose_step_(problem.options().rollout.step <= 0),
        weighs_(weighs) {}

  // Minimises over the solution as it is cut; again with a shorter step where
  // the solution, or where it was heading, needs one.
  StageSummary Run(const StageGoal& goal);
  // The same of independent segments without theta.
  StageSummary RunSegments(const StageGoal& goal);
  // Takes what the solution leaves of the data for that of the last stage.
  void Measure();
  void Cut(double length) { solution = Recut(problem_, solution, length); }
  // Cut into whole runs.
  bool IsWhole() const;
  // Whether no one trajectory follows a run: joined segments would have nothing
  // to hold on to.
  bool LosesMotion(bool chaotic) const;
  // Shortens the step, where it is ours to choose, to what the solution and the
  // way ahead of it need. True where it changed.
  bool ShortenStep();
  // Weighs each channel by what is left of it. True where that changed much.
  bool Weigh();
  // To what theta needs over whole runs (RefineStep).
  void RefineStep(double defect);
  // (6.10), of the problem's equations of theta; 0 where it has none.
  double EquationsWeight() const;
  double Error() const;  // normalised
  double Rms() const;    // rad or m
  // A defect in multiples of what the last stage left of the data where that is
  // more than the noise: a joint that is tighter than that of nothing but noise
  // holds states to a model that is wrong by more, and the search crawls. (Not
  // of the point as it was cut for the next stage, whose longer segments first
  // miss by what their states from the data were off.)
  double Defect(double of_noise) const { return of_noise * misfit_; }
  // Of the solution as it is cut; they remember what the stage before found.
  const std::shared_ptr<ShootingSegments>& Segments();

  const std::string& doing() const { return doing_; }  // the last stage
  const ShootingProblem& problem() const { return problem_; }
  // Says how long it took so far.
  void ReadClocks(Fit* fit) const {
    fit->wall_time_s = Now() - start_s_;
    fit->cpu_time_s = CpuSeconds() - start_cpu_s_;
  }

  Solution solution;
  std::vector<HistoryEntry> history;
  int iterations = 0;
  int evaluations = 0;

 private:
  ShootingProblem problem_;  // as weighed now
  const bool choose_step_, weighs_;
  bool weighed_ = false;  // not by the noise alone
  const double start_s_ = Now(), start_cpu_s_ = CpuSeconds();
  std::shared_ptr<ShootingSegments> segments_;
  std::string doing_;
  double misfit_ = 1.0;  // what the last stage left, times the noise
};

bool FreesEffects(const ShootingProblem& problem) {
  return std::any_of(problem.free().begin(), problem.free().end(),
                     [](const FreeParameter& free) {
                       return free.parameter.kind == ParameterKind::kEffect;
                     });
}

const std::shared_ptr<ShootingSegments>& Stages::Segments() {
  if (segments_ == nullptr || !segments_->Fit(solution)) {
    segments_ = std::make_shared<ShootingSegments>(problem_, solution);
  }
  return segments_;
}

// Channels whose errors are not those of the noise have one size each that the
// data tells: with s_c^2 the mean square of channel c,
//
//   max over s of  -sum_c N_c (log s_c + e_c^2 / (2 s_c^2))
//
// is at s_c = e_c (Bard 1974, section 4-5: an error covariance that is unknown
// and diagonal; in flight tests, the relaxation of the output-error method).
// Only the ratio of the channels counts: what all of them leave inflates the
// errors.
bool Stages::Weigh() {
  // Even weights for channels that differ by this much make a standard error a
  // sixth wider at most, which is not worth a round.
  constexpr double kWorth = 2.0;
  constexpr double kSettled = 1.25;
  if (!weighs_) return false;
  const RunErrors errors = EvaluateErrors(problem_, solution, 0.0);
  std::map<std::string, double> misfit;
  double least = kInfinity;
  for (const ChannelError& channel : errors.channels) {
    if (!std::isfinite(channel.normalized_rms)) return false;
    const double s =
        channel.normalized_rms < kMissing ? 1.0 : channel.normalized_rms;
    misfit[channel.name] = s;
    least = std::min(least, s);
  }
  const double much = weighed_ ? kSettled : kWorth;
  bool changed = false;
  for (auto& [name, s] : misfit) {
    s /= least;
    const double ratio = s / problem_.Misfit(name);
    changed = changed || ratio > much || ratio * much < 1.0;
  }
  if (!changed) return false;
  weighed_ = true;
  problem_ = problem_.Weighing(std::move(misfit));
  segments_.reset();
  return true;
}

double Stages::EquationsWeight() const {
  if (problem_.equations() == nullptr) return 0.0;
  const double square =
      WeighedSquare(problem_, EvaluateErrors(problem_, solution, 0.0));
  return std::sqrt(square * AutocorrelationTime(problem_, solution));
}

bool Stages::IsWhole() const {
  return SameCut(solution, Recut(problem_, solution, kInfinity));
}

// From the error e of segments of length L: where errors grow fourfold over one
// (ChooseSegment), 16 e is that two segments later; else that of a force which
// the model misses grows by the square of time, to e (T / L)^2 over T.
bool Stages::LosesMotion(bool chaotic) const {
  const double lengths =
      problem_.data().LongestDuration() / MeanSegment(problem_, solution);
  const double growth = chaotic ? 16.0 : lengths * lengths;
  return Rms() * growth > kLost;
}

bool Stages::ShortenStep() {
  if (!choose_step_) return false;
  double& step = solution.rollout.step;
  const double needed = ChooseStepAhead(problem_, solution);
  const bool shorter = step <= 0 || needed < 0.75 * step;
  if (shorter) step = needed;
  return shorter;
}

void Stages::RefineStep(double defect) {
  if (!choose_step_) return;
  solution.rollout.step = sysid::RefineStep(problem_, defect, solution);
}

double Stages::Error() const {
  return EvaluateErrors(problem_, solution, 0.0).total.normalized_rms;
}

double Stages::Rms() const {
  return EvaluateErrors(problem_, solution, 0.0).total.rms;
}

StageSummary Stages::Run(const StageGoal& goal) {
  constexpr int kMostSteps = 4;
  doing_ = goal.doing;
  ShootingStage::Options options;
  options.far = goal.misfit > 0.0 && std::isfinite(goal.defect);
  options.twist_hold = std::max(1.0, goal.misfit);
  options.defect = goal.defect;
  options.misfit = misfit_;
  options.equations = goal.equations;
  options.news = goal.news;
  options.function_tolerance = goal.tolerance;
  StageSummary done;
  for (int i = 0; i < kMostSteps; ++i) {
    const int left = problem_.options().max_iterations - iterations;
    options.max_iterations = std::max(1, std::min(goal.most, left));
    ShootingStage stage(problem_, options, &solution, Segments());
    done = stage.Solve(goal.doing, start_s_, &history);
    iterations += done.iterations;
    evaluations += done.evaluations;
    // Again where the solution, or where it was heading, is too stiff; which
    // only effects can make it.
    if (!ShortenStep() || !FreesEffects(problem_)) break;
  }
  Measure();
  return done;
}

void Stages::Measure() {
  const double error = std::sqrt(
      WeighedSquare(problem_, EvaluateErrors(problem_, solution, 0.0)));
  if (std::isfinite(error)) misfit_ = std::max(1.0, error);
}

StageSummary Stages::RunSegments(const StageGoal& goal) {
  doing_ = goal.doing;
  ThrowIfCancelled(problem_.options().stop);
  solution = SolveSegments(
      problem_, solution,
      {.twist_hold = std::max(1.0, goal.misfit), .tolerance = goal.tolerance});
  ++iterations;
  StageSummary done;
  done.converged = true;
  done.message = "the states of each segment";
  return done;
}

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
  // that gains less moves no parameter by a seventh of its standard error.
  constexpr double kNews = 0.01;
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

// Over short segments, from the data.
void Begin(Stages* stages) {
  if (stages->IsWhole()) {
    // No shorter segments to begin with: hold the spin instead.
    stages->Run({"first steps", stages->Defect(kLooseDefect), 1e-2, 30,
                 stages->Error()});
  } else {
    stages->Run({"short segments", stages->Defect(kLooseDefect), 1e-3, 30});
  }
}

// From short segments to those over which the motion is regular, `longest` at
// most. Returns whether that is less than could be.
bool Grow(Stages* stages, double longest, Drift allowed) {
  const ShootingProblem& problem = stages->problem();
  const double regular = ChooseSegment(problem, stages->solution, allowed);
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
Ended Join(Stages* stages, bool chaotic) {
  if (!stages->IsWhole()) {
    stages->Run({"long segments", stages->Defect(kMiddleDefect), 1e-3, 10});
    if (chaotic && stages->LosesMotion(chaotic)) {
      stages->Weigh();
      return SolveIndependent(stages);
    }
    stages->Run({"long segments", stages->Defect(kCloseDefect), 1e-3, 10});
    stages->Run({"joined segments", stages->Defect(kJoinedDefect), 1e-4});
  }
  const bool one_trajectory = !chaotic || stages->Error() < kMissing;
  Ended ended;
  ended.defect = one_trajectory ? TightDefect(stages->solution) : kJoinedDefect;
  stages->RefineStep(ended.defect);
  ended.last = stages->Run({"one trajectory", ended.defect, 1e-7});
  for (int i = 0; i < kMostWeighed && stages->Weigh(); ++i) {
    ended.last = stages->Run({"one trajectory", ended.defect, 1e-7});
  }
  return ended;
}

// From the data to one trajectory a run.
Ended SolveJoined(Stages* stages) {
  const Solution start = stages->solution;
  Begin(stages);
  // What short segments explain is followed further from where they end.
  if (stages->problem().equations() != nullptr && stages->Error() > kMissing) {
    const Solution begun = stages->solution;
    stages->solution = start;
    const bool chaotic = Follow(stages);
    if (stages->LosesMotion(chaotic)) return SolveWithEquations(stages);
    stages->solution = begun;
  }
  return Join(stages, Grow(stages, kInfinity, Drift::kLinear));
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
  fit.evaluations = stages.evaluations;
  fit.history = stages.history;
  double states = 0.0;  // that were estimated
  for (const Solution::Nodes& nodes : stages.solution.runs) {
    states += std::isinf(ended.defect) ? nodes.segments() : 1;
  }
  SummarizeFit(problem, stages.solution,
               problem.map().size() + ObservedStateDof(problem) * states, &fit);
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
  ended->defect = kJoinedDefect;
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
              const std::function<Ended(Stages*)>& solve) {
  Stages stages(problem, true);
  Ended ended;
  try {
    ended = solve(&stages);
  } catch (const Cancelled&) {
    if (!KeepBest(stages, &ended)) throw;
    stages.iterations = stages.history.back().iteration;
  }
  Fit fit = Finish(stages, ended);
  // What is left is short, and makes the point one that is worth keeping.
  EstimationOptions options = problem.options();
  if (options.keep_best) options.stop = {};
  const ShootingProblem rest = problem.With(options);
  fit.horizon = EvaluateHorizon(rest, stages.solution);
  fit.open = EvaluateOpen(rest, stages.solution);
  stages.ReadClocks(&fit);
  return fit;
}

}  // namespace

Fit FitLevenbergMarquardt(const ShootingProblem& problem) {
  return FitJoined(problem, [](Stages* stages) {
    Ended ended;
    return StartFromData(stages, &ended) ? SolveJoined(stages) : ended;
  });
}

Fit FitLevenbergMarquardtFrom(const ShootingProblem& problem, double length) {
  return FitJoined(problem, [&](Stages* stages) {
    stages->solution = StatesFromScratch(problem, length, kInfinity);
    stages->ShortenStep();
    stages->Measure();
    return Join(stages, !IsRegular(problem, stages->solution));
  });
}

Fit FitIndependentSegments(const ShootingProblem& problem, double longest) {
  Stages stages(problem);
  Ended ended;
  if (StartFromData(&stages, &ended)) {
    if (problem.map().size() > 0) {
      Begin(&stages);
      Grow(&stages, longest, Drift::kLittle);
    } else {
      const double given = problem.options().segment;
      stages.Cut(given > 0 ? given
                           : std::min(ChooseSegment(problem, stages.solution,
                                                    Drift::kLittle),
                                      longest));
    }
    // From the data: what the joined segments made of a spin that no sensor
    // sees is worth nothing.
    stages.solution = WithStatesFromData(problem, stages.solution);
    ended = SolveIndependent(&stages);
  }
  return Finish(stages, ended);
}

Fit StatesAtStart(const ShootingProblem& problem, const Solution& cut) {
  Stages stages(problem);
  Solution start = WithStatesFromData(problem, cut);
  start.theta = problem.InitialTheta();
  stages.solution = SolveSegments(problem, start, {.twist_hold = kHeldSpin});
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
