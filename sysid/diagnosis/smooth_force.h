#pragma once

#include <cmath>
#include <vector>

#include "sysid/diagnosis/block_tridiagonal.h"

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
};

// The forces with the prior (7.8) whose widths s, one for each degree of
// freedom, and time scale ell make the data most likely.
class SmoothForce {
 public:
  explicit SmoothForce(const ForceEquations& equations);

  // Whether the data shows forces on a degree of freedom at all.
  bool Seen(int dof) const { return reach_[dof] > 0; }
  // Of a run: knots x nv.
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
    return determined_.segment(first, count).sum();
  }
  // The probability that those have no force, by the likelihood, and their part
  // of what all forces do to the errors (sums of squares, each alone).
  struct Weight {
    double p_value = 1.0;
    double share = 0.0;
  };
  Weight WeightOf(int first, int count) const;
  double variance() const { return point_.variance; }  // of what remains
  double width(int dof) const { return std::sqrt(point_.s2[dof]); }
  double time_scale() const { return point_.ell; }  // in knots

 private:
  struct Point {
    double ell = 0.0;
    Eigen::VectorXd s2;  // widths, squared
    double variance = 1.0;
    double likelihood = 0.0;  // twice its logarithm
  };
  // Everything at a point.
  struct Solution {
    std::vector<BlockCholesky> factors;      // of H = G / variance + P
    std::vector<Eigen::MatrixXd> Y;          // H^-1 C / variance
    Eigen::LLT<Eigen::MatrixXd> parameters;  // of M, their Schur complement
    std::vector<Eigen::VectorXd> phi;
    Eigen::VectorXd dtheta;
    double squares = 0.0;    // that remain
    double roughness = 0.0;  // phi' P phi
    double determinants = 0.0;
    double LogLikelihood(double dof, double variance) const;
  };
  // The entries of (A' A / variance + P)^-1 that have a block, with the
  // parameters eliminated.
  struct Covariance {
    std::vector<BlockTridiagonal> blocks;
    std::vector<Eigen::MatrixXd> Z;  // for the parameters: plus Z Z'
    double At(int run, int row, int column) const {
      return blocks[run].At(row, column) +
             Z[run].row(row).dot(Z[run].row(column));
    }
  };
  Solution Solve(const Point& point) const;
  // From right-hand sides A' y of each run and Theta' y, over the variance.
  std::vector<Eigen::MatrixXd> Forces(const Solution& at, double variance,
                                      std::vector<Eigen::MatrixXd> Ay,
                                      Eigen::MatrixXd Ty,
                                      Eigen::MatrixXd* dtheta) const;
  Covariance CovarianceAt(const Solution& solution) const;
  // Where the fixed point leads, and what it tells of each degree of freedom.
  Point Step(const Point& point, const Solution& solution,
             Eigen::VectorXd* determined) const;
  Eigen::VectorXd Response() const;
  void SetReach(double ell);
  void Converge(Point* point);

  const ForceEquations& equations_;
  Eigen::VectorXd reach_;  // tr(G P0^-1) of each degree of freedom
  Point point_;
  Solution solution_;
  Covariance covariance_;
  Eigen::VectorXd response_;
  Eigen::VectorXd determined_;
};

}  // namespace sysid
