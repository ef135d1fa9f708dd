#pragma once

#include <algorithm>
#include <vector>

#include "sysid/inverse_dynamics/equation_rows.h"

namespace sysid {

// Sums of products of [J | r] of each joint over a stretch of time.
struct EquationProducts {
  std::vector<Eigen::MatrixXd> of;  // by joint
  Eigen::VectorXd times;            // that tell of it

  // |r + J d|^2 of a joint; d of the columns `at`.
  double Left(int joint, const std::vector<int>& at,
              const Eigen::VectorXd& d) const {
    const Eigen::MatrixXd& G = of[joint];
    const int last = static_cast<int>(G.cols()) - 1;
    double sum = G(last, last);
    for (size_t i = 0; i < at.size(); ++i) {
      sum += 2.0 * d[i] * G(at[i], last);
      for (size_t k = 0; k < at.size(); ++k) {
        sum += d[i] * d[k] * G(at[i], at[k]);
      }
    }
    return std::max(sum, 0.0);
  }
};

// Of the times [from, to) of rows, but for those at which the joint may rest:
// what holds it then no law says.
EquationProducts MultiplyRows(const EquationRows& rows, int from, int to);
// sum += times * more.
void AddProducts(const EquationProducts& more, double times,
                 EquationProducts* sum);

// The least x with G x = g, of columns of unit length.
Eigen::VectorXd SolveScaled(const Eigen::MatrixXd& G, const Eigen::VectorXd& g);
// Of d, by column.
struct ChangeBounds {
  Eigen::VectorXd lower, upper;
};

// G and g of sum_v |r_v + J_v d|^2 / s_v^2 + d' P d, its halves' curvature and
// slope at d = 0, of the columns `at`; P of all columns, or empty.
struct WeightedProducts {
  Eigen::MatrixXd G;
  Eigen::VectorXd g;
};
WeightedProducts Weigh(const EquationProducts& products,
                       const std::vector<int>& at,
                       const Eigen::VectorXd& variance,
                       const Eigen::MatrixXd& P = {});

// The d of least such sum within bounds: what passes one is held there, and the
// others are solved for again.
Eigen::VectorXd SolveWeighted(const WeightedProducts& weighted,
                              const std::vector<int>& at,
                              const ChangeBounds& bounds);

}  // namespace sysid
