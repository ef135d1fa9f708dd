#include "sysid/diagnosis/smooth_force.h"

#include <algorithm>
#include <cmath>

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of the time scale, in knots; tried upwards and downwards from the second.
constexpr double kTimeScales[] = {1.0, 3.0, 9.0, 27.0, 81.0};
constexpr int kMostSteps = 30;

// P0 of (7.7) for one degree of freedom: nu ((ell/h)^4 L^2 + 1), L of the path
// through the knots. nu makes the mean variance 1.
class UnitPrior {
 public:
  UnitPrior(int knots, double ell) : knots_(knots), rough_(std::pow(ell, 4)) {
    double variance = 0.0;
    for (int m = 0; m < knots; ++m) variance += 1.0 / Eigenvalue(m);
    nu_ = variance / knots;
    for (int m = 0; m < knots; ++m) {
      log_determinant_ += std::log(nu_ * Eigenvalue(m));
    }
  }
  double operator()(int k, int l) const {
    double L2 = 0.0;
    for (int m = std::max(0, k - 1); m <= std::min(knots_ - 1, k + 1); ++m) {
      L2 += Laplacian(k, m) * Laplacian(m, l);
    }
    return nu_ * (rough_ * L2 + (k == l));
  }
  double LogDeterminant() const { return log_determinant_; }

 private:
  double Laplacian(int k, int l) const {
    if (k == l) return k == 0 || k == knots_ - 1 ? 1.0 : 2.0;
    return std::abs(k - l) == 1 ? -1.0 : 0.0;
  }
  double Eigenvalue(int m) const {  // without nu
    const double lambda = 2.0 - 2.0 * std::cos(M_PI * m / knots_);
    return rough_ * lambda * lambda + 1.0;
  }

  int knots_;
  double rough_;
  double nu_ = 1.0;
  double log_determinant_ = 0.0;
};

// What P0^-1 is far from the ends of a run: the covariance of two forces that
// are so many time scales apart.
double Covariance(double apart) {
  const double x = std::abs(apart) / std::sqrt(2.0);
  return std::exp(-x) * (std::cos(x) + std::sin(x));
}

// Calls visit(k, l, row, column) for the entries of P of a degree of freedom,
// lower triangle.
template <typename Visit>
void ForBand(int knots, int nv, int d, const Visit& visit) {
  for (int k = 0; k < knots; ++k) {
    for (int l = std::max(0, k - 2); l <= k; ++l) {
      visit(k, l, k * nv + d, l * nv + d);
    }
  }
}

}  // namespace

SmoothForce::SmoothForce(const ForceEquations& equations)
    : equations_(equations), told_(VectorXd::Zero(equations.groups)) {
  // The largest widths that make sense, and no noise beyond what is known: from
  // below the force would be taken for noise.
  Point best;
  best.ell = kTimeScales[1];
  SetReach(best.ell);
  best.s2 = (equations.squares * reach_.cwiseInverse());
  for (double& s2 : best.s2) {
    if (!std::isfinite(s2) || !(s2 > 0)) s2 = 1.0;
  }
  Converge(kMostSteps, &best);
  for (const int direction : {1, -1}) {
    const int count = static_cast<int>(std::size(kTimeScales));
    for (int i = 1 + direction; i >= 0 && i < count; i += direction) {
      Point next = best;
      next.ell = kTimeScales[i];
      SetReach(next.ell);
      Converge(kMostSteps, &next);
      if (!(next.likelihood > best.likelihood)) break;
      best = next;
    }
    if (best.ell != kTimeScales[1]) break;
  }
  SetReach(best.ell);
  point_ = best;
  solution_ = Solve(point_);
  Step(point_, solution_, &inverse_, &told_);
}

// tr(G P0^-1) of each group: by how much forces of unit width change the sum of
// squares.
void SmoothForce::SetReach(double ell) {
  const int nv = equations_.nv();
  reach_ = VectorXd::Zero(equations_.groups);
  for (const ForceEquations::Run& run : equations_.runs) {
    const std::vector<int>& first = run.G.first;
    const auto add = [&](const MatrixXd& part, int row, int column,
                         double times) {
      for (int c = 0; c < part.cols(); ++c) {
        const int l = (column + c) / nv, d = (column + c) % nv;
        // Rows of the same degree of freedom.
        const int start = ((d - row) % nv + nv) % nv;
        for (int r = start; r < part.rows(); r += nv) {
          reach_[equations_.group[d]] +=
              times * part(r, c) * Covariance(((row + r) / nv - l) / ell);
        }
      }
    };
    for (int i = 0; i < run.G.blocks(); ++i) {
      add(run.G.diagonal[i], first[i], first[i], 1.0);
      if (i + 1 < run.G.blocks()) {
        add(run.G.below[i], first[i + 1], first[i], 2.0);
      }
    }
  }
}

double SmoothForce::Solution::LogLikelihood(double dof, double variance) const {
  return -dof * std::log(variance) - squares / variance - roughness +
         determinants;
}

SmoothForce::Solution SmoothForce::Solve(const Point& point) const {
  const int nv = equations_.nv();
  Solution out;
  out.squares = equations_.squares;
  for (const ForceEquations::Run& run : equations_.runs) {
    const UnitPrior P0(run.knots, point.ell);
    BlockTridiagonal H = run.G;
    for (MatrixXd& block : H.diagonal) block /= point.variance;
    for (MatrixXd& block : H.below) block /= point.variance;
    for (int d = 0; d < nv; ++d) {
      const double s2 = point.s2[equations_.group[d]];
      ForBand(run.knots, nv, d, [&](int k, int l, int row, int column) {
        const double p = P0(k, l) / s2;
        H.At(row, column) += p;
        if (k != l && H.BlockOf(row) == H.BlockOf(column)) {
          const int at = H.first[H.BlockOf(row)];
          H.diagonal[H.BlockOf(row)](column - at, row - at) += p;
        }
      });
      out.determinants += P0.LogDeterminant() - run.knots * std::log(s2);
    }
    out.factors.emplace_back(H);
    const BlockCholesky& factor = out.factors.back();
    if (!factor.Valid()) {
      out.phi.push_back(VectorXd::Zero(run.G.size()));
      out.determinants = -std::numeric_limits<double>::infinity();
      continue;
    }
    out.phi.push_back(-factor.Solve(run.g / point.variance));
    out.determinants -= factor.LogDeterminant();
    const VectorXd& phi = out.phi.back();
    const double explained = run.g.dot(phi);
    const double quadratic = phi.dot(run.G.Times(phi).col(0));
    out.squares += 2.0 * explained + quadratic;
    // H phi = -g / v.
    out.roughness -= (explained + quadratic) / point.variance;
  }
  return out;
}

// One step of the fixed point (MacKay 1992): s^2 = phi' P0 phi / told, with
// told = knots - tr(P0 H^-1) / s^2, and the variance of what remains.    (7.8)
SmoothForce::Point SmoothForce::Step(const Point& point,
                                     const Solution& solution,
                                     std::vector<BlockTridiagonal>* inverse,
                                     VectorXd* told) const {
  const int nv = equations_.nv();
  VectorXd rough = VectorXd::Zero(equations_.groups);
  *told = VectorXd::Zero(equations_.groups);
  inverse->clear();
  for (size_t r = 0; r < equations_.runs.size(); ++r) {
    const int knots = equations_.runs[r].knots;
    const UnitPrior P0(knots, point.ell);
    inverse->push_back(solution.factors[r].Inverse());
    const VectorXd& phi = solution.phi[r];
    for (int d = 0; d < nv; ++d) {
      const int g = equations_.group[d];
      (*told)[g] += knots;
      ForBand(knots, nv, d, [&](int k, int l, int row, int column) {
        const double p = P0(k, l) * (k == l ? 1.0 : 2.0);
        rough[g] += p * phi[row] * phi[column];
        (*told)[g] -= p * inverse->back().At(row, column) / point.s2[g];
      });
    }
  }
  Point next = point;
  *told = told->cwiseMax(0.0);
  next.variance = std::max(
      1.0, solution.squares / std::max(1.0, equations_.dof - told->sum()));
  for (int g = 0; g < equations_.groups; ++g) {
    if (!Seen(g)) continue;
    // No less than what would change the sum of squares by one variance: the
    // data cannot say more.
    const double least = next.variance / reach_[g];
    next.s2[g] = std::max(least, rough[g] / std::max((*told)[g], 1e-9));
    next.s2[g] = std::min(next.s2[g], 1e4 * point.s2[g]);
  }
  return next;
}

void SmoothForce::Converge(int most, Point* point) {
  constexpr double kEnough = 0.1;  // of a logarithm
  for (int step = 0; step < most; ++step) {
    const Solution solution = Solve(*point);
    if (!std::isfinite(solution.determinants)) {
      point->likelihood = -std::numeric_limits<double>::infinity();
      return;
    }
    point->likelihood = solution.LogLikelihood(equations_.dof, point->variance);
    const Point next = Step(*point, solution, &inverse_, &told_);
    const double change =
        std::max((next.s2.array() / point->s2.array()).log().abs().maxCoeff(),
                 std::abs(std::log(next.variance / point->variance)));
    if (change < kEnough) return;
    const double likelihood = point->likelihood;
    *point = next;
    point->likelihood = likelihood;
  }
}

double SmoothForce::PValue(int group) const {
  if (!Seen(group)) return 1.0;
  Point without = point_;
  without.s2[group] *= 1e-12;
  const Solution solution = Solve(without);
  // With what the force would have explained left to the noise.
  without.variance = std::max(
      1.0, solution.squares /
               std::max(1.0, equations_.dof - told_.sum() + told_[group]));
  const double drop = solution_.LogLikelihood(equations_.dof, point_.variance) -
                      solution.LogLikelihood(equations_.dof, without.variance);
  // Half the time the best width is none.
  return drop > 0 ? 0.5 * std::erfc(std::sqrt(0.5 * drop)) : 1.0;
}

double SmoothForce::width(int group) const {
  return std::sqrt(point_.s2[group]);
}

RowMatrixXd SmoothForce::Values(int run) const {
  return Eigen::Map<const RowMatrixXd>(
      solution_.phi[run].data(), equations_.runs[run].knots, equations_.nv());
}

RowMatrixXd SmoothForce::Deviations(int run) const {
  const int nv = equations_.nv();
  RowMatrixXd out(equations_.runs[run].knots, nv);
  for (int i = 0; i < out.size(); ++i) {
    out(i / nv, i % nv) = std::sqrt(std::max(0.0, inverse_[run].At(i, i)));
  }
  return out;
}

MatrixXd SmoothForce::Smooth(int run, const MatrixXd& forces) const {
  return solution_.factors[run].Solve(equations_.runs[run].G.Times(forces) /
                                      point_.variance);
}

}  // namespace sysid
