#include "sysid/estimation/shooting_segment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sysid/estimation/joined_states.h"

namespace sysid {

using Map = Eigen::Map<RowMatrixXd>;

Whitening MakeWhitening(const ShootingProblem& problem, int run,
                        const SegmentRollout& rollout) {
  const RunData& data = *problem.runs()[run];
  std::vector<double> sigma;
  std::vector<Whitening::Group> groups;
  for (const SegmentRow& row : rollout.rows()) {
    sigma.insert(sigma.end(), row.size,
                 data.sigma[row.channel] *
                     problem.Misfit(data.run.channels[row.channel].name));
    groups.push_back({row.first, row.size});
  }
  const EstimationOptions& options = problem.options();
  if (options.loss == RobustLoss::kNone) groups.clear();
  return Whitening(std::move(sigma), options.loss, options.loss_scale,
                   std::move(groups));
}

std::unique_ptr<SegmentScratch> ScratchPool::Take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (idle_.empty()) return std::make_unique<SegmentScratch>();
  std::unique_ptr<SegmentScratch> scratch = std::move(idle_.back());
  idle_.pop_back();
  return scratch;
}

void ScratchPool::Give(std::unique_ptr<SegmentScratch> scratch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  idle_.push_back(std::move(scratch));
}

ShootingSegment::ShootingSegment(const ShootingProblem& problem,
                                 const RolloutOptions& rollout, int run,
                                 int first, int last, ScratchPool* pool,
                                 double tangent_step)
    : rollout_(&problem.model(), &problem.map(),
               &problem.runs()[run]->measurements, first, last, rollout),
      pool_(pool),
      whitening_(MakeWhitening(problem, run, rollout_)) {
  if (!(tangent_step > rollout.step)) return;
  RolloutOptions longer = rollout;
  longer.step = tangent_step;
  tangent_.emplace(&problem.model(), &problem.map(), &rollout_.measurements(),
                   first, last, longer);
}

int ShootingSegment::CountColumns(Columns columns) const {
  const int tangent = rollout_.model().tangent_size();
  const int n_theta = rollout_.parameters().size();
  return columns == Columns::kState   ? tangent
         : columns == Columns::kTheta ? n_theta
                                      : tangent + n_theta;
}

RowMatrixXd ShootingSegment::Take(const RowMatrixXd& J, Columns columns) const {
  return columns == Columns::kTheta ? J.rightCols(CountColumns(columns))
                                    : J.leftCols(CountColumns(columns));
}

bool ShootingSegment::IsAt(const double* x, const double* theta) const {
  const int size = rollout_.model().state_size();
  return known_ != Known::kNothing && std::equal(x, x + size, place_.begin()) &&
         std::equal(place_.begin() + size, place_.end(), theta);
}

void ShootingSegment::Remember(Known what, const double* x,
                               const double* theta) {
  place_.assign(x, x + rollout_.model().state_size());
  place_.insert(place_.end(), theta, theta + rollout_.parameters().size());
  known_ = what;
}

bool ShootingSegment::Possible(const double* theta) const {
  return rollout_.parameters().size() == 0 ||
         rollout_.parameters().FirstImpossibleLink(theta).empty();
}

bool ShootingSegment::RollRows(const double* x, const double* theta,
                               Eigen::VectorXd* r,
                               Eigen::VectorXd* x_end) const {
  r->resize(rollout_.num_residuals());
  x_end->resize(rollout_.model().state_size());
  if (!Possible(theta) || !rollout_(x, theta, r->data(), x_end->data())) {
    return false;
  }
  whitening_.Apply(r->data(), {});
  return true;
}

bool ShootingSegment::Differentiate(const double* x, const double* theta,
                                    Columns columns, Eigen::VectorXd* r,
                                    Eigen::VectorXd* x_end, RowMatrixXd* J,
                                    RowMatrixXd* J_end) const {
  r->resize(rollout_.num_residuals());
  x_end->resize(rollout_.model().state_size());
  if (!Possible(theta)) return false;
  const SegmentRollout& rollout = tangent_ ? *tangent_ : rollout_;
  std::unique_ptr<SegmentScratch> scratch = pool_->Take();
  const bool ok =
      columns == Columns::kTheta
          ? rollout.LinearizeByTheta(x, theta, r->data(), x_end->data(), J,
                                     J_end, scratch.get())
          : rollout.Linearize(x, theta, columns == Columns::kBoth, r->data(),
                              x_end->data(), J, J_end, scratch.get());
  pool_->Give(std::move(scratch));
  if (!ok) return false;
  whitening_.Apply(r->data(), {Map(J->data(), J->rows(), J->cols())});
  return true;
}

bool ShootingSegment::LinearizeRows(const double* x, const double* theta,
                                    Columns columns, Eigen::VectorXd* r,
                                    Eigen::VectorXd* x_end, RowMatrixXd* J,
                                    RowMatrixXd* J_end) const {
  return Differentiate(x, theta, columns, r, x_end, J, J_end) &&
         (!tangent_ || RollRows(x, theta, r, x_end));
}

bool ShootingSegment::Roll(const double* x, const double* theta) {
  if (IsAt(x, theta)) return true;
  known_ = Known::kNothing;
  Eigen::VectorXd r;
  if (!RollRows(x, theta, &r, &x_end_)) return false;
  squares_ = r.squaredNorm();
  if (tangent_) r_ = std::move(r);
  Remember(Known::kValues, x, theta);
  return true;
}

bool ShootingSegment::Linearize(const double* x, const double* theta,
                                Columns columns) {
  if (known_ == Known::kColumns && IsAt(x, theta) &&
      (columns_ == columns || columns_ == Columns::kBoth)) {
    return true;
  }
  // With steps of their own derivatives do not bring the values.
  if (tangent_ && !Roll(x, theta)) return false;
  known_ = Known::kNothing;
  Eigen::VectorXd r;
  RowMatrixXd J;
  Eigen::VectorXd x_end;
  if (!Differentiate(x, theta, columns, &r, &x_end, &J, &J_end_)) return false;
  if (!tangent_) x_end_ = std::move(x_end);
  Compress(J, tangent_ ? r_ : r);
  columns_ = columns;
  Remember(Known::kColumns, x, theta);
  return true;
}

// Pivoted Cholesky of J^T J with its columns scaled to 1 (S):
//
//   S J^T J S = L L^T,   R = L^T S^-1,   L z = S J^T r,
//
// L a column for each pivot, its rows in the order of J's columns. The pivot is
// the column of which most is left; where that is rounding, nothing of J is
// left. (Eigen's LDLT picks pivots by what was there before: of columns of
// length 1 the first, so that one that depends on others divides by rounding.)
void ShootingSegment::Compress(const RowMatrixXd& J, const Eigen::VectorXd& r) {
  const int n = static_cast<int>(J.cols());
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(n, n);
  products.selfadjointView<Eigen::Lower>().rankUpdate(J.transpose());
  const Eigen::VectorXd norms = products.diagonal().cwiseSqrt();
  const Eigen::VectorXd scale =
      (norms.array() > 0).select(norms.cwiseInverse(), 0.0);
  products = scale.asDiagonal() *
             Eigen::MatrixXd(products.selfadjointView<Eigen::Lower>()) *
             scale.asDiagonal();
  const Eigen::VectorXd wanted = scale.cwiseProduct(J.transpose() * r);
  const double rounding = n * std::numeric_limits<double>::epsilon();
  Eigen::MatrixXd L = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd left = products.diagonal();
  z_.setZero(n);
  for (int k = 0; k < n; ++k) {
    int pivot;
    const double most = left.maxCoeff(&pivot);
    if (!(most > rounding)) break;
    const Eigen::VectorXd before = L.row(pivot).head(k);
    const double root = std::sqrt(most);
    L.col(k) =
        (left.array() > 0)
            .select((products.col(pivot) - L.leftCols(k) * before) / root, 0.0);
    L(pivot, k) = root;
    z_[k] = (wanted[pivot] - before.dot(z_.head(k))) / root;
    left -= L.col(k).cwiseAbs2();
    left[pivot] = 0.0;
  }
  R_ = L.transpose() * norms.asDiagonal();
  squares_ = r.squaredNorm();
}

ShootingSegments::ShootingSegments(const ShootingProblem& problem,
                                   const Solution& point, double tangent_step)
    : rollout_(point.rollout) {
  for (size_t r = 0; r < point.runs.size(); ++r) {
    const std::vector<int>& samples = point.runs[r].samples;
    samples_.push_back(samples);
    runs_.emplace_back();
    for (size_t k = 0; k + 1 < samples.size(); ++k) {
      runs_.back().push_back(std::make_unique<ShootingSegment>(
          problem, point.rollout, static_cast<int>(r), samples[k],
          samples[k + 1], &pool_, tangent_step));
    }
  }
}

bool ShootingSegments::Fit(const Solution& point) const {
  if (!(point.rollout == rollout_) || point.runs.size() != samples_.size()) {
    return false;
  }
  for (size_t r = 0; r < samples_.size(); ++r) {
    if (point.runs[r].samples != samples_[r]) return false;
  }
  return true;
}

ShootingSegmentCost::ShootingSegmentCost(
    ShootingSegment* segment, const std::vector<double>& defect_sigma,
    const JoinedStates* joined, int run, int place)
    : segment_(segment),
      defect_(defect_sigma),
      joined_(joined),
      run_(run),
      place_(place),
      measured_(segment->rollout().num_residuals() > 0
                    ? segment->CountColumns(ShootingSegment::Columns::kBoth) + 1
                    : 0) {
  const int size = segment->rollout().model().state_size();
  const int n_theta = segment->rollout().parameters().size();
  mutable_parameter_block_sizes()->push_back(size);
  if (n_theta > 0) mutable_parameter_block_sizes()->push_back(n_theta);
  if (!defect_sigma.empty()) mutable_parameter_block_sizes()->push_back(size);
  set_num_residuals(measured_ + defect_.rows());
}

bool ShootingSegmentCost::Evaluate(double const* const* parameters,
                                   double* residuals,
                                   double** jacobians) const {
  const Model& model = segment_->rollout().model();
  const int size = model.state_size(), tangent = model.tangent_size();
  const int n_theta = segment_->rollout().parameters().size();
  const int n_defect = defect_.rows();
  const int next = n_theta > 0 ? 2 : 1;
  // Derivatives are by tangents, which they share with the parameters.
  const double* x = joined_ ? joined_->State(run_, place_) : parameters[0];
  const double* x_next = n_defect == 0 ? nullptr
                         : joined_     ? joined_->State(run_, place_ + 1)
                                       : parameters[next];
  const double* theta = n_theta > 0 ? parameters[1] : nullptr;
  Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
  double* defect = residuals + measured_;
  if (jacobians == nullptr) {
    if (!segment_->Roll(x, theta)) return false;
    r.head(measured_).setZero();
    if (measured_ > 0) r[measured_ - 1] = std::sqrt(segment_->squares());
    if (n_defect == 0) return true;
    StateDefect(model, segment_->x_end().data(), x_next, defect, nullptr,
                nullptr);
    defect_.Apply(defect, {});
    return true;
  }
  using Columns = ShootingSegment::Columns;
  const bool with_theta = n_theta > 0 && jacobians[1] != nullptr;
  const Columns columns = !with_theta               ? Columns::kState
                          : jacobians[0] == nullptr ? Columns::kTheta
                                                    : Columns::kBoth;
  if (!segment_->Linearize(x, theta, columns)) return false;
  const int width = segment_->CountColumns(columns);
  // By tangents; all zero where nothing is set.
  RowMatrixXd J = RowMatrixXd::Zero(num_residuals(), width);
  RowMatrixXd J_next = RowMatrixXd::Zero(n_defect, tangent);
  r.setZero();
  if (measured_ > 0) {
    const RowMatrixXd R = segment_->Take(segment_->R(), columns);
    const Eigen::VectorXd& z = segment_->z();
    J.topRows(R.rows()) = R;
    r.head(z.size()) = z;
    r[measured_ - 1] =
        std::sqrt(std::max(0.0, segment_->squares() - z.squaredNorm()));
  }
  if (n_defect > 0) {
    RowMatrixXd D_end;
    StateDefect(model, segment_->x_end().data(), x_next, defect, &D_end,
                &J_next);
    RowMatrixXd J_defect = D_end * segment_->Take(segment_->J_end(), columns);
    defect_.Apply(defect, {Map(J_defect.data(), n_defect, width),
                           Map(J_next.data(), n_defect, tangent)});
    J.bottomRows(n_defect) = J_defect;
  }
  if (jacobians[0] != nullptr) {
    Map out(jacobians[0], num_residuals(), size);
    LiftToAmbient(model, parameters[0], J.leftCols(tangent), out);
  }
  if (with_theta) {
    Map(jacobians[1], num_residuals(), n_theta) = J.rightCols(n_theta);
  }
  if (n_defect > 0 && jacobians[next] != nullptr) {
    Map out(jacobians[next], num_residuals(), size);
    out.topRows(measured_).setZero();
    LiftToAmbient(model, parameters[next], J_next, out.bottomRows(n_defect));
  }
  return true;
}

}  // namespace sysid
