#include "sysid/diagnosis/linearized_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/fit.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/shooting_stage.h"

namespace sysid {
namespace {

// The pseudo-inverse of a symmetric N = Theta' Theta, with columns scaled to
// length 1: directions below `kTolerance` (squared lengths) are undetermined.
Eigen::MatrixXd PseudoInverse(const Eigen::MatrixXd& N, int* rank) {
  constexpr double kTolerance = 1e-12;
  const int n = static_cast<int>(N.rows());
  *rank = 0;
  if (n == 0) return N;
  Eigen::VectorXd scale(n);
  for (int i = 0; i < n; ++i) {
    scale[i] = N(i, i) > 0 ? 1.0 / std::sqrt(N(i, i)) : 0.0;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      scale.asDiagonal() * N * scale.asDiagonal());
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    if (!(eigen.eigenvalues()[i] > kTolerance)) continue;
    const Eigen::VectorXd v = scale.asDiagonal() * eigen.eigenvectors().col(i);
    inverse += v * v.transpose() / eigen.eigenvalues()[i];
    ++*rank;
  }
  return inverse;
}

}  // namespace

LinearizedFit::LinearizedFit(const ShootingProblem& problem,
                             const ShootingPoint& point,
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
          samples[k], samples[k + 1], problem.options().rollout);
      if (segment->rollout->num_residuals() == 0) continue;
      segments_.push_back(std::move(segment));
    }
  }
  valid_ =
      ParallelFor(static_cast<int>(segments_.size()), problem.options().threads,
                  [&](int i) { return Linearize(segments_[i].get()); });
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

bool LinearizedFit::Linearize(Segment* segment) const {
  const Model& model = problem_.model();
  const RunData& data = *problem_.runs()[segment->run];
  const SegmentRollout& rollout = *segment->rollout;
  SegmentTangent& tangent = segment->tangent;
  if (!LinearizeAlong(
          rollout, point_.runs[segment->run].states.row(segment->index).data(),
          point_.theta.data(), &tangent)) {
    return false;
  }
  const int rows = rollout.num_residuals(), n = model.tangent_size();
  segment->weight.resize(rows);
  const EstimationOptions& options = problem_.options();
  for (const SegmentRow& row : rollout.rows()) {
    const double sigma = data.sigma[row.channel];
    const double s =
        tangent.r.segment(row.first, row.size).squaredNorm() / (sigma * sigma);
    double rho = s, slope = 1.0;
    EvaluateLoss(options.loss, options.loss_scale, s, &rho, &slope);
    segment->weight.segment(row.first, row.size)
        .setConstant(std::sqrt(slope) / sigma);
  }
  // The columns of S: (7.1) without forces, from dx_0 = 1.
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(rows + n, n);
  RowMatrixXd phi = RowMatrixXd::Identity(n, n);
  size_t row = 0;
  for (int k = rollout.first(); k <= rollout.last(); ++k) {
    for (; row < rollout.rows().size() && rollout.rows()[row].sample == k;
         ++row) {
      const SegmentRow& at = rollout.rows()[row];
      S.middleRows(at.first, at.size) =
          tangent.C.middleRows(at.first, at.size) * phi;
    }
    if (k < rollout.last()) phi = tangent.A[k - rollout.first()] * phi;
  }
  S.topRows(rows) = segment->weight.asDiagonal() * S.topRows(rows);
  const std::vector<double> belief = StateBelief(problem_, kHeldSpin);
  for (int i = 0; i < n; ++i) S(rows + i, i) = 1.0 / belief[i];
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(S);
  segment->basis = qr.householderQ() * Eigen::MatrixXd::Identity(rows + n, n);
  segment->R = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
  const int count = problem_.map().size();
  ParameterForces forces = ParameterForces::Zero(rollout, count);
  AddParameterForces(model, problem_.map(), point_.theta, rollout, tangent, 0,
                     &forces);
  const Eigen::MatrixXd theta =
      WithoutStates(*segment, Respond(*segment, forces));
  segment->theta = theta(Eigen::all, kept_);
  segment->r = WithoutStates(
      *segment, segment->weight.asDiagonal() * Eigen::MatrixXd(tangent.r));
  segment->r += theta * moved_;
  return true;
}

Eigen::MatrixXd LinearizedFit::Respond(const Segment& segment,
                                       const ParameterForces& forces) const {
  const SegmentRollout& rollout = *segment.rollout;
  const SegmentTangent& tangent = segment.tangent;
  const int columns = static_cast<int>(forces.direct.cols());
  RowMatrixXd out = forces.direct;
  RowMatrixXd dx = RowMatrixXd::Zero(problem_.model().tangent_size(), columns);
  size_t row = 0;
  for (int k = rollout.first(); k <= rollout.last(); ++k) {
    for (; row < rollout.rows().size() && rollout.rows()[row].sample == k;
         ++row) {
      const SegmentRow& at = rollout.rows()[row];
      out.middleRows(at.first, at.size) +=
          tangent.C.middleRows(at.first, at.size) * dx;
    }
    if (k == rollout.last()) break;
    const int i = k - rollout.first();
    dx = (tangent.A[i] * dx + tangent.B[i] * forces.f[i]).eval();
  }
  return segment.weight.asDiagonal() * out;
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
  const int n = static_cast<int>(kept_.size());
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(n, n);
  for (const auto& segment : segments_) {
    N.noalias() += segment->theta.transpose() * segment->theta;
  }
  for (int i = 0; i < n; ++i) {
    const auto& prior = problem_.free()[kept_[i]].prior;
    if (prior) N(i, i) += 1.0 / (prior->std * prior->std);
  }
  theta_inverse_ = PseudoInverse(N, &theta_rank_);
  std::vector<Eigen::MatrixXd> r;
  for (const auto& segment : segments_) r.push_back(segment->r);
  ProjectOutTheta(&r);
  for (size_t s = 0; s < segments_.size(); ++s) segments_[s]->r = r[s];
}

void LinearizedFit::ProjectOutTheta(
    std::vector<Eigen::MatrixXd>* columns) const {
  if (columns->empty() || theta_inverse_.size() == 0) return;
  // Twice: once loses what the conditioning of Theta' Theta loses.
  for (int pass = 0; pass < 2; ++pass) {
    Eigen::MatrixXd inner =
        Eigen::MatrixXd::Zero(theta_inverse_.rows(), columns->front().cols());
    for (size_t s = 0; s < segments_.size(); ++s) {
      inner.noalias() += segments_[s]->theta.transpose() * (*columns)[s];
    }
    inner = theta_inverse_ * inner;
    for (size_t s = 0; s < segments_.size(); ++s) {
      (*columns)[s].noalias() -= segments_[s]->theta * inner;
    }
  }
}

double LinearizedFit::DegreesOfFreedom() const {
  double dof = -theta_rank_;
  for (const auto& segment : segments_) {
    dof -= ObservedStateDof(problem_);
    const auto& residuals = segment->rollout->measurements().residuals;
    for (const SegmentRow& row : segment->rollout->rows()) {
      dof += ResidualDof(residuals[row.channel]);
    }
  }
  return std::max(1.0, dof);
}

double LinearizedFit::SumOfSquares() const {
  double sum = 0.0;
  for (const auto& segment : segments_) sum += segment->r.squaredNorm();
  return sum;
}

}  // namespace sysid
