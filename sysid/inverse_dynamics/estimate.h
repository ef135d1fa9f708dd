#pragma once

#include "sysid/estimation/shooting_problem.h"
#include "sysid/inverse_dynamics/coordinates.h"

namespace sysid {

// The minimum of (11.4) over what a problem leaves free, within its bounds:
//
//   1/2 |R (xi - xi_0) + z|^2 + sum_k D(J_k, J_k0) + 1/2 sum_i ((v_i - m_i) /
//   s_i)^2.                                                            (11.7)
//
// k are the links all of whose ten inertial parameters are free, and
//
//   J = [S h; h^T m],  S = tr(I)/2 1 - I, all about the link's origin,
//   D(J, J_0) = tr(J_0^-1 J) - log det(J_0^-1 J) - 4,                  (11.8)
//
// the relative entropy of Gaussian clouds with the second moments J and J_0
// (Lee, Wensing and Park 2020). It is infinite where J is no body's, so that
// every point on the way is one, and curved like a standard deviation of the
// order of J_0 itself about the URDF's body, which decides what the data leave
// open. It is convex in xi: one minimum. An interior-point method finds it, in
// some forty steps of Newton's method on
//
//   (11.7) - (w - 1) sum_k log det J_k,                                (11.15)
//   J_k <- L_k (1 + S) L_k^T,   L_k L_k^T = J_k,                       (11.16)
//
// the weight w falling by tens to 1 from where log det J counts as much as the
// data, and the symmetric S in place of J: log det is then curved alike in all
// directions however near J is to singular. v are the other parameters, as the
// problem's map has them; priors are theirs, and where there is none a wide one
// (kWide typical sizes).
struct RegressionEstimate {
  Eigen::VectorXd theta;
  Eigen::VectorXd xi;
  int iterations = 0;
  bool converged = false;
  // R^T R is the curvature of (11.7) by theta without the entropy.
  RowMatrixXd R;
};

// From theta0, whose coordinates are xi_0; `triangle` is [R z].
RegressionEstimate EstimateByRegression(const ShootingProblem& problem,
                                        const EquationCoordinates& coordinates,
                                        const RowMatrixXd& triangle,
                                        const Eigen::VectorXd& theta0);

// The bodies of a whole arm are believed to within 30 % of the URDF's: of five
// arms of other people that predicts unseen motion best, or nearly so.
inline constexpr double kBodyWeight = 1.0 / (0.3 * 0.3);

// The curvature of D(J, J_0) of (11.8) at J_0 by the ten coordinates of a link,
//
//   tr(J_0^-1 E_i J_0^-1 E_j),   J = sum_i xi_i E_i:                   (11.18)
//
// what is believed of a body, to second order. Empty where J_0 is no body's.
Eigen::MatrixXd EntropyCurvature(const Inertial<double>& body);

// What (11.7) has beside the data: the entropies and the priors that were
// given; infinite where theta is no possible body.
double CostOfBeliefs(const ShootingProblem& problem,
                     const EquationCoordinates& coordinates,
                     const Eigen::VectorXd& theta);

}  // namespace sysid
