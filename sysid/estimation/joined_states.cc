#include "sysid/estimation/joined_states.h"

#include <limits>
#include <utility>

#include "models/state.h"
#include "sysid/estimation/parallel.h"

namespace sysid {

using Map = Eigen::Map<RowMatrixXd>;

JoinedStates::JoinedStates(const Model& model, Solution* point,
                           ShootingSegments* segments,
                           const std::vector<double>& defect_sigma,
                           ShootingSegment::Columns columns, int threads)
    : model_(model),
      point_(point),
      segments_(segments),
      defect_(defect_sigma),
      columns_(columns),
      threads_(threads) {
  const size_t runs = point->runs.size();
  base_.asked.resize(runs);
  base_.states.resize(runs);
  base_.defect.resize(runs);
  base_.J.resize(runs);
  base_.J_next.resize(runs);
  asked_.resize(runs);
  now_.resize(runs);
}

double JoinedStates::Cost(int run, const RowMatrixXd& states,
                          double* of_defects) {
  const int count = static_cast<int>(states.rows());
  Eigen::VectorXd defect(model_.tangent_size());
  double squares = 0.0, defects = 0.0;
  for (int k = 0; k < count; ++k) {
    ShootingSegment* segment = segments_->at(run, k);
    if (!segment->Roll(states.row(k).data(), point_->theta.data())) {
      return std::numeric_limits<double>::infinity();
    }
    squares += segment->squares();
    if (k + 1 == count) break;
    StateDefect(model_, segment->x_end().data(), states.row(k + 1).data(),
                defect.data(), nullptr, nullptr);
    defect_.Apply(defect.data(), {});
    defects += defect.squaredNorm();
  }
  *of_defects = 0.5 * defects;
  return 0.5 * (squares + defects);
}

void JoinedStates::Move(int run) {
  const RowMatrixXd& asked = point_->runs[run].states;
  RowMatrixXd& now = now_[run];
  asked_[run] = asked;
  now = asked;
  const int count = static_cast<int>(asked.rows());
  if (!has_base_ || count < 2 || base_.J[run].empty()) return;
  const int n = model_.tangent_size();
  const int n_theta = static_cast<int>(base_.J[run][0].cols()) - n;
  RowMatrixXd step(count, n);
  for (int k = 0; k < count; ++k) {
    BoxMinus<double>(model_, asked.row(k).data(),
                     base_.asked[run].row(k).data(), step.row(k).data());
    if (k == 0) continue;
    BoxPlus<double>(model_, base_.states[run].row(k).data(), step.row(k).data(),
                    now.row(k).data());
  }
  Eigen::VectorXd moved(n + n_theta);
  moved.tail(n_theta) = (point_->theta - base_.theta).head(n_theta);
  RowMatrixXd defects(count - 1, n);  // (6.13) without the second order
  double linear = 0.0;
  for (int k = 0; k + 1 < count; ++k) {
    moved.head(n) = step.row(k).transpose();
    Eigen::VectorXd d = base_.defect[run][k] + base_.J[run][k] * moved +
                        base_.J_next[run][k] * step.row(k + 1).transpose();
    defects.row(k) = d.transpose();
    defect_.Apply(d.data(), {});
    linear += 0.5 * d.squaredNorm();
  }
  double of_defects = 0.0, of_others = 0.0;
  const double cost = Cost(run, now, &of_defects);
  if (of_defects - linear < least_) return;
  RowMatrixXd again = now;
  for (int k = 0; k + 1 < count; ++k) {
    ShootingSegment* segment = segments_->at(run, k);
    if (!segment->Roll(again.row(k).data(), point_->theta.data())) return;
    const Eigen::VectorXd back = -defects.row(k).transpose();
    BoxPlus<double>(model_, segment->x_end().data(), back.data(),
                    again.row(k + 1).data());
  }
  if (Cost(run, again, &of_others) < cost) now = std::move(again);
}

void JoinedStates::SetBase(int run) {
  const int count = static_cast<int>(now_[run].rows());
  const int n = model_.tangent_size();
  base_.asked[run] = asked_[run];
  base_.states[run] = now_[run];
  base_.defect[run].resize(count - 1);
  base_.J[run].resize(count - 1);
  base_.J_next[run].resize(count - 1);
  for (int k = 0; k + 1 < count; ++k) {
    ShootingSegment* segment = segments_->at(run, k);
    Eigen::VectorXd& defect = base_.defect[run][k];
    RowMatrixXd D_end;
    defect.resize(n);
    if (!segment->Linearize(State(run, k), base_.theta.data(), columns_)) {
      base_.J[run].clear();  // as the minimiser will see
      return;
    }
    StateDefect(model_, segment->x_end().data(), State(run, k + 1),
                defect.data(), &D_end, &base_.J_next[run][k]);
    base_.J[run][k] = D_end * segment->Take(segment->J_end(), columns_);
  }
}

bool JoinedStates::IsAt(const std::vector<RowMatrixXd>& states,
                        const Eigen::VectorXd& theta) const {
  if (theta.size() != point_->theta.size() || theta != point_->theta) {
    return false;
  }
  for (size_t r = 0; r < states.size(); ++r) {
    if (states[r].rows() != point_->runs[r].states.rows() ||
        states[r] != point_->runs[r].states) {
      return false;
    }
  }
  return true;
}

void JoinedStates::PrepareForEvaluation(bool with_J, bool) {
  const int runs = static_cast<int>(now_.size());
  if (!IsAt(asked_, theta_)) {
    if (has_base_ && IsAt(base_.asked, base_.theta)) {
      asked_ = base_.asked;
      now_ = base_.states;
    } else {
      ParallelFor(runs, threads_, [&](int r) {
        Move(r);
        return true;
      });
    }
    theta_ = point_->theta;
  }
  if (!with_J || (has_base_ && IsAt(base_.asked, base_.theta))) return;
  base_.theta = theta_;
  ParallelFor(runs, threads_, [&](int r) {
    SetBase(r);
    return true;
  });
  has_base_ = true;
}

void JoinedStates::Adopt() {
  PrepareForEvaluation(false, true);
  for (size_t r = 0; r < now_.size(); ++r) point_->runs[r].states = now_[r];
  has_base_ = false;
  asked_ = now_;
}

}  // namespace sysid
