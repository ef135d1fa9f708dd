#pragma once

#include <vector>

#include "sysid/inverse_dynamics/equation_rows.h"

namespace sysid {

// Products of [J | r] of a joint, of those columns alone that act on it.
struct JointProducts {
  JointProducts() = default;
  // Of all columns.
  explicit JointProducts(Eigen::MatrixXd products);

  // By column: its place in G, or -1 where it does not act on the joint.
  std::vector<int> place;
  Eigen::MatrixXd G;  // r last

  bool Has(int column) const {
    return place[column] >= 0 && G(place[column], place[column]) != 0.0;
  }
};

// Sums of them over a stretch of time.
struct EquationProducts {
  std::vector<JointProducts> of;  // by joint
  Eigen::VectorXd times;          // that tell of it

  // |r + J d|^2 of a joint; d of the columns `at`.
  double Left(int joint, const std::vector<int>& at,
              const Eigen::VectorXd& d) const;
  // |J d|^2.
  double Moved(int joint, const std::vector<int>& at,
               const Eigen::VectorXd& d) const;
};

// By joint: JointProducts::place of runs.
std::vector<std::vector<int>> ColumnsOfJoints(
    const std::vector<EquationRows>& runs);
// Of the times [from, to) of rows, but for those at which the joint may rest:
// what holds it then no law says.
EquationProducts MultiplyRows(const EquationRows& rows, int from, int to,
                              const std::vector<std::vector<int>>& columns);
// sum += more.
void AddProducts(const EquationProducts& more, EquationProducts* sum);

// The least x with G x = g, of columns of unit length.
Eigen::VectorXd SolveScaled(const Eigen::MatrixXd& G, const Eigen::VectorXd& g);
// Of d, by column.
struct ChangeBounds {
  Eigen::VectorXd lower, upper;
};

// Of each joint by how much its columns are scaled, but for one of them (-1:
// all).
struct JointScales {
  Eigen::VectorXd of;
  std::vector<int> but;

  // The changes that columns are scaled for.
  Eigen::VectorXd Times(int joint, const std::vector<int>& at,
                        const Eigen::VectorXd& d) const;
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
                       const Eigen::MatrixXd& P = {},
                       const JointScales* scales = nullptr);

// The d of least such sum within bounds: what passes one is held there, and the
// others are solved for again.
Eigen::VectorXd SolveWeighted(const WeightedProducts& weighted,
                              const std::vector<int>& at,
                              const ChangeBounds& bounds);

}  // namespace sysid
