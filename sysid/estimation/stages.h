#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sysid/estimation/shooting_stage.h"

namespace sysid {

// One stage of a schedule: how tightly its segments hang together, and how long
// it goes on. What it does is the minimiser's (ShootingStage).
struct StageGoal {
  std::string doing;  // in words, for the progress line
  double defect = kJoinedDefect;
  double tolerance = 1e-7;  // of the cost
  int most = 1 << 30;       // iterations, but for those of the fit
  double misfit = 0.0;      // times the noise, where the start is far off
};

// The stages of one fit: each starts where the last ended. A schedule says how
// segments grow from stage to stage.
class Stages {
 public:
  Stages(const ShootingProblem& problem, double start_s)
      : problem_(problem),
        choose_step_(problem.options().rollout.step <= 0),
        start_s_(start_s) {}

  // Minimises over the solution as it is cut; again with a shorter step where
  // the solution, or where it was heading, needs one.
  StageSummary Run(const StageGoal& goal);
  void Cut(double length) { solution = Recut(length); }
  // Cut into whole runs.
  bool IsWhole() const;
  // Shortens the step, where it is ours to choose, to what the solution and the
  // way ahead of it need. True where it changed.
  bool ShortenStep();
  // To what theta needs over whole runs (RefineStep).
  void RefineStep(double defect);
  double Error() const;  // normalised
  // Of the solution as it is cut; they remember what the stage before found.
  const std::shared_ptr<ShootingSegments>& Segments();

  bool chooses_step() const { return choose_step_; }
  const std::string& doing() const { return doing_; }  // the last stage
  const ShootingProblem& problem() const { return problem_; }

  Solution solution;
  std::vector<HistoryEntry> history;
  int iterations = 0;
  int evaluations = 0;

 private:
  Solution Recut(double length) const;

  const ShootingProblem& problem_;
  const bool choose_step_;
  const double start_s_;
  std::shared_ptr<ShootingSegments> segments_;
  std::string doing_;
};

}  // namespace sysid
