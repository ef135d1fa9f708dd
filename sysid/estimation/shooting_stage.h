#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ceres/ceres.h"
#include "sysid/estimation/shooting_problem.h"
#include "sysid/estimation/shooting_segment.h"

namespace sysid {

// How tightly the segments hang together: standard deviation of the defect
// x_end [-] x_next, as a multiple of the noise (positions), and of the noise
// over kDefectTime (velocities).
//
// The rollout is deterministic, so the maximum-likelihood estimate has no
// defects at all; a defect that is free to be large is what lets the solver
// walk through a landscape that single shooting cannot. So a fit starts loose,
// joins the segments, and ends tight.
inline constexpr double kLooseDefect = 10.0;
inline constexpr double kMiddleDefect = 1.0;
inline constexpr double kCloseDefect = 0.1;
inline constexpr double kJoinedDefect = 0.01;
inline constexpr double kDefectTime = 0.1;  // s

// The last tightness. K defects of d each shift the end of a run by D = K d at
// a cost of D^2 / (K sigma_d^2); left unshifted the same D costs the N samples
// about N D^2 / sigma^2. What is not model stays below 1 % of that with
// sigma_d = 0.1 sigma / sqrt(N K).
double TightDefect(const ShootingPoint& point);

// One whitened residual of a run linearised at a point: rows of a segment (all,
// or their triangular factor), where it is independent those of the prior on
// its state (but for a run's first), and its defect; columns by the tangent of
// its state, theta, and the tangent of the next state (no columns for the last
// segment).
struct SegmentLinearization {
  RowMatrixXd J_x, J_theta, J_next;
  Eigen::VectorXd r;
};

// A run's segments in time order, and the prior on its first state.
struct RunLinearization {
  RowMatrixXd J_prior;  // tangent x tangent, by the first state
  Eigen::VectorXd r_prior;
  std::vector<SegmentLinearization> segments;
};

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
    int max_iterations = 100;
    double function_tolerance = 1e-10;
    int threads = 0;     // 0: as many as the problem has
    bool quiet = false;  // reports no progress
  };
  // `segments` of an earlier stage spare the work that both do, where they are
  // those of the same cut; null: its own.
  ShootingStage(const ShootingProblem& problem, const Options& options,
                ShootingPoint* point,
                std::shared_ptr<ShootingSegments> segments = nullptr);
  ~ShootingStage();

  // Ceres' Levenberg-Marquardt. Appends to the history, whose times count from
  // `start_time_s` and whose iterations go on.
  StageSummary Solve(const std::string& doing, double start_time_s,
                     std::vector<HistoryEntry>* history);

  // At the point as it is; by all threads. False where the dynamics fail.
  // Of a segment's rows J d + r, all (they grow with the samples), or only
  // their triangular factor by orthogonal transformations.
  enum class Rows { kAll, kTriangular };
  bool Linearize(std::vector<RunLinearization>* runs,
                 Rows rows = Rows::kAll) const;
  // The triangular factor, with the change of the residuals between two stages
  // that roll the segments out in their own ways (the same problem integrated
  // otherwise, at the same point) in place of the residuals.
  bool LinearizeChange(const ShootingStage& from, const ShootingStage& to,
                       std::vector<RunLinearization>* runs) const;
  // theta's priors as rows: J x theta, r.
  void LinearizePriors(RowMatrixXd* J, Eigen::VectorXd* r) const;

 private:
  void AddSegments();
  void AddPriors();
  int Threads() const;
  double* State(int run, int segment) const;
  bool HasDefect(int run, int segment) const;
  bool HasOwnPrior(int run, int segment) const;
  // Of that state: residuals and, where asked for, derivatives by its tangent.
  void StatePrior(int run, int segment, double* r, RowMatrixXd* J) const;
  // Whitened errors of a segment, then its own prior or its defect.
  bool RollSegment(int run, int k, Eigen::VectorXd* r) const;
  bool LinearizeSegment(int run, int k, SegmentLinearization* out) const;
  // Calls `linearize` for each segment, by all threads, and adds the priors.
  bool LinearizeAll(
      const std::function<bool(int run, int k, SegmentLinearization* out)>&
          linearize,
      std::vector<RunLinearization>* runs) const;
  ceres::Solver::Options SolverOptions() const;
  // Places in theta at a bound that the cost pushes outward. Releases theta.
  std::vector<int> PushedOutward();
  void ReleaseTheta();
  void HoldTheta(const std::vector<int>& held);

  const ShootingProblem& shooting_;
  Options options_;
  ShootingPoint* point_;
  std::unique_ptr<ceres::Manifold> manifold_, theta_manifold_;
  std::vector<double> defect_sigma_;  // empty where segments are independent
  std::shared_ptr<ShootingSegments> segments_;
  // Per run: on its first state, and where segments are independent on each.
  std::vector<std::vector<ceres::CostFunction*>> state_priors_;
  ceres::CostFunction* theta_prior_ = nullptr;
  std::unique_ptr<ceres::Problem> problem_;
};

// Standard deviations of the defect: tangent_size numbers for defect = 1.
std::vector<double> DefectSigma(const ShootingProblem& problem);

// Beliefs about the first state of a run (of each segment, where they are
// independent), as wide as keeps them without weight beside a measurement and
// still gives every direction some: what no sensor sees (the spin of a rod
// about itself, by heading vectors) would otherwise make the problem singular,
// and a state that is frozen instead biases the parameters. Standard
// deviations, tangent_size numbers; those of a spin are divided by
// `twist_hold`.
std::vector<double> StateBelief(const ShootingProblem& problem,
                                double twist_hold);

// Seconds of a steady clock.
double Now();

}  // namespace sysid
