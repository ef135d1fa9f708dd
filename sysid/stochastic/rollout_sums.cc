#include "sysid/stochastic/rollout_sums.h"

#include <cmath>
#include <limits>

#include "sysid/estimation/parallel.h"

namespace sysid {

bool RolloutSums::Sum(const Rollouts& rollouts, int i,
                      const SegmentRollout& rollout, double huber,
                      const double* theta, Scratch* scratch, double* sum) {
  scratch->errors.resize(rollout.num_residuals());
  scratch->end.resize(rollout.model().state_size());
  if (!rollout.LinearizeByTheta(rollouts.first_state(i), theta,
                                scratch->errors.data(), scratch->end.data(),
                                &scratch->J, &scratch->J_end,
                                &scratch->segment)) {
    return false;
  }
  // dS/dr; none of the state that is given.
  scratch->pull.setZero(rollout.num_residuals());
  *sum = 0.0;
  for (const Rollouts::Group& group : rollouts.groups(i)) {
    const double weight = group.weight * group.weight;
    const auto r = scratch->errors.segment(group.first, group.size);
    const double s = weight * r.squaredNorm();
    *sum += HuberLoss(s, huber);
    scratch->pull.segment(group.first, group.size) =
        (2.0 * weight * HuberSlope(s, huber)) * r;
  }
  Eigen::Map<Eigen::VectorXd> slope(sum + 1, scratch->J.cols());
  slope.noalias() = scratch->J.transpose() * scratch->pull;
  return std::isfinite(*sum) && slope.allFinite();
}

void RolloutSums::Evaluate(const Rollouts& rollouts,
                           const std::vector<int>& which, double huber,
                           int threads, const RowMatrixXd& thetas) {
  // Waking a thread takes as long as some hundred steps do.
  constexpr double kWorthThreads = 200.0;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const int points = static_cast<int>(thetas.rows());
  const int n = static_cast<int>(thetas.cols());
  const int count = static_cast<int>(which.size());
  rollouts_.clear();
  double steps = 0.0;
  for (const int i : which) {
    const SegmentRollout& rollout = rollouts_.emplace_back(rollouts.functor(i));
    steps += (rollout.last() - rollout.first()) *
             rollout.StepsAfter(rollout.first());
  }
  if (steps * points < kWorthThreads) threads = 1;
  if (static_cast<int>(scratch_.size()) < threads) scratch_.resize(threads);
  parts_.resize(points * count, n + 1);
  ParallelFor(points * count, threads, [&](int at, int thread) {
    double* part = parts_.row(at).data();
    const int k = at % count;
    if (!Sum(rollouts, which[k], rollouts_[k], huber,
             thetas.row(at / count).data(), &scratch_[thread], part)) {
      *part = kInfinity;
    }
    return true;
  });
  values_.resize(points);
  gradients_.resize(points, n);
  for (int p = 0; p < points; ++p) {
    const auto parts = parts_.middleRows(p * count, count);
    values_[p] = parts.col(0).sum();
    gradients_.row(p) = parts.rightCols(n).colwise().sum();
  }
}

}  // namespace sysid
