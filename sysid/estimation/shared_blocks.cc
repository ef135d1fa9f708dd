#include "sysid/estimation/shared_blocks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "glog/logging.h"
#include "models/math/decompositions.h"
#include "sysid/estimation/parallel.h"

namespace sysid {
namespace {

// Of Ceres' Levenberg-Marquardt: squared lengths of columns are taken as within
// these where they damp.
constexpr double kLeastDiagonal = 1e-6, kMostDiagonal = 1e32;

double SquaresOf(const Eigen::VectorXd& r) { return 0.5 * r.squaredNorm(); }

}  // namespace

SharedBlocks::SharedBlocks(const Processes& all, int threads, double* theta,
                           ceres::Problem* problem,
                           ceres::EvaluationCallback* moved)
    : all_(all),
      threads_(threads),
      theta_(theta),
      problem_(problem),
      moved_(moved) {
  std::vector<ceres::ResidualBlockId> ids;
  problem->GetResidualBlocks(&ids);
  std::map<double*, int> places;  // of states
  for (const ceres::ResidualBlockId id : ids) {
    std::vector<double*> parameters;
    problem->GetParameterBlocksForResidualBlock(id, &parameters);
    AddCost(problem->GetCostFunctionForResidualBlock(id), parameters, &places);
  }
  FindChains();
  FindBounds();
  const double states = static_cast<double>(states_.size()) * tangent_;
  variables_ = SumOver(all, states) + theta_tangent_.cols();
}

void SharedBlocks::AddCost(const ceres::CostFunction* cost,
                           const std::vector<double*>& parameters,
                           std::map<double*, int>* places) {
  Block block{cost};
  for (double* parameter : parameters) {
    if (parameter == theta_) {
      block.with_theta = true;
      continue;
    }
    CHECK(!problem_->IsParameterBlockConstant(parameter));
    const auto [at, is_new] =
        places->emplace(parameter, static_cast<int>(states_.size()));
    if (is_new) states_.push_back(parameter);
    (block.x < 0 ? block.x : block.next) = at->second;
    state_size_ = problem_->ParameterBlockSize(parameter);
    tangent_ = problem_->ParameterBlockTangentSize(parameter);
  }
  if (block.x < 0) {
    shared_.push_back(cost);
  } else {
    blocks_.push_back(block);
  }
}

void SharedBlocks::FindChains() {
  segment_of_.assign(states_.size(), -1);
  prior_of_.assign(states_.size(), -1);
  std::vector<int> next(states_.size(), -1);
  std::vector<bool> follows(states_.size(), false);
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const Block& block = blocks_[i];
    const bool is_prior = block.cost->parameter_block_sizes().size() == 1 &&
                          block.cost->num_residuals() == tangent_ &&
                          segment_of_[block.x] >= 0;
    (is_prior ? prior_of_ : segment_of_)[block.x] = static_cast<int>(i);
    if (block.next < 0) continue;
    next[block.x] = block.next;
    follows[block.next] = true;
  }
  for (size_t s = 0; s < states_.size(); ++s) {
    if (follows[s]) continue;
    chains_.emplace_back();
    for (int at = static_cast<int>(s); at >= 0; at = next[at]) {
      chains_.back().push_back(at);
    }
  }
}

void SharedBlocks::FindBounds() {
  theta_tangent_.resize(0, 0);
  if (theta_ == nullptr || !problem_->HasParameterBlock(theta_)) return;
  const int n = problem_->ParameterBlockSize(theta_);
  if (problem_->IsParameterBlockConstant(theta_)) {
    theta_tangent_.setZero(n, 0);
    return;
  }
  const ceres::Manifold* const manifold = problem_->GetManifold(theta_);
  if (manifold == nullptr) {
    theta_tangent_.setIdentity(n, n);
  } else {
    theta_tangent_.resize(n, manifold->TangentSize());
    manifold->PlusJacobian(theta_, theta_tangent_.data());
  }
  lower_.resize(n);
  upper_.resize(n);
  constexpr double kNone = std::numeric_limits<double>::max();  // of Ceres
  for (int i = 0; i < n; ++i) {
    lower_[i] = problem_->GetParameterLowerBound(theta_, i);
    upper_[i] = problem_->GetParameterUpperBound(theta_, i);
    bounded_ |= lower_[i] > -kNone || upper_[i] < kNone;
  }
}

SharedBlocks::Point SharedBlocks::Read() const {
  Point at;
  at.theta = Eigen::Map<const Eigen::VectorXd>(theta_, theta_tangent_.rows());
  at.states.resize(states_.size(), state_size_);
  for (size_t s = 0; s < states_.size(); ++s) {
    at.states.row(s) =
        Eigen::Map<const Eigen::RowVectorXd>(states_[s], state_size_);
  }
  return at;
}

void SharedBlocks::Write(const Point& at) const {
  std::copy(at.theta.begin(), at.theta.end(), theta_);
  for (size_t s = 0; s < states_.size(); ++s) {
    Eigen::Map<Eigen::RowVectorXd>(states_[s], state_size_) = at.states.row(s);
  }
}

SharedBlocks::Point SharedBlocks::Plus(const Point& at,
                                       const Point& step) const {
  Point moved = at;
  moved.theta += theta_tangent_ * step.theta;
  if (bounded_) moved.theta = moved.theta.cwiseMin(upper_).cwiseMax(lower_);
  for (size_t s = 0; s < states_.size(); ++s) {
    problem_->GetManifold(states_[s])
        ->Plus(at.states.row(s).data(), step.states.row(s).data(),
               moved.states.row(s).data());
  }
  return moved;
}

double SharedBlocks::SquaredNorm(const Point& of) const {
  Totals total(1);
  for (const auto& row : of.states.rowwise()) total.Add(0, row.squaredNorm());
  const double states = total.Over(all_)[0];
  return states + (theta_tangent_.cols() > 0 ? of.theta.squaredNorm() : 0.0);
}

double SharedBlocks::LargestNumber(const Point& of) const {
  double most = of.theta.size() > 0 && theta_tangent_.cols() > 0
                    ? of.theta.cwiseAbs().maxCoeff()
                    : 0.0;
  if (of.states.size() > 0) {
    most = std::max(most, of.states.cwiseAbs().maxCoeff());
  }
  return MaxOver(all_, most);
}

RowMatrixXd SharedBlocks::TangentOf(const Point& at, int state) const {
  RowMatrixXd P(state_size_, tangent_);
  problem_->GetManifold(states_[state])
      ->PlusJacobian(at.states.row(state).data(), P.data());
  return P;
}

bool SharedBlocks::Evaluate(const Block& block, const Point& at, bool with_J,
                            Rows* rows) const {
  const int m = block.cost->num_residuals();
  const bool moves_theta = block.with_theta && theta_tangent_.cols() > 0;
  rows->r.resize(m);
  std::vector<const double*> parameters{at.states.row(block.x).data()};
  if (block.with_theta) parameters.push_back(at.theta.data());
  if (block.next >= 0) parameters.push_back(at.states.row(block.next).data());
  if (!with_J) {
    return block.cost->Evaluate(parameters.data(), rows->r.data(), nullptr) &&
           rows->r.allFinite();
  }
  RowMatrixXd J_x(m, state_size_), J_theta(m, at.theta.size()), J_next;
  std::vector<double*> jacobians{J_x.data()};
  if (block.with_theta) {
    jacobians.push_back(moves_theta ? J_theta.data() : nullptr);
  }
  if (block.next >= 0) {
    J_next.resize(m, state_size_);
    jacobians.push_back(J_next.data());
  }
  if (!block.cost->Evaluate(parameters.data(), rows->r.data(),
                            jacobians.data())) {
    return false;
  }
  rows->J_x = J_x * TangentOf(at, block.x);
  rows->J_theta.setZero(m, theta_tangent_.cols());
  if (moves_theta) rows->J_theta = J_theta * theta_tangent_;
  rows->J_next.resize(m, 0);
  if (block.next >= 0) rows->J_next = J_next * TangentOf(at, block.next);
  return rows->r.allFinite() && rows->J_x.allFinite() &&
         rows->J_theta.allFinite() && rows->J_next.allFinite();
}

bool SharedBlocks::EvaluateShared(const Point& at, bool with_J,
                                  Rows* rows) const {
  int m = 0;
  for (const ceres::CostFunction* cost : shared_) m += cost->num_residuals();
  rows->r.resize(m);
  RowMatrixXd J(m, at.theta.size());
  const double* const parameters[] = {at.theta.data()};
  int row = 0;
  for (const ceres::CostFunction* cost : shared_) {
    double* jacobians[] = {J.data() + row * J.cols()};
    if (!cost->Evaluate(parameters, rows->r.data() + row,
                        with_J ? jacobians : nullptr)) {
      return false;
    }
    row += cost->num_residuals();
  }
  if (with_J) rows->J_theta = J * theta_tangent_;
  return true;
}

void SharedBlocks::Tell(const Point& at, bool with_J) const {
  if (moved_ == nullptr) return;
  Write(at);
  moved_->PrepareForEvaluation(with_J, true);
}

bool SharedBlocks::Cost(const Point& at, double* cost) const {
  Tell(at, false);
  const int count = static_cast<int>(blocks_.size());
  std::vector<double> costs(count);
  Rows shared;
  const bool ok = ParallelFor(count, threads_,
                              [&](int i) {
                                Rows rows;
                                if (!Evaluate(blocks_[i], at, false, &rows)) {
                                  return false;
                                }
                                costs[i] = SquaresOf(rows.r);
                                return true;
                              }) &&
                  EvaluateShared(at, false, &shared);
  Totals totals(2);
  totals.Add(0, ok ? 0.0 : 1.0);
  for (const double one : costs) totals.Add(1, ok ? one : 0.0);
  const Eigen::VectorXd sums = totals.Over(all_);
  *cost = sums[1] + SquaresOf(shared.r);
  return sums[0] == 0.0 && std::isfinite(*cost);
}

Eigen::VectorXd SharedBlocks::Times(const Block& block, const Rows& rows,
                                    const Point& step) const {
  Eigen::VectorXd moved = rows.J_x * step.states.row(block.x).transpose();
  if (step.theta.size() > 0) moved += rows.J_theta * step.theta;
  if (block.next >= 0) {
    moved += rows.J_next * step.states.row(block.next).transpose();
  }
  return moved;
}

bool SharedBlocks::CostAlong(const Point& at, const Point& direction,
                             double* cost, double* slope) const {
  Tell(at, true);
  const int count = static_cast<int>(blocks_.size());
  std::vector<double> costs(count), slopes(count);
  Rows shared;
  const bool ok =
      ParallelFor(count, threads_,
                  [&](int i) {
                    Rows rows;
                    if (!Evaluate(blocks_[i], at, true, &rows)) return false;
                    costs[i] = SquaresOf(rows.r);
                    slopes[i] = rows.r.dot(Times(blocks_[i], rows, direction));
                    return true;
                  }) &&
      EvaluateShared(at, true, &shared);
  Totals totals(3);
  totals.Add(0, ok ? 0.0 : 1.0);
  for (int i = 0; ok && i < count; ++i) {
    totals.Add(1, costs[i]);
    totals.Add(2, slopes[i]);
  }
  const Eigen::VectorXd sums = totals.Over(all_);
  if (sums[0] > 0.0) return false;
  *cost = sums[1] + SquaresOf(shared.r);
  *slope = sums[2];
  if (!shared_.empty()) {
    *slope += shared.r.dot(shared.J_theta * direction.theta);
  }
  return std::isfinite(*cost);
}

bool SharedBlocks::Linearize(const Point& at, bool rescale, double* cost) {
  Tell(at, true);
  const int count = static_cast<int>(blocks_.size());
  rows_.resize(count);
  const bool ok =
      ParallelFor(
          count, threads_,
          [&](int i) { return Evaluate(blocks_[i], at, true, &rows_[i]); }) &&
      EvaluateShared(at, true, &shared_rows_);
  Point squares;  // lengths of the columns
  const int n = static_cast<int>(theta_tangent_.cols());
  gradient_.states.setZero(states_.size(), tangent_);
  squares.states.setZero(states_.size(), tangent_);
  Totals totals(2 + 2 * n);  // failures, cost, gradient and squares of theta
  totals.Add(0, ok ? 0.0 : 1.0);
  for (int i = 0; ok && i < count; ++i) {
    const Rows& rows = rows_[i];
    const int x = blocks_[i].x, next = blocks_[i].next;
    totals.Add(1, SquaresOf(rows.r));
    gradient_.states.row(x) += rows.r.transpose() * rows.J_x;
    squares.states.row(x) += rows.J_x.colwise().squaredNorm();
    if (next >= 0) {
      gradient_.states.row(next) += rows.r.transpose() * rows.J_next;
      squares.states.row(next) += rows.J_next.colwise().squaredNorm();
    }
    if (!blocks_[i].with_theta) continue;
    totals.Add(2, rows.J_theta.transpose() * rows.r);
    totals.Add(2 + n, rows.J_theta.colwise().squaredNorm());
  }
  const Eigen::VectorXd sums = totals.Over(all_);
  if (sums[0] > 0.0) return false;
  *cost = sums[1] + SquaresOf(shared_rows_.r);
  gradient_.theta = sums.segment(2, n);
  squares.theta = sums.tail(n);
  if (!shared_.empty()) {
    gradient_.theta += shared_rows_.J_theta.transpose() * shared_rows_.r;
    squares.theta += shared_rows_.J_theta.colwise().squaredNorm().transpose();
  }
  if (rescale) {
    scale_.theta = (1.0 + squares.theta.array().sqrt()).inverse();
    scale_.states = (1.0 + squares.states.array().sqrt()).inverse();
  }
  for (int i = 0; i < count; ++i) {
    const int next = blocks_[i].next;
    rows_[i].J_x *= scale_.states.row(blocks_[i].x).asDiagonal();
    rows_[i].J_theta *= scale_.theta.asDiagonal();
    if (next >= 0) rows_[i].J_next *= scale_.states.row(next).asDiagonal();
  }
  if (!shared_.empty()) shared_rows_.J_theta *= scale_.theta.asDiagonal();
  diagonal_.theta = squares.theta.cwiseProduct(scale_.theta.cwiseAbs2())
                        .cwiseMax(kLeastDiagonal)
                        .cwiseMin(kMostDiagonal);
  diagonal_.states = squares.states.cwiseProduct(scale_.states.cwiseAbs2())
                         .cwiseMax(kLeastDiagonal)
                         .cwiseMin(kMostDiagonal);
  return std::isfinite(*cost);
}

double SharedBlocks::SlopeAlong(const Point& direction) const {
  Totals total(1);
  for (int s = 0; s < gradient_.states.rows(); ++s) {
    total.Add(0, gradient_.states.row(s).dot(direction.states.row(s)));
  }
  return total.Over(all_)[0] + gradient_.theta.dot(direction.theta);
}

RunLinearization SharedBlocks::Damped(const std::vector<int>& chain,
                                      const RowMatrixXd& damping) const {
  const int n = static_cast<int>(theta_tangent_.cols());
  RunLinearization run;
  run.J_prior.setZero(tangent_, tangent_);
  run.r_prior.setZero(tangent_);
  const int prior = prior_of_[chain.front()];
  if (prior >= 0) {
    run.J_prior = rows_[prior].J_x;
    run.r_prior = rows_[prior].r;
  }
  for (size_t k = 0; k < chain.size(); ++k) {
    const int at = segment_of_[chain[k]];
    const int m = at >= 0 ? static_cast<int>(rows_[at].r.size()) : 0;
    const bool last = k + 1 == chain.size();
    SegmentLinearization segment;
    segment.J_x.setZero(m + tangent_, tangent_);
    segment.J_theta.setZero(m + tangent_, n);
    segment.J_next.setZero(m + tangent_, last ? 0 : tangent_);
    segment.r.setZero(m + tangent_);
    if (at >= 0) {
      segment.J_x.topRows(m) = rows_[at].J_x;
      segment.J_theta.topRows(m) = rows_[at].J_theta;
      if (!last) segment.J_next.topRows(m) = rows_[at].J_next;
      segment.r.head(m) = rows_[at].r;
    }
    segment.J_x.bottomRows(tangent_) = damping.row(chain[k]).asDiagonal();
    run.segments.push_back(std::move(segment));
  }
  return run;
}

// (S + J' J + D^2) dtheta = -(b + J' r), J and r of what is of theta alone.
Eigen::VectorXd SharedBlocks::SolveTheta(
    const std::vector<std::unique_ptr<RunReduction>>& chains,
    const Eigen::VectorXd& damping) const {
  const int n = static_cast<int>(damping.size());
  Totals totals(n * (n + 1));
  for (const auto& chain : chains) {
    const RowMatrixXd R = chain->root().leftCols(n);
    totals.Add(0, R.transpose() * R);
    totals.Add(n * n, R.transpose() * chain->root().col(n));
  }
  const Eigen::VectorXd sums = totals.Over(all_);
  Eigen::MatrixXd S = Eigen::Map<const Eigen::MatrixXd>(sums.data(), n, n);
  Eigen::VectorXd b = sums.tail(n);
  if (!shared_.empty()) {
    S += shared_rows_.J_theta.transpose() * shared_rows_.J_theta;
    b += shared_rows_.J_theta.transpose() * shared_rows_.r;
  }
  S.diagonal() += damping.cwiseAbs2();
  const Cholesky factor(S);
  if (!factor.Valid()) {
    return Eigen::VectorXd::Constant(n, std::nan(""));
  }
  return -factor.Solve(b);
}

bool SharedBlocks::Solve(double* radius, Point* step, double* falls) const {
  const int count = static_cast<int>(chains_.size());
  const int n = static_cast<int>(theta_tangent_.cols());
  const RowMatrixXd damping = (diagonal_.states / *radius).cwiseSqrt();
  std::vector<std::unique_ptr<RunReduction>> reductions(count);
  ParallelFor(count, threads_, [&](int c) {
    reductions[c] = std::make_unique<RunReduction>(Damped(chains_[c], damping));
    return true;
  });
  // Theta's step and the radius are those of the first process, wherever the
  // others round differently.
  Eigen::VectorXd agreed(n + 1);
  agreed << (n > 0 ? SolveTheta(reductions,
                                (diagonal_.theta / *radius).cwiseSqrt())
                   : Eigen::VectorXd()),
      *radius;
  agreed = OfFirst(all_, agreed);
  *radius = agreed[n];
  step->theta = agreed.head(n);
  step->states.resize(states_.size(), tangent_);
  ParallelFor(count, threads_, [&](int c) {
    const RowMatrixXd dx = reductions[c]->SubstituteBack(step->theta);
    for (size_t k = 0; k < chains_[c].size(); ++k) {
      step->states.row(chains_[c][k]) = dx.row(k);
    }
    return true;
  });
  const bool finite = step->theta.allFinite() && step->states.allFinite();
  // -(J s)' (r + J s / 2) is what the linear model gains.
  std::vector<double> gains(blocks_.size());
  ParallelFor(static_cast<int>(blocks_.size()), threads_, [&](int i) {
    const Eigen::VectorXd moved = Times(blocks_[i], rows_[i], *step);
    gains[i] = -moved.dot(rows_[i].r + 0.5 * moved);
    return true;
  });
  Totals totals(2);
  totals.Add(0, finite ? 0.0 : 1.0);
  for (const double gain : gains) totals.Add(1, finite ? gain : 0.0);
  const Eigen::VectorXd sums = totals.Over(all_);
  *falls = sums[1];
  if (!shared_.empty()) {
    const Eigen::VectorXd moved = shared_rows_.J_theta * step->theta;
    *falls -= moved.dot(shared_rows_.r + 0.5 * moved);
  }
  step->theta = step->theta.cwiseProduct(scale_.theta);
  step->states = step->states.cwiseProduct(scale_.states);
  return sums[0] == 0.0;
}

}  // namespace sysid
