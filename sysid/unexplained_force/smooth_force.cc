#include "sysid/unexplained_force/smooth_force.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of the time scale, in knots; tried upwards and downwards from the second.
constexpr double kTimeScales[] = {1.0, 3.0, 9.0, 27.0, 81.0};
constexpr int kMostSteps = 15;
// Times a width squared: no force.
constexpr double kNone = 1e-12;

// P0 of (7.8) for one degree of freedom: nu ((ell/h)^4 L^2 + 1), L of the path
// through the knots. nu makes the mean variance 1.
struct UnitPrior {
  Eigen::SparseMatrix<double> P0;
  double log_determinant = 0.0;

  UnitPrior(int knots, double ell) {
    const double rough = std::pow(ell, 4);
    VectorXd eigenvalues(knots);  // without nu
    for (int m = 0; m < knots; ++m) {
      const double lambda = 2.0 - 2.0 * std::cos(M_PI * m / knots);
      eigenvalues[m] = rough * lambda * lambda + 1.0;
    }
    const double nu = eigenvalues.cwiseInverse().mean();
    for (const double value : eigenvalues) {
      log_determinant += std::log(nu * value);
    }
    Eigen::SparseMatrix<double> L(knots, knots), one(knots, knots);
    one.setIdentity();
    for (int k = 0; k < knots; ++k) {
      L.coeffRef(k, k) = k == 0 || k == knots - 1 ? 1.0 : 2.0;
      if (k > 0) L.coeffRef(k, k - 1) = L.coeffRef(k - 1, k) = -1.0;
    }
    const Eigen::SparseMatrix<double> L2 = L * L;
    P0 = nu * (rough * L2 + one);
  }
  // Calls visit(k, l, P0_kl) for all that are not zero.
  template <typename Visit>
  void ForEach(const Visit& visit) const {
    for (int l = 0; l < P0.cols(); ++l) {
      for (Eigen::SparseMatrix<double>::InnerIterator at(P0, l); at; ++at) {
        visit(static_cast<int>(at.row()), l, at.value());
      }
    }
  }
};

}  // namespace

double ForceCorrelation(double apart) {
  const double x = std::abs(apart) / std::sqrt(2.0);
  return std::exp(-x) * (std::cos(x) + std::sin(x));
}

SmoothForce::SmoothForce(const ForceEquations& equations)
    : equations_(equations) {
  // The largest widths that make sense, and no noise beyond what is known: from
  // below the force would be taken for noise.
  Point best;
  best.ell = kTimeScales[1];
  best.reach = Reach(best.ell);
  best.s2 = (equations.squares * best.reach.cwiseInverse());
  for (double& s2 : best.s2) {
    if (!std::isfinite(s2) || !(s2 > 0)) s2 = 1.0;
  }
  Converge(&best);
  for (const int direction : {1, -1}) {
    const int count = static_cast<int>(std::size(kTimeScales));
    for (int i = 1 + direction; i >= 0 && i < count; i += direction) {
      Point next = best;
      next.ell = kTimeScales[i];
      next.reach = Reach(next.ell);
      Converge(&next);
      if (next.likelihood > best.likelihood) {
        best = next;
      } else if (std::isfinite(best.likelihood)) {
        break;  // else none could be solved for so far
      }
    }
    if (best.ell != kTimeScales[1]) break;
  }
  point_ = best;
  solution_ = Solve(point_);
}

// tr(G P0^-1) of each degree of freedom: by how much forces of unit width
// change the sum of squares.
VectorXd SmoothForce::Reach(double ell) const {
  const int nv = equations_.nv;
  Totals totals(nv);
  for (const ForceEquations::Run& run : equations_.runs) {
    VectorXd reach = VectorXd::Zero(nv);
    const std::vector<int>& first = run.G.first;
    const auto add = [&](const MatrixXd& part, int row, int column,
                         double times) {
      for (int c = 0; c < part.cols(); ++c) {
        const int l = (column + c) / nv, d = (column + c) % nv;
        // Rows of the same degree of freedom.
        const int start = ((d - row) % nv + nv) % nv;
        for (int r = start; r < part.rows(); r += nv) {
          const int apart = (row + r) / nv - l;
          reach[d] += times * part(r, c) * ForceCorrelation(apart / ell);
        }
      }
    };
    for (int i = 0; i < run.G.blocks(); ++i) {
      add(run.G.diagonal[i], first[i], first[i], 1.0);
      if (i + 1 < run.G.blocks()) {
        add(run.G.below[i], first[i + 1], first[i], 2.0);
      }
    }
    totals.Add(0, reach);
  }
  return totals.Over(*equations_.processes);
}

double SmoothForce::Solution::LogLikelihood(double dof, double variance) const {
  return -dof * std::log(variance) - squares / variance - roughness +
         determinants;
}

std::vector<MatrixXd> SmoothForce::ForcesFrom(const Solution& at,
                                              double variance,
                                              std::vector<MatrixXd> Ay,
                                              MatrixXd Ty,
                                              MatrixXd* dtheta) const {
  Totals totals(static_cast<int>(Ty.size()));
  for (size_t r = 0; r < Ay.size(); ++r) {
    Ay[r] = at.factors[r].Solve(Ay[r] / variance);
    totals.Add(0, equations_.runs[r].C.transpose() * Ay[r]);
  }
  Ty -= totals.Over(*equations_.processes).reshaped(Ty.rows(), Ty.cols());
  *dtheta = Ty / variance;
  if (dtheta->rows() > 0) *dtheta = at.parameters.Solve(*dtheta);
  for (size_t r = 0; r < Ay.size(); ++r) Ay[r].noalias() -= at.Y[r] * *dtheta;
  return Ay;
}

SmoothForce::Solution SmoothForce::Solve(const Point& point) const {
  const int nv = equations_.nv;
  const double variance = point.variance;
  Solution out;
  MatrixXd M = equations_.N;
  const int free = static_cast<int>(M.rows());
  Totals totals(2 + free * free);  // failures, determinants, C' Y
  std::vector<MatrixXd> Ay;
  std::vector<UnitPrior> priors;
  for (const ForceEquations::Run& run : equations_.runs) {
    const UnitPrior& prior = priors.emplace_back(run.knots, point.ell);
    double determinants = 0.0;
    BlockTridiagonal H = run.G;
    for (MatrixXd& block : H.diagonal) block /= variance;
    for (MatrixXd& block : H.below) block /= variance;
    for (int d = 0; d < nv; ++d) {
      const double s2 = point.s2[d];
      prior.ForEach([&](int k, int l, double p) {
        if (k >= l) H.At(k * nv + d, l * nv + d) += p / s2;
      });
      determinants += prior.log_determinant - run.knots * std::log(s2);
    }
    out.factors.emplace_back(H);
    if (!out.factors.back().Valid()) {
      totals.Add(0, 1.0);
      break;
    }
    totals.Add(1, determinants - out.factors.back().LogDeterminant());
    out.Y.push_back(out.factors.back().Solve(run.C / variance));
    totals.Add(2, run.C.transpose() * out.Y.back());
    Ay.push_back(-run.g);
  }
  const VectorXd sums = totals.Over(*equations_.processes);
  if (sums[0] > 0.0) {
    out.determinants = -std::numeric_limits<double>::infinity();
    return out;
  }
  out.determinants = sums[1];
  M -= sums.tail(free * free).reshaped(free, free);
  if (M.size() > 0) {
    out.parameters = Cholesky(M / variance);
    if (!out.parameters.Valid()) {
      out.determinants = -std::numeric_limits<double>::infinity();
      return out;
    }
    out.determinants -=
        out.parameters.LogDeterminant() + M.rows() * std::log(variance);
  }
  MatrixXd dtheta;
  const std::vector<MatrixXd> phi =
      ForcesFrom(out, variance, std::move(Ay), -equations_.t, &dtheta);
  out.dtheta = dtheta;
  out.squares = equations_.squares + 2.0 * equations_.t.dot(out.dtheta) +
                out.dtheta.dot(equations_.N * out.dtheta);
  // Squares, roughness, and by degree of freedom `rough` and `determined`.
  Totals of_runs(2 + 2 * nv);
  for (size_t r = 0; r < phi.size(); ++r) {
    const ForceEquations::Run& run = equations_.runs[r];
    out.phi.push_back(phi[r]);
    const double linear = phi[r].col(0).dot(run.g + run.C * out.dtheta);
    const double quadratic = phi[r].col(0).dot(run.G.Times(phi[r]).col(0));
    of_runs.Add(0, 2.0 * linear + quadratic);
    // H phi = -(g + C dtheta) / variance.
    of_runs.Add(1, -(linear + quadratic) / variance);
    out.inverse.push_back(out.factors[r].Inverse());
    out.Z.push_back(out.Y[r]);
    if (M.size() > 0) {
      out.parameters.SolveLTransposedRight(out.Z[r]);
    }
    for (int d = 0; d < nv; ++d) {
      double rough = 0.0, determined = run.knots;
      priors[r].ForEach([&](int k, int l, double p) {
        const int row = k * nv + d, column = l * nv + d;
        rough += p * out.phi[r][row] * out.phi[r][column];
        determined -= p * out.Covariance(r, row, column) / point.s2[d];
      });
      of_runs.Add(2 + d, rough);
      of_runs.Add(2 + nv + d, determined);
    }
  }
  const VectorXd over_runs = of_runs.Over(*equations_.processes);
  out.squares += over_runs[0];
  out.roughness = over_runs[1];
  out.rough = over_runs.segment(2, nv);
  out.determined = over_runs.tail(nv);
  out.determined = out.determined.cwiseMax(0.0);
  return out;
}

// One step of the fixed point (MacKay 1992): s^2 = phi' P0 phi / determined,
// with determined = knots - tr(P0 H^-1) / s^2, and the variance of what
// remains.    (7.9)
SmoothForce::Point SmoothForce::Step(const Point& point,
                                     const Solution& solution) const {
  Point next = point;
  next.variance = std::max(
      1.0, solution.squares /
               std::max(1.0, equations_.dof - solution.determined.sum()));
  for (int d = 0; d < equations_.nv; ++d) {
    if (!(point.reach[d] > 0)) continue;
    // No less than what would change the sum of squares by one variance: the
    // data cannot say more.
    const double least = next.variance / point.reach[d];
    next.s2[d] =
        std::clamp(solution.rough[d] / std::max(solution.determined[d], 1e-9),
                   least, std::max(least, 1e4 * point.s2[d]));
  }
  return next;
}

void SmoothForce::Converge(Point* point) const {
  constexpr double kEnough = 0.2;  // of a logarithm
  Point solved = *point;
  solved.likelihood = -std::numeric_limits<double>::infinity();
  for (int step = 0; step < kMostSteps; ++step) {
    const Solution solution = Solve(*point);
    if (!std::isfinite(solution.determinants)) {
      *point = solved;
      return;
    }
    point->likelihood = solution.LogLikelihood(equations_.dof, point->variance);
    solved = *point;
    Point next = Step(*point, solution);
    const double change =
        std::max((next.s2.array() / point->s2.array()).log().abs().maxCoeff(),
                 std::abs(std::log(next.variance / point->variance)));
    if (change < kEnough) return;
    next.likelihood = point->likelihood;
    *point = next;
  }
}

SmoothForce::Weight SmoothForce::WeightOf(int first, int count) const {
  Point without = point_;
  double tested = 0.0;
  for (int d = first; d < first + count; ++d) {
    if (!Seen(d)) continue;
    without.s2[d] *= kNone;
    tested += 1.0;
  }
  if (tested == 0.0) return {};
  const Solution solution = Solve(without);
  // With what the force would have explained left to the noise.
  without.variance = std::max(
      1.0, solution.squares /
               std::max(1.0, equations_.dof - solution_.determined.sum() +
                                 Determined(first, count)));
  const double drop = solution_.LogLikelihood(equations_.dof, point_.variance) -
                      solution.LogLikelihood(equations_.dof, without.variance);
  Weight weight;
  // One width each; that a width is at its end, none, is left aside, which errs
  // on the safe side.
  if (drop > 0) weight.p_value = FisherTail(drop / tested, tested, 1e6);
  const VectorXd response = Response();
  weight.share = response.segment(first, count).sum() / response.sum();
  return weight;
}

// phi_d' G phi_d: what the force of each degree of freedom does to the errors.
VectorXd SmoothForce::Response() const {
  const int nv = equations_.nv;
  VectorXd response = VectorXd::Zero(nv);
  for (size_t r = 0; r < equations_.runs.size(); ++r) {
    const VectorXd& phi = solution_.phi[r];
    MatrixXd apart = MatrixXd::Zero(phi.size(), nv);
    for (int i = 0; i < phi.size(); ++i) apart(i, i % nv) = phi[i];
    response += apart.cwiseProduct(equations_.runs[r].G.Times(apart))
                    .colwise()
                    .sum()
                    .transpose();
  }
  return response.cwiseMax(1e-300);
}

RowMatrixXd SmoothForce::Values(int run) const {
  return Eigen::Map<const RowMatrixXd>(
      solution_.phi[run].data(), equations_.runs[run].knots, equations_.nv);
}

RowMatrixXd SmoothForce::Deviations(int run) const {
  const int nv = equations_.nv;
  RowMatrixXd out(equations_.runs[run].knots, nv);
  for (int i = 0; i < out.size(); ++i) {
    out(i / nv, i % nv) =
        std::sqrt(std::max(0.0, solution_.Covariance(run, i, i)));
  }
  return out;
}

std::vector<MatrixXd> SmoothForce::Smooth(
    const std::vector<MatrixXd>& forces) const {
  const int columns = static_cast<int>(forces.front().cols());
  std::vector<MatrixXd> Ay;
  MatrixXd Ty = MatrixXd::Zero(equations_.N.rows(), columns), dtheta;
  for (size_t r = 0; r < forces.size(); ++r) {
    Ay.push_back(equations_.runs[r].G.Times(forces[r]));
    Ty.noalias() += equations_.runs[r].C.transpose() * forces[r];
  }
  return ForcesFrom(solution_, point_.variance, std::move(Ay), Ty, &dtheta);
}

double SmoothForce::NoiseSquares(
    const std::vector<std::vector<int>>& rows) const {
  // Noise e of the variance puts K A'e / variance into phi, K the inverse with
  // the parameters eliminated: the trace of K (A' A) K / variance over these
  // rows (A without Theta), by random signs (Hutchinson 1990).
  constexpr int kSigns = 16;
  std::mt19937_64 random(1);
  std::vector<MatrixXd> signs;
  for (size_t r = 0; r < rows.size(); ++r) {
    MatrixXd z = MatrixXd::Zero(equations_.runs[r].G.size(), kSigns);
    for (const int row : rows[r]) {
      for (int i = 0; i < kSigns; ++i) z(row, i) = random() & 1 ? 1.0 : -1.0;
    }
    signs.push_back(z * point_.variance);
  }
  MatrixXd dtheta;
  const std::vector<MatrixXd> x =
      ForcesFrom(solution_, point_.variance, signs,
                 MatrixXd::Zero(equations_.N.rows(), kSigns), &dtheta);
  double sum = dtheta.cwiseProduct(equations_.N * dtheta).sum();
  for (size_t r = 0; r < rows.size(); ++r) {
    const ForceEquations::Run& run = equations_.runs[r];
    sum += x[r].cwiseProduct(run.G.Times(x[r]) + 2.0 * run.C * dtheta).sum();
  }
  return sum / (kSigns * point_.variance);
}

}  // namespace sysid
