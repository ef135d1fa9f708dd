#pragma once

#include <cmath>
#include <vector>

#include "models/math/decompositions.h"
#include "sysid/estimation/processes.h"
#include "sysid/unexplained_force/block_tridiagonal.h"

namespace sysid {

// What the data says of forces at knots, and how smooth they are.

// The normal equations of (7.7): |r + A phi + Theta dtheta|^2, the states
// projected out. Unknowns are the forces at the knots of each run, in the order
// of time, the degrees of freedom of a knot together, and the parameters.
struct ForceEquations {
  struct Run {
    int knots = 0;
    BlockTridiagonal G;  // A' A
    Eigen::MatrixXd C;   // A' Theta
    Eigen::VectorXd g;   // A' r
  };
  std::vector<Run> runs;
  Eigen::MatrixXd N;  // Theta' Theta, positive definite
  Eigen::VectorXd t;  // Theta' r
  int nv = 0;
  double squares = 0.0, dof = 0.0;  // of r, less what was fitted
  // That share out the runs: N, t, squares and dof are of all of them.
  const Processes* processes = &Alone();
};

// P0^-1 far from the ends of a run: the correlation of two forces that are so
// many time scales apart.
double ForceCorrelation(double apart);

// The forces with the prior (7.8) whose widths s, one for each degree of
// freedom, and time scale ell make the data most likely.
class SmoothForce {
 public:
  explicit SmoothForce(const ForceEquations& equations);

  // Whether the forces could be solved for: not where the weights are so unlike
  // that rounding is all there is. Else nothing below means anything.
  bool Valid() const { return std::isfinite(solution_.determinants); }
  // Whether the data shows forces on a degree of freedom at all.
  bool Seen(int dof) const { return point_.reach[dof] > 0; }
  // Of each run, knots * nv rows; of a run, knots x nv.
  const std::vector<Eigen::VectorXd>& Forces() const { return solution_.phi; }
  RowMatrixXd Values(int run) const;
  RowMatrixXd Deviations(int run) const;
  // The change of the parameters that goes with the forces.
  const Eigen::VectorXd& ParameterChange() const { return solution_.dtheta; }
  // What would come out were the forces these: of each run, knots * nv rows.
  std::vector<Eigen::MatrixXd> Smooth(
      const std::vector<Eigen::MatrixXd>& forces) const;
  // The part of |phi|^2, over some rows of each run, that is expected of noise
  // alone.
  double NoiseSquares(const std::vector<std::vector<int>>& rows) const;
  // How many independent numbers the data tells of degrees of freedom
  // [first, first + count).
  double Determined(int first, int count) const {
    return solution_.determined.segment(first, count).sum();
  }
  // The probability that those have no force, by the likelihood, and their part
  // of what all forces do to the errors (sums of squares, each alone).
  struct Weight {
    double p_value = 1.0;
    double share = 0.0;
  };
  Weight WeightOf(int first, int count) const;
  // tr(G P0^-1): by how much a force of unit width changes the sum of squares.
  double reach(int dof) const { return point_.reach[dof]; }
  double variance() const { return point_.variance; }  // of what remains
  double width(int dof) const { return std::sqrt(point_.s2[dof]); }
  double time_scale() const { return point_.ell; }  // in knots

 private:
  struct Point {
    double ell = 0.0;
    Eigen::VectorXd reach;  // tr(G P0^-1) of each degree of freedom
    Eigen::VectorXd s2;     // widths, squared
    double variance = 1.0;
    double likelihood = 0.0;  // twice its logarithm
  };
  // Everything at a point.
  struct Solution {
    std::vector<BlockCholesky> factors;  // of H = G / variance + P
    std::vector<Eigen::MatrixXd> Y;      // H^-1 C / variance
    Cholesky parameters;                 // of M, their Schur complement
    std::vector<Eigen::VectorXd> phi;
    Eigen::VectorXd dtheta;
    double squares = 0.0;    // that remain
    double roughness = 0.0;  // phi' P phi
    double determinants = 0.0;
    // Of each degree of freedom: phi' P0 phi, and how many numbers the data
    // determines.
    Eigen::VectorXd rough, determined;
    // The entries of H^-1 that have a block, and what the parameters add: Z Z'.
    std::vector<BlockTridiagonal> inverse;
    std::vector<Eigen::MatrixXd> Z;
    // An entry of (A' A / variance + P)^-1, with the parameters eliminated.
    double Covariance(size_t run, int row, int column) const {
      return inverse[run].At(row, column) +
             Z[run].row(row).dot(Z[run].row(column));
    }
    double LogLikelihood(double dof, double variance) const;
  };
  Solution Solve(const Point& point) const;
  // From right-hand sides A' y of each run and Theta' y, over the variance.
  std::vector<Eigen::MatrixXd> ForcesFrom(const Solution& at, double variance,
                                          std::vector<Eigen::MatrixXd> Ay,
                                          Eigen::MatrixXd Ty,
                                          Eigen::MatrixXd* dtheta) const;
  Eigen::VectorXd Reach(double ell) const;
  Point Step(const Point& point, const Solution& solution) const;
  void Converge(Point* point) const;
  Eigen::VectorXd Response() const;

  const ForceEquations& equations_;
  Point point_;
  Solution solution_;
};

}  // namespace sysid
