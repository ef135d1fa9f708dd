#include "sysid/hypotheses/equation_error.h"

#include <algorithm>
#include <cmath>

#include "models/math/decompositions.h"
#include "sysid/hypotheses/constants.h"
#include "sysid/inverse_dynamics/equation_rows.h"

namespace sysid {
namespace {

// As few rows as say the same of squares: of joint v, of every nv-th row.
EquationPart PartOf(const EquationRows& all, int v) {
  const int columns = static_cast<int>(all.rows.cols());
  Eigen::MatrixXd rows(all.times(), columns);
  for (int k = 0; k < all.times(); ++k) {
    rows.row(k) = all.rows.row(k * all.nv + v);
  }
  if (all.times() <= columns) return {all.times(), rows};
  return {all.times(), HouseholderTriangle(rows)};
}

}  // namespace

EquationWindows::EquationWindows(const CoarseModel& model,
                                 const Excerpt& excerpt,
                                 const Excerpt::Change& change) {
  std::vector<Parameter> parameters;
  std::vector<double> theta;
  for (const FreeParameter& free : model.free) {
    parameters.push_back(free.parameter);
    theta.push_back(free.initial);
  }
  const ParameterMap map(model.model, parameters, false);
  const Seeding<Jet8> seeding = [&](int begin, MechanismParameters<Jet8>* out) {
    std::vector<Jet8> seeded(theta.begin(), theta.end());
    for (int c = 0; c < Jet8::DIMENSION && begin + c < map.size(); ++c) {
      seeded[begin + c].v[c] = 1.0;
    }
    map.Apply<Jet8>(seeded.data(), out);
  };
  const double period = excerpt.period_s();
  const EquationFilter filter = {
      std::max(hypotheses::kMotionWidth, hypotheses::kMotionSamples * period),
      std::max(hypotheses::kAverageWidth,
               hypotheses::kAverageSamples * period)};
  const double inner = Excerpt::kMargin - ReachOf(filter);
  for (const Run& window : excerpt.Windows(change, true)) {
    const EquationRows rows = MakeEquationRows<Jet8>(
        model.model,
        SampleMotion(model.model, window, window.t.front() + inner,
                     window.t.back() - inner, filter),
        map.size(), seeding);
    std::vector<EquationPart> parts;
    for (int v = 0; v < rows.nv; ++v) parts.push_back(PartOf(rows, v));
    windows_.push_back(std::move(parts));
    work_ += hypotheses::kJetWork * rows.work;
  }
}

double LeastEquationError(
    const std::vector<const std::vector<EquationPart>*>& windows) {
  // The weights of the joints settle to some per cent.
  constexpr int kIterations = 4;
  constexpr double kDependent = 1e-6;  // of columns, of length 1
  constexpr int kRowsEach = 3;         // of a number that is fitted
  constexpr double kNothing = 1e-9;    // rounding beside others
  if (windows.empty()) return INFINITY;
  const int joints = static_cast<int>(windows.front()->size());
  const int columns =
      static_cast<int>(windows.front()->front().triangle.cols());
  std::vector<int> counts(joints, 0);
  int rows = 0;
  RowMatrixXd largest = RowMatrixXd::Zero(joints, columns);
  for (const auto* window : windows) {
    for (int v = 0; v < joints; ++v) {
      const Eigen::MatrixXd& part = (*window)[v].triangle;
      counts[v] += (*window)[v].rows;
      rows += static_cast<int>(part.rows());
      if (part.rows() == 0) continue;
      largest.row(v) =
          largest.row(v).cwiseMax(part.cwiseAbs().colwise().maxCoeff());
    }
  }
  if (rows < columns) return INFINITY;
  // Every joint has more rows than the columns that act on it can fit.
  const Eigen::RowVectorXd of_all = largest.colwise().maxCoeff();
  for (int v = 0; v < joints; ++v) {
    const auto acting =
        (largest.row(v).array() > kNothing * of_all.array()).count();
    if (counts[v] < kRowsEach * acting) return INFINITY;
  }
  const int n = columns - 1;
  std::vector<double> size(joints, 1.0);
  double least = INFINITY;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::MatrixXd all(rows, columns);
    int at = 0;
    for (const auto* window : windows) {
      for (int v = 0; v < joints; ++v) {
        const Eigen::MatrixXd& part = (*window)[v].triangle;
        all.middleRows(at, part.rows()) = part / size[v];
        at += static_cast<int>(part.rows());
      }
    }
    Eigen::VectorXd change = Eigen::VectorXd::Ones(columns);
    if (n > 0) {
      // Columns of one size: what is dependent shows. One that is rounding
      // beside the others says nothing.
      Eigen::VectorXd scale = all.leftCols(n).colwise().norm();
      const double nothing = kNothing * scale.maxCoeff();
      for (double& s : scale) s = s > nothing ? 1.0 / s : 0.0;
      change.head(n) = -scale.cwiseProduct(ShortestLeastSquares(
          all.leftCols(n) * scale.asDiagonal(), all.col(n), kDependent));
    }
    std::vector<double> squares(joints, 0.0);
    for (const auto* window : windows) {
      for (int v = 0; v < joints; ++v) {
        squares[v] += ((*window)[v].triangle * change).squaredNorm();
      }
    }
    double log_sum = 0.0;
    for (int v = 0; v < joints; ++v) {
      size[v] = std::sqrt(squares[v] / counts[v]);
      if (!(size[v] > 0.0)) return INFINITY;
      log_sum += std::log(size[v]);
    }
    least = std::exp(log_sum / joints);
  }
  return least;
}

}  // namespace sysid
