#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sysid/estimation/clock.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/shooting_stage.h"
#include "sysid/estimation/stage_log.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {

// Above this many times the noise a model misses something, and one trajectory
// through all of a chaotic run is not to be had (nor worth anything).
inline constexpr double kMissing = 2.0;

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
  bool exact = false;       // ShootingStage::Options::exact
  // The error to reach, normalised, or there is no need to go on.
  double wanted = std::numeric_limits<double>::infinity();
};

// The stages of one fit: each starts where the last ended. A schedule says how
// segments grow from stage to stage.
class Stages {
 public:
  // A search that compares models does so in the noise of all channels, and
  // does not weigh them.
  // `log`, if there is one, has the stages that were run before, and gets the
  // others.
  explicit Stages(const ShootingProblem& problem, bool weighs = false,
                  StageLog* log = nullptr)
      : problem_(problem),
        choose_step_(problem.options().rollout.step <= 0),
        weighs_(weighs),
        log_(log) {}

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
  // way ahead of it need, or changes the integrator (AdaptRollout). True where
  // it did.
  bool ShortenStep();
  // Weighs each channel by what is left of it. True where that changed much.
  bool Weigh();
  // To what theta needs over whole runs (RefineStep).
  void RefineStep(double defect);
  // The solution, integrated as its segments need it by themselves.
  Solution Unrefined() const;
  // Of its derivatives, which need no more.
  double TangentStep() const;
  // (6.10), of the problem's equations of theta; 0 where it has none.
  double EquationsWeight() const;
  double Error() const { return Errors().total.normalized_rms; }
  double Rms() const { return Errors().total.rms; }  // rad or m
  // Of the solution as it is, as if nothing were fitted.
  const RunErrors& Errors() const;
  // A defect in multiples of what the last stage left of the data where that is
  // more than the noise: a joint that is tighter than that of nothing but noise
  // holds states to a model that is wrong by more, and the search crawls. (Not
  // of the point as it was cut for the next stage, whose longer segments first
  // miss by what their states from the data were off.)
  double Defect(double of_noise) const { return of_noise * misfit_; }
  // Of the solution as it is cut; they remember what the stage before found.
  const std::shared_ptr<ShootingSegments>& Segments();

  const std::string& doing() const { return doing_; }  // the last stage
  double defect() const { return defect_; }            // its
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
  int ended = 0;  // stages

 private:
  // A stage from the log, or by `run`.
  StageSummary Logged(const std::string& doing,
                      const std::function<StageSummary()>& run);
  StageSummary Minimise(const StageGoal& goal);

  ShootingProblem problem_;  // as weighed now
  const bool choose_step_, weighs_;
  StageLog* const log_;
  bool weighed_ = false;  // not by the noise alone
  // Earlier by the time of the stages from the log.
  double start_s_ = Now();
  const double start_cpu_s_ = CpuSeconds();
  // Errors, and of which solution.
  mutable std::optional<std::pair<Solution, RunErrors>> errors_;
  std::shared_ptr<ShootingSegments> segments_;
  RolloutOptions unrefined_;  // its step is 0 where none was refined
  std::string doing_;
  double defect_ = kJoinedDefect;
  double misfit_ = 1.0;  // what the last stage left, times the noise
};

}  // namespace sysid
