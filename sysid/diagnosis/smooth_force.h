#pragma once

#include <vector>

#include "sysid/diagnosis/block_tridiagonal.h"

namespace sysid {

// What the data says of forces at knots, and how smooth they are.

// The normal equations of (7.6): per run |r + A phi|^2 = squares + 2 g' phi +
// phi' G phi. Unknowns are the forces at the knots, in the order of time, the
// degrees of freedom of a knot together.
struct ForceEquations {
  struct Run {
    int knots = 0;
    BlockTridiagonal G;
    Eigen::VectorXd g;
  };
  std::vector<Run> runs;
  // Of each degree of freedom: those of a group have the same width.
  std::vector<int> group;
  int groups = 0;
  double squares = 0.0, dof = 0.0;  // of all r

  int nv() const { return static_cast<int>(group.size()); }
};

// The forces with the prior (7.7) whose widths s, one for each group, and time
// scale ell make the data most likely.
class SmoothForce {
 public:
  explicit SmoothForce(const ForceEquations& equations);

  // Whether the data shows a group's forces at all.
  bool Seen(int group) const { return reach_[group] > 0; }
  // Of a run: knots x nv.
  RowMatrixXd Values(int run) const;
  RowMatrixXd Deviations(int run) const;
  // What would come out were the forces these: knots * nv rows.
  Eigen::MatrixXd Smooth(int run, const Eigen::MatrixXd& forces) const;
  // How many independent numbers the data tells of a group's forces.
  double Told(int group) const { return told_[group]; }
  // That a group has no force, by the likelihood.
  double PValue(int group) const;
  double variance() const { return point_.variance; }  // of what remains
  double width(int group) const;                       // s, N m or N
  double time_scale() const { return point_.ell; }     // in knots

 private:
  struct Point {
    double ell = 0.0;
    Eigen::VectorXd s2;  // widths, squared
    double variance = 1.0;
    double likelihood = 0.0;  // twice its logarithm
  };
  // Everything at a point; `update` is where the fixed point leads.
  struct Solution {
    std::vector<BlockCholesky> factors;
    std::vector<Eigen::VectorXd> phi;
    double squares = 0.0;    // that remain
    double roughness = 0.0;  // phi' P phi
    double determinants = 0.0;
    double LogLikelihood(double dof, double variance) const;
  };
  Solution Solve(const Point& point) const;
  Point Step(const Point& point, const Solution& solution,
             std::vector<BlockTridiagonal>* inverse,
             Eigen::VectorXd* told) const;
  void SetReach(double ell);
  void Converge(int most, Point* point);

  const ForceEquations& equations_;
  Eigen::VectorXd reach_;  // tr(G P0^-1) of each group
  Point point_;
  Solution solution_;
  std::vector<BlockTridiagonal> inverse_;
  Eigen::VectorXd told_;
};

}  // namespace sysid
