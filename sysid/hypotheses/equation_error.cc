#include "sysid/hypotheses/equation_error.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "models/dynamics.h"
#include "residuals/acting_effort.h"
#include "sysid/hypotheses/constants.h"

namespace sysid {
namespace {

constexpr int kWidth = 8;       // of the Jets
constexpr double kReach = 2.5;  // widths, of a Gaussian

double Weight(double distance) { return std::exp(-0.5 * distance * distance); }

// What moves at a time.
struct Point {
  bool known = false;
  std::vector<double> q, qd, qdd;
};

// The quintic around t[.] = time; false where there are samples on one side
// only.
bool FitQuintic(const std::vector<double>& t, const Channel& channel,
                double time, double width, double* q, double* qd, double* qdd) {
  constexpr int kSize = 6, kEachSide = 3;
  using Vector = Eigen::Matrix<double, kSize, 1>;
  const auto first =
      std::lower_bound(t.begin(), t.end(), time - kReach * width);
  const auto last = std::upper_bound(first, t.end(), time + kReach * width);
  Eigen::Matrix<double, kSize, kSize> A;
  A.setZero();
  Vector b = Vector::Zero();
  int before = 0, after = 0;
  for (auto at = first; at != last; ++at) {
    const double value = channel.values(at - t.begin(), 0);
    if (std::isnan(value)) continue;
    const double x = (*at - time) / width;
    Vector powers;
    powers[0] = 1.0;
    for (int i = 1; i < kSize; ++i) powers[i] = x * powers[i - 1];
    A.noalias() += Weight(x) * powers * powers.transpose();
    b.noalias() += Weight(x) * value * powers;
    (x < 0 ? before : after) += 1;
  }
  if (before < kEachSide || after < kEachSide) return false;
  const Vector c = A.ldlt().solve(b);
  *q = c[0];
  *qd = c[1] / width;
  *qdd = 2.0 * c[2] / (width * width);
  return c.allFinite();
}

// A window on even times: motion, and the efforts of each interval in a run.
struct Grid {
  Run run;  // its efforts
  std::vector<Point> points;
};

Grid OnGrid(const Model& model, const Run& window, double from, double to,
            double width, double step) {
  Grid grid;
  const int nv = model.nv();
  const int n = static_cast<int>(std::floor((to - from) / step)) + 1;
  if (n < 1) return grid;
  grid.run.effort = RowMatrixXd::Zero(n, nv);
  for (int k = 0; k < n; ++k) {
    const double time = from + k * step;
    grid.run.t.push_back(time - 0.5 * step);
    MeanEffort(window, time - 0.5 * step, time + 0.5 * step,
               grid.run.effort.row(k).data());
    Point point;
    point.known = true;
    point.q.resize(nv);
    point.qd.resize(nv);
    point.qdd.resize(nv);
    for (const Channel& channel : window.channels) {
      if (channel.kind != ChannelKind::kPosition) continue;
      const int v = model.mechanism().joints[channel.target].v_index;
      point.known =
          point.known && FitQuintic(window.t, channel, time, width, &point.q[v],
                                    &point.qd[v], &point.qdd[v]);
    }
    grid.points.push_back(std::move(point));
  }
  grid.run.t.push_back(grid.run.t.back() + step);
  return grid;
}

// [J | r] of (10.5) before the Gaussian, of each point and joint.
Eigen::MatrixXd Unbalanced(const Model& model, const ParameterMap& map,
                           const std::vector<double>& theta, const Grid& grid,
                           double step) {
  const int nv = model.nv(), n = static_cast<int>(grid.points.size());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(n * nv, map.size() + 1);
  std::vector<Jet8> seeded(theta.begin(), theta.end());
  std::vector<Jet8> q(nv), qd(nv), qdd(nv), u(nv), needed(nv);
  MechanismParameters<Jet8> values;
  Workspace<Jet8> ws(model);
  for (int begin = 0; begin == 0 || begin < map.size(); begin += kWidth) {
    const int count = std::min(kWidth, map.size() - begin);
    for (int c = 0; c < count; ++c) {
      seeded[begin + c] = Jet8(theta[begin + c], c);
    }
    map.Apply<Jet8>(seeded.data(), &values);
    ws.SetParameters(values);
    for (int k = 0; k < n; ++k) {
      const Point& point = grid.points[k];
      if (!point.known) continue;
      for (int v = 0; v < nv; ++v) {
        q[v] = Jet8(point.q[v]);
        qd[v] = Jet8(point.qd[v]);
        qdd[v] = Jet8(point.qdd[v]);
      }
      ActingEffort<Jet8>(grid.run, ws, k, grid.run.t[k], step, u.data());
      InverseDynamics<Jet8>(&ws, q.data(), qd.data(), qdd.data(),
                            needed.data());
      for (int v = 0; v < nv; ++v) {
        const Jet8 rest = u[v] - needed[v];
        for (int c = 0; c < count; ++c) {
          rows(k * nv + v, begin + c) = rest.v[c];
        }
        rows(k * nv + v, map.size()) = rest.a;
      }
    }
    for (int c = 0; c < count; ++c) {
      seeded[begin + c] = Jet8(theta[begin + c]);
    }
  }
  return rows;
}

// The grid of g: no coarser.
constexpr int kSteps = 3;  // a width
const int kReachSteps = static_cast<int>(kReach * kSteps);

// [J | r] of (10.5), by joint.
using Rows = std::vector<std::vector<Eigen::RowVectorXd>>;

// Appends those of a grid, one a width: between them g leaves nothing of its
// own.
void AppendAverages(const Grid& grid, const Eigen::MatrixXd& rest, Rows* rows) {
  const int nv = static_cast<int>(rows->size());
  const int n = static_cast<int>(grid.points.size());
  for (int k = kReachSteps; k + kReachSteps < n; k += kSteps) {
    bool known = true;
    double total = 0.0;
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(nv, rest.cols());
    for (int i = -kReachSteps; i <= kReachSteps; ++i) {
      const double weight = Weight(static_cast<double>(i) / kSteps);
      known = known && grid.points[k + i].known;
      total += weight;
      sum += weight * rest.middleRows((k + i) * nv, nv);
    }
    if (!known || !sum.allFinite()) continue;
    for (int v = 0; v < nv; ++v) (*rows)[v].push_back(sum.row(v) / total);
  }
}

// As few rows as say the same of squares.
Eigen::MatrixXd Triangle(const std::vector<Eigen::RowVectorXd>& rows,
                         int columns) {
  const int n = static_cast<int>(rows.size());
  Eigen::MatrixXd all(n, columns);
  for (int k = 0; k < n; ++k) all.row(k) = rows[k];
  if (n <= columns) return all;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(all);
  return qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
}

}  // namespace

EquationRows::EquationRows(const CoarseModel& model, const Excerpt& excerpt,
                           const Excerpt::Change& change) {
  std::vector<Parameter> parameters;
  std::vector<double> theta;
  for (const FreeParameter& free : model.free) {
    parameters.push_back(free.parameter);
    theta.push_back(free.initial);
  }
  const ParameterMap map(model.model, parameters, false);
  const int nv = model.model.nv();
  const double period = excerpt.period_s();
  const double width =
      std::max(hypotheses::kMotionWidth, hypotheses::kMotionSamples * period);
  const double average =
      std::max(hypotheses::kAverageWidth, hypotheses::kAverageSamples * period);
  const double step = average / kSteps;
  const double inner = Excerpt::kMargin - kReachSteps * step;
  for (const Run& window : excerpt.Windows(change, true)) {
    Rows rows(nv);
    const Grid grid = OnGrid(model.model, window, window.t.front() + inner,
                             window.t.back() - inner, width, step);
    AppendAverages(grid, Unbalanced(model.model, map, theta, grid, step),
                   &rows);
    std::vector<EquationPart> parts;
    for (int v = 0; v < nv; ++v) {
      parts.push_back({static_cast<int>(rows[v].size()),
                       Triangle(rows[v], map.size() + 1)});
    }
    windows_.push_back(std::move(parts));
    const double passes = std::ceil((map.size() + 1.0) / kWidth);
    work_ += hypotheses::kJetWork * passes * grid.points.size();
  }
}

double LeastEquationError(
    const std::vector<const std::vector<EquationPart>*>& windows) {
  // The weights of the joints settle to some per cent.
  constexpr int kIterations = 4;
  constexpr double kDependent = 1e-6;  // of columns, of length 1
  constexpr int kRowsEach = 3;         // of a number that is fitted
  if (windows.empty()) return INFINITY;
  const int joints = static_cast<int>(windows.front()->size());
  const int columns =
      static_cast<int>(windows.front()->front().triangle.cols());
  std::vector<int> counts(joints, 0);
  int rows = 0;
  for (const auto* window : windows) {
    for (int v = 0; v < joints; ++v) {
      counts[v] += (*window)[v].rows;
      rows += static_cast<int>((*window)[v].triangle.rows());
    }
  }
  if (rows < columns ||
      *std::min_element(counts.begin(), counts.end()) < kRowsEach * columns) {
    return INFINITY;
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
      constexpr double kNothing = 1e-9;
      Eigen::VectorXd scale = all.leftCols(n).colwise().norm();
      const double nothing = kNothing * scale.maxCoeff();
      for (double& s : scale) s = s > nothing ? 1.0 / s : 0.0;
      Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr;
      qr.setThreshold(kDependent);
      qr.compute(all.leftCols(n) * scale.asDiagonal());
      change.head(n) = -scale.cwiseProduct(qr.solve(all.col(n)));
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
