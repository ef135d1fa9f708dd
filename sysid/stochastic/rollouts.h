#pragma once

#include <cmath>
#include <memory>
#include <stop_token>
#include <utility>
#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// Rollouts from first states that are given (equation 1 of Heiden et al.): the
// states of a point stay, theta moves. Of a rollout's samples k = 1 .. K (the
// first one is given) the errors r_k of (5.1), SI; those that are no positions
// (m, rad) are multiplied by the ratio of the position-like noise to theirs, so
// that an error of one standard deviation counts alike. The loss over a set of
// rollouts with N samples together is
//
//   L(theta) = (1/N) sum_k sum_channels rho(|r_k|^2),
//   rho(s) = s,  beyond s > d^2:  2 d sqrt(s) - d^2                    (9.1)
//
// d the Huber threshold; infinity: squares, as the paper's equation 1. A prior
// adds noise^2 (theta_i - mean)^2 / std^2 to the sum: L is then the noise^2
// times the negative log-posterior, doubled, a sample.
class Rollouts {
 public:
  // The problem must outlive it.
  Rollouts(const ShootingProblem* problem, const Solution& point);

  // The step changes on the way.
  void SetRollout(const RolloutOptions& rollout) { rollout_ = rollout; }

  int size() const { return static_cast<int>(all_.size()); }
  int num_parameters() const { return problem_->map().size(); }
  int num_errors(int i) const { return all_[i].num_errors; }
  // Errors that belong together: |r|^2 of (9.1) is over one of these.
  struct Group {
    int first, size;
    double weight;
  };
  const std::vector<Group>& groups(int i) const { return all_[i].groups; }
  const ShootingProblem& problem() const { return *problem_; }

  // The rollout with the step of now, and its first state.
  SegmentRollout functor(int i) const;
  const double* first_state(int i) const { return all_[i].x0.data(); }

  // Unweighted errors (num_errors numbers) and their derivatives by theta;
  // false where the dynamics fail or a number is not finite.
  bool Linearize(int i, const double* theta, double* errors,
                 RowMatrixXd* J) const;

  // (9.1) over the first `count` rollouts; infinity where one fails.
  double Loss(int count, const Eigen::VectorXd& theta, double huber) const;
  int Samples(int count) const;
  // Of N L with squares, over all rollouts and the priors, about theta: half
  // its gradient g, half its second derivative H (of Gauss and Newton), and its
  // value. False where a rollout fails.
  bool NormalEquations(const Eigen::VectorXd& theta, Eigen::MatrixXd* H,
                       Eigen::VectorXd* g, double* sum) const;
  // What the priors add to the sum.
  template <typename T>
  T Prior(const T* theta) const;

 private:
  struct One {
    const Measurements* measurements;
    int first, last;
    std::vector<double> x0;
    int samples = 0;
    int num_errors = 0;
    std::vector<Group> groups;
  };

  const ShootingProblem* problem_;
  RolloutOptions rollout_;
  std::vector<One> all_;
};

template <typename T>
T Rollouts::Prior(const T* theta) const {
  T sum(0.0);
  const double noise = problem_->data().PooledNoise();
  for (int i = 0; i < num_parameters(); ++i) {
    const auto& prior = problem_->free()[i].prior;
    if (!prior) continue;
    const T off = (theta[i] - prior->mean) * (noise / prior->std);
    sum += off * off;
  }
  return sum;
}

// The first state of every run has no velocity; a rollout that starts in the
// middle of a run keeps its own.
void StartAtRest(const Model& model, Solution* point);

// rho of (9.1), s >= 0.
template <typename T>
T HuberLoss(const T& s, double huber) {
  using std::sqrt;
  if (s <= huber * huber) return s;
  return 2.0 * huber * sqrt(s) - huber * huber;
}

// Its derivative.
inline double HuberSlope(double s, double huber) {
  return s <= huber * huber ? 1.0 : huber / std::sqrt(s);
}

// The sums in (9.1) over rollouts, at several theta at once, and what they
// depend on them by:
//
//   S(theta) = sum_k sum_channels rho(|r_k|^2)
//   dS/dtheta = 2 sum_k sum_channels rho'(|r_k|^2) J_k^T r_k             (9.7)
//
// r weighted, J = dr/dtheta by SegmentRollout::LinearizeByTheta: structured
// where the model's effects allow. Rollouts of all theta are spread over
// threads; each has a place of its own, and the places are added in order: the
// numbers do not depend on how many threads there are.
//
// Keeps its memory from one evaluation to the next, for one caller at a time.
// The rollouts' problem must outlive it.
class RolloutSums {
 public:
  // Evaluate() throws Cancelled once that asks to stop.
  void StopAt(std::stop_token stop) { stop_ = std::move(stop); }

  // Of the first `count` rollouts, at each row of `thetas`.
  void Evaluate(const Rollouts& rollouts, int count, double huber,
                const RowMatrixXd& thetas);

  // Of the last evaluation, row by row. A value is infinite where the dynamics
  // of a rollout fail; its gradient then says nothing.
  const Eigen::VectorXd& values() const { return values_; }
  const RowMatrixXd& gradients() const { return gradients_; }

 private:
  // Of one thread.
  struct Scratch {
    SegmentScratch segment;
    Eigen::VectorXd errors, pull;
    std::vector<double> end;
    RowMatrixXd J, J_end;
  };

  // One rollout at one theta: S, then dS/dtheta. False where it fails.
  static bool Sum(const Rollouts& rollouts, int i,
                  const SegmentRollout& rollout, double huber,
                  const double* theta, Scratch* scratch, double* sum);

  std::stop_token stop_;
  std::vector<SegmentRollout> rollouts_;
  std::vector<Scratch> scratch_;
  RowMatrixXd parts_;  // a row for each theta and rollout
  Eigen::VectorXd values_;
  RowMatrixXd gradients_;
};

}  // namespace sysid
