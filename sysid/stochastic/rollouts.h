#pragma once

#include <cmath>
#include <memory>
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
  void SetStep(double step) { rollout_.step = step; }

  int size() const { return static_cast<int>(all_.size()); }
  int num_parameters() const { return problem_->map().size(); }
  int samples(int i) const { return all_[i].samples; }
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

  // Unweighted errors (num_errors numbers); false where the dynamics fail or a
  // number is not finite.
  bool Errors(int i, const double* theta, double* errors) const;
  // The same and their derivatives by theta.
  bool Linearize(int i, const double* theta, double* errors,
                 RowMatrixXd* J) const;

  // (9.1) over some of the rollouts; infinity where one fails.
  double Loss(const std::vector<int>& which, const Eigen::VectorXd& theta,
              double huber) const;
  int Samples(const std::vector<int>& which) const;
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

// 0 .. count - 1.
std::vector<int> FirstOnes(int count);

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

}  // namespace sysid
