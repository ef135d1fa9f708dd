#include "sysid/stochastic/rollouts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace sysid {

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

bool Rollouts::Errors(int i, const double* theta, double* errors) const {
  std::vector<double> end(problem_->model().state_size());
  if (!functor(i)(first_state(i), theta, errors, end.data())) return false;
  return std::all_of(errors, errors + num_errors(i),
                     [](double e) { return std::isfinite(e); });
}

bool Rollouts::Linearize(int i, const double* theta, double* errors,
                         RowMatrixXd* J) const {
  RowMatrixXd J_end;
  std::vector<double> end(problem_->model().state_size());
  return functor(i).LinearizeByTheta(first_state(i), theta, errors, end.data(),
                                     J, &J_end) &&
         std::all_of(errors, errors + num_errors(i),
                     [](double e) { return std::isfinite(e); });
}

double Rollouts::Loss(const std::vector<int>& which,
                      const Eigen::VectorXd& theta, double huber) const {
  double sum = Prior(theta.data());
  std::vector<double> errors;
  for (const int i : which) {
    errors.resize(num_errors(i));
    if (!Errors(i, theta.data(), errors.data())) {
      return std::numeric_limits<double>::infinity();
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
  return sum / Samples(which);
}

int Rollouts::Samples(const std::vector<int>& which) const {
  int count = 0;
  for (const int i : which) count += samples(i);
  return count;
}

void StartAtRest(const Model& model, Solution* point) {
  for (Solution::Nodes& nodes : point->runs) {
    nodes.states.row(0).segment(model.layout().qd(), model.nv()).setZero();
  }
}

std::vector<int> FirstOnes(int count) {
  std::vector<int> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

}  // namespace sysid
