#include "sysid/linearization/linearized_fit.h"

#include <algorithm>
#include <cmath>

#include "glog/logging.h"
#include "models/math/decompositions.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {
namespace {

// V with V V' the pseudo-inverse of a symmetric N = Theta' Theta, a column for
// each direction that is determined: with the columns of Theta scaled to length
// 1, directions below `kTolerance` (squared lengths) are not.
Eigen::MatrixXd InverseRoot(const Eigen::MatrixXd& N) {
  constexpr double kTolerance = 1e-12;
  const int n = static_cast<int>(N.rows());
  if (n == 0) return N;
  Eigen::VectorXd scale(n);
  for (int i = 0; i < n; ++i) {
    scale[i] = N(i, i) > 0 ? 1.0 / std::sqrt(N(i, i)) : 0.0;
  }
  const SymmetricEigen eigen =
      EigenOfSymmetric(scale.asDiagonal() * N * scale.asDiagonal());
  // Eigenvalues come in rising order.
  const int rank =
      static_cast<int>((eigen.values.array() > kTolerance).count());
  return scale.asDiagonal() * eigen.vectors.rightCols(rank) *
         eigen.values.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
}

}  // namespace

LinearizedFit::LinearizedFit(const ShootingProblem& problem,
                             const Solution& point,
                             const std::map<std::string, double>& taken_back)
    : problem_(problem), point_(point) {
  if (!TakeBack(taken_back)) return;
  for (size_t r = 0; r < point.runs.size(); ++r) {
    for (int k = 0; k < point.runs[r].segments(); ++k) {
      auto segment = std::make_unique<Segment>();
      segment->run = static_cast<int>(r);
      segment->index = k;
      const auto& samples = point.runs[r].samples;
      segment->rollout = std::make_unique<SegmentRollout>(
          &problem.model(), &problem.map(), &problem.runs()[r]->measurements,
          samples[k], samples[k + 1], point.rollout);
      if (segment->rollout->num_residuals() == 0) continue;
      segments_.push_back(std::move(segment));
    }
  }
  ScratchPool pool;
  valid_ = AllTrue(
      problem.processes(),
      ParallelFor(static_cast<int>(segments_.size()), problem.options().threads,
                  problem.options().stop,
                  [&](int i) { return Linearize(segments_[i].get(), &pool); }));
  if (valid_) ProjectResiduals();
}

// False where what is taken back leaves no possible body.
bool LinearizedFit::TakeBack(const std::map<std::string, double>& taken_back) {
  const int n = problem_.map().size();
  Eigen::VectorXd values(n), back(n);
  problem_.map().ValuesOf(point_.theta.data(), values.data());
  for (int i = 0; i < n; ++i) {
    const auto at = taken_back.find(problem_.free()[i].parameter.name);
    if (at == taken_back.end()) {
      kept_.push_back(i);
    } else {
      values[i] = at->second;
    }
  }
  if (!problem_.map().ThetaOf(values, &back)) return false;
  moved_ = back - point_.theta;
  // Those of Theta follow the data by themselves.
  for (const int i : kept_) moved_[i] = 0.0;
  return true;
}

bool LinearizedFit::Linearize(Segment* segment, ScratchPool* pool) const {
  const SegmentRollout& rollout = *segment->rollout;
  const int rows = rollout.num_residuals();
  const int n = problem_.model().tangent_size();
  segment->errors.resize(rows);
  std::vector<double> x_end(problem_.model().state_size());
  RowMatrixXd J, J_end;
  std::unique_ptr<SegmentScratch> scratch = pool->Take();
  const bool ok = rollout.Linearize(StateOf(*segment), point_.theta.data(),
                                    true, segment->errors.data(), x_end.data(),
                                    &J, &J_end, scratch.get());
  pool->Give(std::move(scratch));
  if (!ok) return false;
  segment->whitened = segment->errors;
  MakeWhitening(problem_, segment->run, rollout)
      .Apply(segment->whitened.data(), {});
  const Eigen::MatrixXd columns = Whiten(*segment, std::move(J));
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(rows + n, n);
  S.topRows(rows) = columns.leftCols(n);
  const bool at_start = point_.runs[segment->run].samples[segment->index] == 0;
  const std::vector<double> belief =
      at_start
          ? BeliefAtStart(problem_, segment->run, kHeldSpin, StateOf(*segment))
                .sigma
          : StateBelief(problem_, kHeldSpin);
  for (int i = 0; i < n; ++i) S(rows + i, i) = 1.0 / belief[i];
  const HouseholderFactors qr(S);
  segment->basis = qr.Q();
  segment->R = qr.R();
  const Eigen::MatrixXd theta =
      WithoutStates(*segment, columns.rightCols(columns.cols() - n));
  segment->theta = theta(Eigen::all, kept_);
  segment->r = WithoutStates(*segment, segment->whitened);
  segment->r += theta * moved_;
  return true;
}

Eigen::MatrixXd LinearizedFit::Whiten(const Segment& segment,
                                      RowMatrixXd columns) const {
  Eigen::VectorXd r = segment.errors;
  MakeWhitening(problem_, segment.run, *segment.rollout)
      .Apply(r.data(), {Eigen::Map<RowMatrixXd>(columns.data(), columns.rows(),
                                                columns.cols())});
  return columns;
}

RowMatrixXd LinearizedFit::StatesAlong(const Segment& segment) const {
  const SegmentRollout& rollout = *segment.rollout;
  const int size = problem_.model().state_size();
  std::vector<double> errors(rollout.num_residuals()), x_end(size), visited;
  CHECK(rollout(StateOf(segment), point_.theta.data(), errors.data(),
                x_end.data(), &visited));
  return Eigen::Map<const RowMatrixXd>(
      visited.data(), static_cast<int>(visited.size()) / size, size);
}

Eigen::MatrixXd LinearizedFit::WithoutStates(
    const Segment& segment, const Eigen::MatrixXd& columns) const {
  const int rows = segment.rows();
  const int n = static_cast<int>(segment.basis.rows()) - rows;
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(rows + n, columns.cols());
  out.topRows(rows) = columns;
  out.noalias() -= segment.basis *
                   (segment.basis.topRows(rows).transpose() * columns).eval();
  return out;
}

Eigen::VectorXd LinearizedFit::StateAgainst(
    const Segment& segment, const Eigen::VectorXd& errors) const {
  return -segment.R.triangularView<Eigen::Upper>().solve(
      segment.basis.topRows(segment.rows()).transpose() * errors);
}

void LinearizedFit::ProjectResiduals() {
  std::vector<Eigen::MatrixXd> theta, r;
  for (const auto& segment : segments_) {
    theta.push_back(segment->theta);
    r.push_back(segment->r);
  }
  theta_ = Span(theta);
  ProjectOutTheta(&r);
  for (size_t s = 0; s < segments_.size(); ++s) segments_[s]->r = r[s];
}

ThetaBasis LinearizedFit::Span(
    const std::vector<Eigen::MatrixXd>& theta) const {
  Eigen::VectorXd prior = Eigen::VectorXd::Zero(kept_.size());
  for (size_t i = 0; i < kept_.size(); ++i) {
    const auto& belief = problem_.free()[kept_[i]].prior;
    if (belief) prior[i] = 1.0 / (belief->std * belief->std);
  }
  ThetaBasis basis;
  basis.Span(theta, prior, problem_.processes());
  return basis;
}

void ThetaBasis::Span(const std::vector<Eigen::MatrixXd>& theta,
                      const Eigen::VectorXd& prior, const Processes& all) {
  const int n = static_cast<int>(prior.size());
  Totals totals(n * n);
  for (const Eigen::MatrixXd& part : theta) {
    totals.Add(0, part.transpose() * part);
  }
  Eigen::MatrixXd N = totals.Over(all).reshaped(n, n);
  N += prior.asDiagonal();
  const Eigen::MatrixXd V = InverseRoot(N);
  rank_ = static_cast<int>(V.cols());
  // Theta V is orthonormal but for what the conditioning of N loses; the
  // Cholesky factor of what its product is mends that.
  Totals products(rank_ * rank_);
  columns_.clear();
  for (const Eigen::MatrixXd& part : theta) {
    columns_.push_back(part * V);
    products.Add(0, columns_.back().transpose() * columns_.back());
  }
  Eigen::MatrixXd product = products.Over(all).reshaped(rank_, rank_);
  product += V.transpose() * prior.asDiagonal() * V;
  const Cholesky factor(product);
  for (Eigen::MatrixXd& part : columns_) {
    factor.SolveLTransposedRight(part);
  }
}

void ThetaBasis::ProjectOut(const Processes& all, int threads,
                            std::vector<Eigen::MatrixXd>* columns) const {
  if (rank_ == 0) return;
  const int count = static_cast<int>(columns_.size());
  const int width = static_cast<int>(
      MaxOver(all, columns->empty() ? 0.0 : columns->front().cols()));
  std::vector<Eigen::MatrixXd> inner(count);
  ParallelFor(count, threads, [&](int s) {
    inner[s].noalias() = columns_[s].transpose() * (*columns)[s];
    return true;
  });
  Totals totals(rank_ * width);
  for (const Eigen::MatrixXd& one : inner) totals.Add(0, one);
  const Eigen::MatrixXd sum = totals.Over(all).reshaped(rank_, width);
  ParallelFor(count, threads, [&](int s) {
    (*columns)[s].noalias() -= columns_[s] * sum;
    return true;
  });
}

double LinearizedFit::Segment::numbers() const {
  const auto& residuals = rollout->measurements().residuals;
  double numbers = 0.0;
  for (const SegmentRow& row : rollout->rows()) {
    numbers += ResidualDof(residuals[row.channel]);
  }
  return numbers;
}

double LinearizedFit::DegreesOfFreedom() const {
  double dof = 0.0;
  for (const auto& segment : segments_) {
    dof += segment->numbers() - ObservedStateDof(problem_);
  }
  return std::max(1.0, SumOver(problem_.processes(), dof) - theta_.rank());
}

double LinearizedFit::SumOfSquares() const {
  double sum = 0.0;
  for (const auto& segment : segments_) sum += segment->r.squaredNorm();
  return sum;
}

double LinearizedFit::AutocorrelationTime() const {
  std::vector<std::vector<WhitenedSeries>> runs(problem_.runs().size());
  for (const auto& segment : segments_) {
    runs[segment->run].push_back(WhitenErrors(*problem_.runs()[segment->run],
                                              *segment->rollout,
                                              segment->errors.data()));
  }
  return sysid::AutocorrelationTime(runs);
}

}  // namespace sysid
