#include "sysid/inverse_dynamics/regression.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "models/math/decompositions.h"
#include "sysid/estimation/parallel.h"
#include "sysid/inverse_dynamics/filter_choice.h"

namespace sysid {
namespace {

// Columns of length 1 that others give to this part are dependent: rounding of
// a motion that is known to 1e-6 of itself.
constexpr double kDependent = 1e-6;
// A column of less beside the longest says nothing.
constexpr double kNothing = 1e-10;

// The triangle of rows, without rows and columns of zeros: what a joint bears
// says nothing of the links before it.
RowMatrixXd TriangleOf(const RowMatrixXd& rows) {
  std::vector<int> columns;
  for (int c = 0; c < rows.cols(); ++c) {
    if (!rows.col(c).isZero(0.0)) columns.push_back(c);
  }
  const int n = static_cast<int>(columns.size());
  if (rows.rows() == 0 || n == 0) return RowMatrixXd(0, rows.cols());
  const Eigen::MatrixXd some = rows(Eigen::all, columns);
  const Eigen::MatrixXd R = HouseholderTriangle(some);
  RowMatrixXd triangle = RowMatrixXd::Zero(R.rows(), rows.cols());
  triangle(Eigen::all, columns) = R;
  return triangle;
}

// By joint, those of all processes.
std::vector<std::array<RowMatrixXd, 2>> MergeTriangles(
    const Processes& all,
    const std::vector<std::array<RowMatrixXd, 2>>& triangles) {
  Packer own;
  for (const auto& of_joint : triangles) {
    for (const RowMatrixXd& triangle : of_joint) own.Put(triangle);
  }
  const std::vector<std::string> texts = all.Gather(own.bytes());
  std::vector<Unpacker> unpackers(texts.begin(), texts.end());
  Packer merged;
  for (size_t i = 0; !texts.empty() && i < 2 * triangles.size(); ++i) {
    RowMatrixXd rows(0, triangles[0][0].cols());
    for (Unpacker& unpacker : unpackers) {
      const RowMatrixXd more = unpacker.Matrix();
      rows.conservativeResize(rows.rows() + more.rows(), Eigen::NoChange);
      rows.bottomRows(more.rows()) = more;
    }
    merged.Put(TriangleOf(rows));
  }
  const std::string bytes = all.Share(merged.bytes());
  Unpacker unpacker(bytes);
  std::vector<std::array<RowMatrixXd, 2>> out(triangles.size());
  for (auto& of_joint : out) {
    for (RowMatrixXd& triangle : of_joint) triangle = unpacker.Matrix();
  }
  return out;
}

// Blocks of a run of n times: as long as errors are correlated, which the more
// times the better is known (Kuensch 1989), but two, to tell errors at all.
int Blocks(int n) {
  const int blocks = static_cast<int>(n / (2.0 * std::cbrt(n) + 1.0));
  return std::max(blocks, std::min(n, 2));
}

}  // namespace

EquationRegression::EquationRegression(int joints, int columns,
                                       std::vector<EquationRows> runs,
                                       std::vector<int> undriven,
                                       RobustLoss loss, double loss_scale,
                                       int threads, const Processes& all)
    : runs_(std::move(runs)),
      loss_(loss),
      loss_scale_(loss_scale),
      threads_(threads),
      all_(&all),
      columns_(columns),
      joints_(joints) {
  for (const EquationRows& run : runs_) {
    weights_.push_back(Eigen::VectorXd::Ones(run.rows.rows()));
    times_ += run.times();
  }
  times_ = static_cast<int>(SumOver(all, times_));
  // What there is to explain: efforts, and accelerations.
  sigma_ = EffortSize();
  if (!undriven.empty()) {
    Totals squares(joints_);
    for (const EquationRows& run : runs_) {
      squares.Add(0, run.qdd.colwise().squaredNorm());
    }
    const Eigen::VectorXd qdd =
        (squares.Over(all) / std::max(1, times_)).cwiseSqrt();
    for (const int v : undriven) sigma_[v] = qdd[v];
  }
  const double most = sigma_.maxCoeff();
  wider_.setOnes(joints_);
  for (double& s : sigma_) s = s > 1e-9 * most ? s : most > 0 ? most : 1.0;
  Triangularise();
}

void EquationRegression::Triangularise() {
  triangles_.assign(joints_, {});
  ParallelFor(joints_, threads_, [&](int v) {
    std::array<RowMatrixXd, 2> rows;
    std::array<int, 2> count = {0, 0};
    for (const EquationRows& run : runs_) {
      const int rests = static_cast<int>(run.rests.col(v).count());
      count[0] += run.times() - rests;
      count[1] += rests;
    }
    for (int g = 0; g < 2; ++g) rows[g].resize(count[g], columns_ + 1);
    count = {0, 0};
    for (size_t r = 0; r < runs_.size(); ++r) {
      for (int k = 0; k < runs_[r].times(); ++k) {
        const int row = k * joints_ + v, g = runs_[r].rests(k, v) ? 1 : 0;
        rows[g].row(count[g]++) = weights_[r][row] * runs_[r].rows.row(row);
      }
    }
    triangles_[v] = {TriangleOf(rows[0]), TriangleOf(rows[1])};
    return true;
  });
  if (all_->size() > 1) triangles_ = MergeTriangles(*all_, triangles_);
}

RowMatrixXd EquationRegression::Merge() const {
  RowMatrixXd all(0, columns_ + 1);
  const auto append = [&](const RowMatrixXd& rows) {
    all.conservativeResize(all.rows() + rows.rows(), Eigen::NoChange);
    all.bottomRows(rows.rows()) = rows;
  };
  for (int v = 0; v < joints_; ++v) {
    append(triangles_[v][0] / sigma_[v]);
    append(triangles_[v][1] / (sigma_[v] * wider_[v]));
  }
  if (held_.size() > 0) {
    RowMatrixXd held = RowMatrixXd::Zero(1, columns_ + 1);
    held.leftCols(columns_) = held_;
    append(held);
  }
  const Eigen::MatrixXd R = HouseholderTriangle(all);
  RowMatrixXd square = RowMatrixXd::Zero(columns_ + 1, columns_ + 1);
  square.topRows(R.rows()) = R;
  return square;
}

bool EquationRegression::IsHomogeneous(const Eigen::VectorXd& xi0) const {
  constexpr double kRounding = 1e-9;
  // Squares of R diag(xi0) and of R xi0, without merging R.
  double most = 0.0, sum = 0.0;
  for (int v = 0; v < joints_; ++v) {
    for (int g = 0; g < 2; ++g) {
      const auto R = triangles_[v][g].leftCols(columns_);
      const double s = g == 0 ? sigma_[v] : sigma_[v] * wider_[v];
      most += (R * xi0.asDiagonal()).squaredNorm() / (s * s);
      sum += (R * xi0).squaredNorm() / (s * s);
    }
  }
  return most > 0.0 && sum < kRounding * kRounding * most;
}

void EquationRegression::NormaliseByGain(const std::vector<int>& gains,
                                         const Eigen::VectorXd& xi0) {
  if (std::all_of(gains.begin(), gains.end(), [](int g) { return g < 0; })) {
    return;
  }
  for (EquationRows& run : runs_) sysid::NormaliseByGain(gains, xi0, &run);
  Triangularise();
}

void EquationRegression::HoldScale(const EquationRegression& inertial,
                                   const Eigen::VectorXd& xi0) {
  const RowMatrixXd triangle = inertial.Triangle();
  const Eigen::RowVectorXd a = (triangle.leftCols(columns_) * xi0).transpose() *
                               triangle.leftCols(columns_);
  // What is left is 1 a row: beside that a scale that is off by 1 % is much.
  constexpr double kFirm = 10.0;
  const double rows = static_cast<double>(times_) * joints_;
  held_ = kFirm * std::sqrt(rows) / a.dot(xi0) * a;
}

RowMatrixXd EquationRegression::Triangle() const {
  return Merge().topRows(columns_);
}

Eigen::VectorXd EquationRegression::Left(const Eigen::VectorXd& d) const {
  Totals squares(joints_);
  for (const EquationRows& run : runs_) {
    const Eigen::VectorXd left =
        run.rows.leftCols(columns_) * d + run.rows.col(columns_);
    for (int k = 0; k < run.times(); ++k) {
      squares.Add(0, left.segment(k * joints_, joints_).cwiseAbs2());
    }
  }
  return (squares.Over(*all_) / std::max(1, times_)).cwiseSqrt();
}

double EquationRegression::HalfSquares(
    const std::vector<Eigen::VectorXd>& rows) const {
  double squares = 0.0;
  for (size_t r = 0; r < runs_.size(); ++r) {
    for (int i = 0; i < rows[r].size(); ++i) {
      const double weighted = weights_[r][i] * rows[r][i] /
                              Sigma(runs_[r], i / joints_, i % joints_);
      squares += weighted * weighted;
    }
  }
  return 0.5 * SumOver(*all_, squares);
}

Eigen::VectorXd EquationRegression::EffortSize() const {
  Totals squares(joints_);
  for (const EquationRows& run : runs_) {
    squares.Add(0, run.effort.colwise().squaredNorm());
  }
  return (squares.Over(*all_) / std::max(1, times_)).cwiseSqrt();
}

void EquationRegression::Reweigh(const Eigen::VectorXd& d) {
  // Even weights for a fifth of the rows that are twice as far off make a
  // standard error a sixth wider, and keep what gravity says while a joint
  // rests: of axis 2 of staubli_tx40 12 instead of 16 % are left in the last
  // quarter.
  constexpr double kMuch = 2.0;
  // By joint; where it slips, and where it may rest.
  Totals totals(4 * joints_);  // squares, and their number
  std::vector<Eigen::VectorXd> errors;
  for (const EquationRows& run : runs_) {
    errors.push_back(run.rows.leftCols(columns_) * d + run.rows.col(columns_));
    for (int i = 0; i < errors.back().size(); ++i) {
      const int v = i % joints_, rests = run.rests(i / joints_, v) ? 1 : 0;
      totals.Add(v + rests * joints_, errors.back()[i] * errors.back()[i]);
      totals.Add(v + (2 + rests) * joints_, 1.0);
    }
  }
  const Eigen::VectorXd sums = totals.Over(*all_);
  const Eigen::Map<const Eigen::MatrixX2d> squares(sums.data(), joints_, 2);
  const Eigen::Map<const Eigen::MatrixX2d> count(sums.data() + 2 * joints_,
                                                 joints_, 2);
  Eigen::MatrixX2d left =
      squares.cwiseQuotient(count.cwiseMax(1.0)).cwiseSqrt();
  for (int v = 0; v < joints_; ++v) {
    if (count(v, 0) == 0.0) left(v, 0) = left(v, 1);
  }
  // What is left of a joint that nothing moves is rounding, and no weight.
  const double least = 1e-9 * left.col(0).maxCoeff();
  for (int v = 0; v < joints_; ++v) sigma_[v] = std::max(left(v, 0), least);
  if (!(sigma_.minCoeff() > 0.0)) sigma_.setOnes();
  for (int v = 0; v < joints_; ++v) {
    wider_[v] = left(v, 1) > kMuch * sigma_[v] ? left(v, 1) / sigma_[v] : 1.0;
  }
  if (loss_ == RobustLoss::kNone) return;
  for (size_t r = 0; r < runs_.size(); ++r) {
    for (int i = 0; i < errors[r].size(); ++i) {
      const double s = errors[r][i] / Sigma(runs_[r], i / joints_, i % joints_);
      double rho, rho_prime;
      EvaluateLoss(loss_, loss_scale_, s * s, &rho, &rho_prime);
      weights_[r][i] = std::sqrt(rho_prime);
    }
  }
  Triangularise();
}

RowMatrixXd EquationRegression::ErrorRoot(const RowMatrixXd& triangle,
                                          const Eigen::VectorXd& d) const {
  const auto R = triangle.leftCols(columns_);
  // The columns as the data determines them, of unit information: R P = U.
  Eigen::VectorXd scale = R.colwise().norm().transpose();
  for (double& s : scale) s = s > 0.0 ? 1.0 / s : 0.0;
  const SingularValues svd = SingularValuesOf(R * scale.asDiagonal());
  const Eigen::VectorXd& size = svd.s;
  int rank = 0;
  while (rank < size.size() && size[rank] > kDependent * size[0]) ++rank;
  if (rank == 0) return RowMatrixXd(R.rows(), 0);
  const Eigen::MatrixXd P = scale.asDiagonal() * svd.V.leftCols(rank) *
                            size.head(rank).cwiseInverse().asDiagonal();
  // Beside 1 a block's own information, where it is all of it.
  constexpr double kRounding = 1e-6;
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(rank, rank);
  for (size_t r = 0; r < runs_.size(); ++r) {
    const EquationRows& run = runs_[r];
    const int n = run.times(), blocks = Blocks(n);
    Eigen::MatrixXd moved(rank, blocks);
    ParallelFor(blocks, threads_, [&](int b) {
      const int from = n * b / blocks, to = n * (b + 1) / blocks;
      RowMatrixXd rows =
          run.rows.middleRows(from * joints_, (to - from) * joints_);
      for (int i = 0; i < rows.rows(); ++i) {
        const int row = from * joints_ + i;
        rows.row(i) *=
            weights_[r][row] / Sigma(run, row / joints_, row % joints_);
      }
      const Eigen::VectorXd left =
          rows.leftCols(columns_) * d + rows.col(columns_);
      const Eigen::MatrixXd U = rows.leftCols(columns_) * P;
      Eigen::MatrixXd others =
          (1.0 + kRounding) * Eigen::MatrixXd::Identity(rank, rank);
      others.selfadjointView<Eigen::Lower>().rankUpdate(U.transpose(), -1.0);
      moved.col(b) =
          Cholesky(others).Solve(Eigen::VectorXd(U.transpose() * left));
      return true;
    });
    S.noalias() += moved * moved.transpose();
  }
  const SymmetricEigen eigen = EigenOfSymmetric(S);
  // Few times do not show all of S.
  constexpr double kLeast = 0.05;
  return svd.U.leftCols(rank) * eigen.vectors *
         eigen.values.cwiseMax(kLeast).cwiseSqrt().asDiagonal();
}

std::vector<int> UndrivenJoints(const ShootingProblem& problem) {
  const int nv = problem.model().nv();
  Totals size(nv);
  for (const auto& data : problem.runs()) {
    if (data->run.effort.size() > 0) {
      size.Add(0, data->run.effort.cwiseAbs().colwise().maxCoeff());
    }
  }
  const Eigen::VectorXd most = size.Over(problem.processes());
  std::vector<int> undriven;
  for (int v = 0; v < nv; ++v) {
    if (most[v] == 0.0) undriven.push_back(v);
  }
  return undriven;
}

std::vector<int> EffortGains(const Model& model,
                             const std::vector<int>& undriven,
                             const std::vector<std::string>& names) {
  std::vector<int> gains(model.nv(), -1);
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    if (!(effect.hooks() & kInputHook)) continue;
    const auto at =
        std::find(names.begin(), names.end(), effect.ParameterNames()[0]);
    if (at == names.end()) continue;
    const Joint& joint = model.mechanism().joints[effect.joint()];
    std::fill_n(gains.begin() + joint.v_index, VelocitySize(joint.type),
                static_cast<int>(at - names.begin()));
  }
  for (const int v : undriven) gains[v] = -1;
  return gains;
}

void NormaliseByGain(const std::vector<int>& gains, const Eigen::VectorXd& xi0,
                     EquationRows* rows) {
  const Eigen::Index columns = rows->rows.cols() - 1;
  for (int i = 0; i < rows->rows.rows(); ++i) {
    const int gain = gains[i % rows->nv];
    // Where nothing of the measured effort is left, it does not say how much
    // more the model needs.
    if (gain < 0 || xi0[gain] == -1.0) continue;
    const double factor = 1.0 / (1.0 + xi0[gain]);
    rows->rows.row(i) *= factor;
    rows->rows(i, gain) -= factor * rows->rows(i, columns);
  }
}

ShootingProblem WithRowsInMemory(const ShootingProblem& problem, double most) {
  const Model& model = problem.model();
  const EquationCoordinates coordinates(model, problem.map().parameters());
  const double of_sample = model.nv() * (coordinates.size() + 1.0);
  const DataSet& data = problem.data();
  return data.samples() * of_sample <= most
             ? problem
             : problem.WithData(data.Part(most / of_sample));
}

EquationFilter ChooseFilter(const ShootingProblem& problem,
                            const MechanismParameters<double>& values) {
  const ShootingProblem part = WithRowsInMemory(problem);
  std::vector<const Run*> runs;
  for (const auto& data : part.runs()) runs.push_back(&data->run);
  const Processes& all = problem.processes();
  return ChooseFilter(problem.model(), values, runs, FirstFilter(runs, all),
                      problem.options().threads, all);
}

void Silence(const std::vector<int>& joints, EquationRows* rows) {
  for (const int v : joints) {
    for (int k = 0; k < rows->times(); ++k) {
      rows->rows.row(k * rows->nv + v).setZero();
    }
  }
}

std::vector<SampledMotion> SampleRuns(const ShootingProblem& problem,
                                      const EquationFilter& filter) {
  const EstimationOptions& options = problem.options();
  const int runs = static_cast<int>(problem.runs().size());
  const int threads = ThreadsOfEach(runs, options.threads);
  std::vector<SampledMotion> sampled(runs);
  ParallelFor(runs, options.threads, options.stop, [&](int r) {
    sampled[r] =
        SampleMotion(problem.model(), problem.runs()[r]->run, filter, threads);
    return true;
  });
  return sampled;
}

EquationRegression RegressEquations(const ShootingProblem& problem,
                                    const EquationCoordinates& coordinates,
                                    const std::vector<SampledMotion>& sampled,
                                    const MechanismParameters<double>& values,
                                    const std::vector<int>& undriven) {
  const EstimationOptions& options = problem.options();
  const Seeding<Jet24> seeding = [&](int begin, MechanismParameters<Jet24>* s) {
    coordinates.Seed(values, begin, s);
  };
  const PlainPart plain{values, coordinates.Links(), undriven};
  const int runs = static_cast<int>(sampled.size());
  const int threads = ThreadsOfEach(runs, options.threads);
  std::vector<EquationRows> rows(runs);
  ParallelFor(runs, options.threads, options.stop, [&](int r) {
    rows[r] =
        MakeEquationRows<Jet24>(problem.model(), sampled[r], coordinates.size(),
                                seeding, plain, threads);
    Silence(options.no_efforts, &rows[r]);
    return true;
  });
  return EquationRegression(
      problem.model().nv(), coordinates.size(), std::move(rows), undriven,
      options.loss, options.loss_scale, options.threads, problem.processes());
}

Eigen::VectorXd SolveUnconstrained(const RowMatrixXd& triangle, int* rank) {
  const int n = static_cast<int>(triangle.cols()) - 1;
  Eigen::VectorXd scale = triangle.leftCols(n).colwise().norm().transpose();
  const double nothing = kNothing * (n > 0 ? scale.maxCoeff() : 0.0);
  for (double& s : scale) s = s > nothing ? 1.0 / s : 0.0;
  return -scale.cwiseProduct(
      ShortestLeastSquares(triangle.leftCols(n) * scale.asDiagonal(),
                           triangle.col(n), kDependent, rank));
}

}  // namespace sysid
