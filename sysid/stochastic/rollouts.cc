#include "sysid/stochastic/rollouts.h"

#include <algorithm>
#include <cmath>

#include "models/math/constants.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

bool AllFinite(const double* errors, int count) {
  return std::all_of(errors, errors + count,
                     [](double e) { return std::isfinite(e); });
}

}  // namespace

Rollouts::Rollouts(const ShootingProblem* problem, const Solution& point)
    : problem_(problem), rollout_(point.rollout) {
  const double position_noise = problem->data().PooledNoise();
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const RunData& data = *problem->runs()[r];
    const Solution::Nodes& nodes = point.runs[r];
    for (int k = 0; k < nodes.segments(); ++k) {
      One one;
      one.measurements = &data.measurements;
      one.first = nodes.samples[k];
      one.last = nodes.samples[k + 1];
      const auto row = nodes.states.row(k);
      one.x0.assign(row.data(), row.data() + row.size());
      all_.push_back(std::move(one));
      const SegmentRollout rollout = functor(size() - 1);
      One& made = all_.back();
      made.num_errors = rollout.num_residuals();
      int before = made.first;
      for (const SegmentRow& of : rollout.rows()) {
        if (of.sample == made.first) continue;  // the state that is given
        if (of.sample != before) ++made.samples;
        before = of.sample;
        const bool position =
            IsPositionLike(data.run.channels[of.channel].kind);
        made.groups.push_back(
            {of.first, of.size,
             position ? 1.0 : position_noise / data.sigma[of.channel]});
      }
      if (made.groups.empty()) all_.pop_back();
    }
  }
}

SegmentRollout Rollouts::functor(int i) const {
  const One& one = all_[i];
  return SegmentRollout(&problem_->model(), &problem_->map(), one.measurements,
                        one.first, one.last, rollout_);
}

bool Rollouts::Linearize(int i, const double* theta, double* errors,
                         RowMatrixXd* J) const {
  RowMatrixXd J_end;
  std::vector<double> end(problem_->model().state_size());
  return functor(i).LinearizeByTheta(first_state(i), theta, errors, end.data(),
                                     J, &J_end) &&
         AllFinite(errors, num_errors(i));
}

double Rollouts::Loss(int count, const Eigen::VectorXd& theta,
                      double huber) const {
  double sum = Prior(theta.data());
  std::vector<double> errors, end(problem_->model().state_size());
  for (int i = 0; i < count; ++i) {
    errors.resize(num_errors(i));
    if (!functor(i)(first_state(i), theta.data(), errors.data(), end.data()) ||
        !AllFinite(errors.data(), num_errors(i))) {
      return kInfinity;
    }
    for (const Group& group : groups(i)) {
      double s = 0.0;
      for (int k = 0; k < group.size; ++k) {
        const double e = group.weight * errors[group.first + k];
        s += e * e;
      }
      sum += HuberLoss(s, huber);
    }
  }
  return sum / Samples(count);
}

int Rollouts::Samples(int count) const {
  int samples = 0;
  for (int i = 0; i < count; ++i) samples += all_[i].samples;
  return samples;
}

bool Rollouts::NormalEquations(const Eigen::VectorXd& theta, Eigen::MatrixXd* H,
                               Eigen::VectorXd* g, double* sum) const {
  H->setZero(theta.size(), theta.size());
  g->setZero(theta.size());
  *sum = 0.0;
  for (int i = 0; i < size(); ++i) {
    Eigen::VectorXd r(num_errors(i));
    RowMatrixXd J;
    if (!Linearize(i, theta.data(), r.data(), &J)) return false;
    for (const Group& group : groups(i)) {
      const Eigen::MatrixXd rows =
          group.weight * J.middleRows(group.first, group.size);
      const Eigen::VectorXd errors =
          group.weight * r.segment(group.first, group.size);
      *H += rows.transpose() * rows;
      *g += rows.transpose() * errors;
      *sum += errors.squaredNorm();
    }
  }
  const double noise = problem_->data().PooledNoise();
  for (int i = 0; i < theta.size(); ++i) {
    const auto& prior = problem_->free()[i].prior;
    if (!prior) continue;
    const double weight = noise / prior->std;
    const double off = weight * (theta[i] - prior->mean);
    (*H)(i, i) += weight * weight;
    (*g)[i] += weight * off;
    *sum += off * off;
  }
  return true;
}

void StartAtRest(const Model& model, Solution* point) {
  for (Solution::Nodes& nodes : point->runs) {
    nodes.states.row(0).segment(model.layout().qd(), model.nv()).setZero();
  }
}

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

void RolloutSums::Evaluate(const Rollouts& rollouts, int count, double huber,
                           const RowMatrixXd& thetas) {
  // Waking a thread takes as long as some hundred steps do.
  constexpr double kWorthThreads = 200.0;
  const int points = static_cast<int>(thetas.rows());
  const int n = static_cast<int>(thetas.cols());
  int threads = rollouts.problem().options().threads;
  rollouts_.clear();
  double steps = 0.0;
  for (int i = 0; i < count; ++i) {
    const SegmentRollout& rollout = rollouts_.emplace_back(rollouts.functor(i));
    steps += (rollout.last() - rollout.first()) *
             rollout.StepsAfter(rollout.first());
  }
  if (steps * points < kWorthThreads) threads = 1;
  if (static_cast<int>(scratch_.size()) < threads) scratch_.resize(threads);
  parts_.resize(points * count, n + 1);
  ParallelFor(points * count, threads, [&](int at, int thread) {
    double* part = parts_.row(at).data();
    const int i = at % count;
    if (!Sum(rollouts, i, rollouts_[i], huber, thetas.row(at / count).data(),
             &scratch_[thread], part)) {
      *part = kInfinity;
    }
    return !stop_.stop_requested();
  });
  ThrowIfCancelled(stop_);
  values_.resize(points);
  gradients_.resize(points, n);
  for (int p = 0; p < points; ++p) {
    const auto parts = parts_.middleRows(p * count, count);
    values_[p] = parts.col(0).sum();
    gradients_.row(p) = parts.rightCols(n).colwise().sum();
  }
}

}  // namespace sysid
