#include "sysid/inverse_dynamics/equation_products.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "models/math/decompositions.h"

namespace sysid {

EquationProducts MultiplyRows(const EquationRows& rows, int from, int to) {
  EquationProducts products;
  products.times.resize(rows.nv);
  for (int v = 0; v < rows.nv; ++v) {
    RowMatrixXd own(to - from, rows.rows.cols());
    int n = 0;
    for (int t = from; t < to; ++t) {
      if (!rows.rests(t, v)) own.row(n++) = rows.rows.row(t * rows.nv + v);
    }
    products.times[v] = n;
    const auto moving = own.topRows(n);
    products.of.emplace_back(moving.transpose() * moving);
  }
  return products;
}

void AddProducts(const EquationProducts& more, double times,
                 EquationProducts* sum) {
  if (sum->of.empty()) {
    sum->of.assign(more.of.size(),
                   Eigen::MatrixXd::Zero(more.of[0].rows(), more.of[0].cols()));
    sum->times = Eigen::VectorXd::Zero(more.times.size());
  }
  for (size_t v = 0; v < more.of.size(); ++v) sum->of[v] += times * more.of[v];
  sum->times += times * more.times;
}

Eigen::VectorXd SolveScaled(const Eigen::MatrixXd& G,
                            const Eigen::VectorXd& g) {
  constexpr double kDependent = 1e-10;
  if (g.size() == 0) return g;
  const Eigen::VectorXd scale =
      G.diagonal()
          .cwiseSqrt()
          .cwiseMax(std::numeric_limits<double>::min())
          .cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * G * scale.asDiagonal();
  const Eigen::VectorXd right = scale.cwiseProduct(g);
  const Cholesky factor(scaled);
  if (factor.Valid() &&
      factor.L().diagonal().minCoeff() > std::sqrt(kDependent)) {
    return scale.cwiseProduct(factor.Solve(right));
  }
  return scale.cwiseProduct(ShortestLeastSquares(scaled, right, kDependent));
}

WeightedProducts Weigh(const EquationProducts& products,
                       const std::vector<int>& at,
                       const Eigen::VectorXd& variance,
                       const Eigen::MatrixXd& P) {
  const Eigen::Index last = products.of[0].cols() - 1;
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(at.size(), at.size());
  Eigen::VectorXd g = Eigen::VectorXd::Zero(at.size());
  for (int v = 0; v < variance.size(); ++v) {
    if (!(products.times[v] > 0.0)) continue;
    const Eigen::MatrixXd& own = products.of[v];
    G += own(at, at) / variance[v];
    g += own.col(last)(at) / variance[v];
  }
  if (P.size() > 0) G += P(at, at);
  return {std::move(G), std::move(g)};
}

Eigen::VectorXd SolveWeighted(const WeightedProducts& weighted,
                              const std::vector<int>& at,
                              const ChangeBounds& bounds) {
  const int n = static_cast<int>(at.size());
  const auto& [G, g] = weighted;
  // A primal active-set method (Nocedal and Wright 2006, 16.5): every step
  // lowers the sum of squares.
  Eigen::VectorXd d(n);
  for (int i = 0; i < n; ++i) {
    d[i] = std::clamp(0.0, bounds.lower[at[i]], bounds.upper[at[i]]);
  }
  constexpr double kRounding = 1e-9;  // of the gradient, by column
  const Eigen::VectorXd least =
      kRounding * (g.cwiseAbs() + G.cwiseAbs() * d.cwiseAbs());
  std::vector<bool> held(n, false);
  for (int round = 0; round < 3 * n + 1; ++round) {
    std::vector<int> loose;
    for (int i = 0; i < n; ++i) {
      if (!held[i]) loose.push_back(i);
    }
    const Eigen::VectorXd gradient = g + G * d;
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    step(loose) = -SolveScaled(G(loose, loose), gradient(loose));
    // As far as the first bound.
    double part = 1.0;
    int first = -1;
    for (const int i : loose) {
      const double bound = (step[i] > 0.0 ? bounds.upper : bounds.lower)[at[i]];
      if (std::abs(bound - d[i]) < part * std::abs(step[i])) {
        part = (bound - d[i]) / step[i];
        first = i;
      }
    }
    d += part * step;
    if (first >= 0) {
      d[first] = (step[first] > 0.0 ? bounds.upper : bounds.lower)[at[first]];
      held[first] = true;
      continue;
    }
    // Of what is held, that which gains most within the bounds goes on.
    const Eigen::VectorXd slope = g + G * d;
    int best = -1;
    double most = 0.0;
    for (int i = 0; i < n; ++i) {
      const double inwards = d[i] == bounds.lower[at[i]] ? -slope[i] : slope[i];
      if (!held[i] || !(inwards > least[i]) || !(G(i, i) > 0.0)) continue;
      const double gain = inwards * inwards / G(i, i);
      if (gain > most) {
        most = gain;
        best = i;
      }
    }
    if (best < 0) break;
    held[best] = false;
  }
  return d;
}

}  // namespace sysid
