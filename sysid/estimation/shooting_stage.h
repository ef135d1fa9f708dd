#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "ceres/ceres.h"
#include "sysid/estimation/clock.h"
#include "sysid/estimation/joined_states.h"
#include "sysid/estimation/shooting_problem.h"
#include "sysid/estimation/shooting_segment.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {

struct StageSummary {
  bool converged = false;
  std::string message;
  int iterations = 0;
  int evaluations = 0;  // of all segments, with or without derivatives
  double cost = 0.0;
};

struct HistoryEntry {
  int iteration = 0;
  double cost = 0.0;           // half the whitened sum of squares
  double time_s = 0.0;         // since the fit began
  Eigen::VectorXd theta = {};  // where it was
};

// The least-squares problem of one segmentation: costs of all segments with
// theta and the states as parameter blocks. Reads its start from `point` and
// writes its result there.
class ShootingStage {
 public:
  struct Options {
    double defect = kJoinedDefect;  // infinity: the segments are independent
    bool fix_theta = false;         // only the states move
    bool fix_states = false;        // known: only theta moves
    bool far = false;  // the start may be far off: first steps are short
    // Divides the widths of the beliefs about what headings do not see (twist).
    // While the parameters are far off the misfit is worth any spin.
    double twist_hold = 1.0;
    // What the model misses, in times the noise: the unit of BodyBelief.
    double misfit = 1.0;
    // Times the problem's equations of theta; 0: without them.
    double equations = 0.0;
    int max_iterations = 100;
    double function_tolerance = 1e-10;
    // The least gain of a step that is worth another. Of a negative
    // log-likelihood less is no news, however small the cost itself has become
    // (data without noise).
    double news = 1e-6;
    // The stage also ends, before its step, where the linear model promises
    // less than such a gain; of an exact one, less than what a thousandth of a
    // standard error is worth.
    bool exact = false;
    // Normalised; as EstimationOptions has it.
    double wanted_error = std::numeric_limits<double>::infinity();
    int threads = 0;     // 0: as many as the problem has
    bool quiet = false;  // reports no progress
  };
  // `segments` of an earlier stage spare the work that both do, where they are
  // those of the same cut; null: its own.
  ShootingStage(const ShootingProblem& problem, const Options& options,
                Solution* point,
                std::shared_ptr<ShootingSegments> segments = nullptr);
  ~ShootingStage();

  // Ceres' Levenberg-Marquardt, or its like over processes. Appends to the
  // history, whose times count from `start_time_s` and whose iterations go on.
  StageSummary Solve(const std::string& doing, double start_time_s,
                     std::vector<HistoryEntry>* history);

 private:
  void AddSegments();
  void AddPriors();
  int Threads() const;
  double* State(int run, int segment) const;
  bool HasDefect(int run, int segment) const;
  ceres::Solver::Options SolverOptions() const;
  // Of the blocks; Ceres takes out of the one that it is given what is held.
  std::shared_ptr<ceres::ParameterBlockOrdering> Ordering() const;
  // Places in theta at a bound that the cost pushes outward. Releases theta.
  std::vector<int> PushedOutward();
  bool ThetaGradient(std::vector<double>* gradient);
  void ReleaseTheta();
  void HoldTheta(const std::vector<int>& held);

  const ShootingProblem& shooting_;
  Options options_;
  Solution* point_;
  std::unique_ptr<ceres::Manifold> manifold_, theta_manifold_;
  std::vector<double> defect_sigma_;  // empty where segments are independent
  std::shared_ptr<ShootingSegments> segments_;
  std::unique_ptr<JoinedStates> joined_;  // null where they are not tightly
  std::unique_ptr<ceres::Problem> problem_;
};

}  // namespace sysid
