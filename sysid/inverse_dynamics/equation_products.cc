#include "sysid/inverse_dynamics/equation_products.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "models/math/decompositions.h"

namespace sysid {

namespace {

// Of the columns `at` those that act on a joint: index in `at`, and in G.
struct Acting {
  std::vector<int> at, place;
};
Acting ActingOn(const JointProducts& own, const std::vector<int>& at) {
  Acting acting;
  for (size_t i = 0; i < at.size(); ++i) {
    const int place = own.place[at[i]];
    if (place < 0) continue;
    acting.at.push_back(static_cast<int>(i));
    acting.place.push_back(place);
  }
  return acting;
}

}  // namespace

JointProducts::JointProducts(Eigen::MatrixXd products)
    : place(products.cols() - 1), G(std::move(products)) {
  std::iota(place.begin(), place.end(), 0);
}

double EquationProducts::Left(int joint, const std::vector<int>& at,
                              const Eigen::VectorXd& d) const {
  const JointProducts& own = of[joint];
  const Eigen::Index last = own.G.cols() - 1;
  const Acting acting = ActingOn(own, at);
  const Eigen::VectorXd x = d(acting.at);
  return std::max(0.0, own.G(last, last) +
                           2.0 * x.dot(own.G.col(last)(acting.place)) +
                           x.dot(own.G(acting.place, acting.place) * x));
}

double EquationProducts::Moved(int joint, const std::vector<int>& at,
                               const Eigen::VectorXd& d) const {
  const Acting acting = ActingOn(of[joint], at);
  const Eigen::VectorXd x = d(acting.at);
  return std::max(0.0, x.dot(of[joint].G(acting.place, acting.place) * x));
}

std::vector<std::vector<int>> ColumnsOfJoints(
    const std::vector<EquationRows>& runs) {
  const int nv = runs[0].nv;
  const auto columns = static_cast<int>(runs[0].rows.cols()) - 1;
  std::vector<std::vector<int>> places(nv, std::vector<int>(columns, -1));
  for (const EquationRows& run : runs) {
    for (Eigen::Index i = 0; i < run.rows.rows(); ++i) {
      for (int c = 0; c < columns; ++c) {
        if (run.rows(i, c) != 0.0) places[i % nv][c] = 0;
      }
    }
  }
  for (std::vector<int>& of_joint : places) {
    int count = 0;
    for (int& place : of_joint) place = place < 0 ? -1 : count++;
  }
  return places;
}

EquationProducts MultiplyRows(const EquationRows& rows, int from, int to,
                              const std::vector<std::vector<int>>& columns) {
  EquationProducts products;
  products.times.resize(rows.nv);
  for (int v = 0; v < rows.nv; ++v) {
    std::vector<int> own_columns;
    for (size_t c = 0; c < columns[v].size(); ++c) {
      if (columns[v][c] >= 0) own_columns.push_back(static_cast<int>(c));
    }
    own_columns.push_back(static_cast<int>(rows.rows.cols()) - 1);
    RowMatrixXd own(to - from, own_columns.size());
    int n = 0;
    for (int t = from; t < to; ++t) {
      if (rows.rests(t, v)) continue;
      own.row(n++) = rows.rows.row(t * rows.nv + v)(own_columns);
    }
    products.times[v] = n;
    const auto moving = own.topRows(n);
    products.of.emplace_back();
    products.of.back().place = columns[v];
    products.of.back().G = moving.transpose() * moving;
  }
  return products;
}

void AddProducts(const EquationProducts& more, EquationProducts* sum) {
  if (sum->of.empty()) {
    *sum = more;
    return;
  }
  for (size_t v = 0; v < more.of.size(); ++v) sum->of[v].G += more.of[v].G;
  sum->times += more.times;
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

Eigen::VectorXd JointScales::Times(int joint, const std::vector<int>& at,
                                   const Eigen::VectorXd& d) const {
  Eigen::VectorXd scaled = of[joint] * d;
  for (size_t i = 0; i < at.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (at[i] == but[joint]) scaled[k] = d[k];
  }
  return scaled;
}

WeightedProducts Weigh(const EquationProducts& products,
                       const std::vector<int>& at,
                       const Eigen::VectorXd& variance,
                       const Eigen::MatrixXd& P, const JointScales* scales) {
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(at.size(), at.size());
  Eigen::VectorXd g = Eigen::VectorXd::Zero(at.size());
  for (int v = 0; v < variance.size(); ++v) {
    if (!(products.times[v] > 0.0)) continue;
    const JointProducts& own = products.of[v];
    const Acting acting = ActingOn(own, at);
    Eigen::MatrixXd own_G = own.G(acting.place, acting.place) / variance[v];
    Eigen::VectorXd own_g =
        own.G.col(own.G.cols() - 1)(acting.place) / variance[v];
    if (scales != nullptr && scales->of[v] != 1.0) {
      const Eigen::VectorXd scale =
          scales->Times(v, at, Eigen::VectorXd::Ones(at.size()))(acting.at);
      own_G = scale.asDiagonal() * own_G * scale.asDiagonal();
      own_g = scale.cwiseProduct(own_g);
    }
    G(acting.at, acting.at) += own_G;
    g(acting.at) += own_g;
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
