#include "sysid/diagnosis/equation_products.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace sysid {

EquationProducts MultiplyRows(const EquationRows& rows, int from, int to) {
  EquationProducts products;
  products.times = Eigen::VectorXd::Constant(rows.nv, to - from);
  for (int v = 0; v < rows.nv; ++v) {
    RowMatrixXd own(to - from, rows.rows.cols());
    for (int t = from; t < to; ++t) {
      own.row(t - from) = rows.rows.row(t * rows.nv + v);
    }
    products.of.push_back(own.transpose() * own);
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
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(G.rows(),
                                                                 G.cols());
  solver.setThreshold(kDependent);
  solver.compute(scale.asDiagonal() * G * scale.asDiagonal());
  return scale.cwiseProduct(solver.solve(scale.cwiseProduct(g).eval()));
}

Eigen::VectorXd SolveWeighted(const EquationProducts& products,
                              const std::vector<int>& at,
                              const Eigen::VectorXd& variance,
                              const ChangeBounds& bounds) {
  const int n = static_cast<int>(at.size());
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  for (int v = 0; v < variance.size(); ++v) {
    const Eigen::MatrixXd& own = products.of[v];
    for (int i = 0; i < n; ++i) {
      g[i] += own(at[i], own.cols() - 1) / variance[v];
      for (int k = 0; k < n; ++k) G(i, k) += own(at[i], at[k]) / variance[v];
    }
  }
  Eigen::VectorXd d = Eigen::VectorXd::Zero(n);
  std::vector<int> loose(n);
  std::iota(loose.begin(), loose.end(), 0);
  for (size_t had = n + 1; loose.size() < had;) {
    had = loose.size();
    d(loose).setZero();
    const Eigen::VectorXd rest = g + G * d;  // of what is held
    d(loose) = -SolveScaled(G(loose, loose), rest(loose));
    std::erase_if(loose, [&](int i) {
      const double asked = d[i];
      d[i] = std::clamp(asked, bounds.lower[at[i]], bounds.upper[at[i]]);
      return d[i] != asked;
    });
  }
  return d;
}

}  // namespace sysid
