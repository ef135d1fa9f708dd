#pragma once

#include "sysid/estimation/fit.h"
#include "sysid/inverse_dynamics/coordinates.h"

namespace sysid {

// What the equations of motion determine of the coordinates: as many
// combinations as [R] has independent columns (Gautier 1991). Columns are taken
// from the base to the tip; one that depends on those before it,
//
//   R_c = sum_i b_i R_i,                                               (11.9)
//
// is regrouped: coordinate i stands for xi_i + b_i xi_c. A column without
// influence is in no combination. Standard errors are those of a z beside R
// with the covariance E E^T.
std::vector<BaseParameter> BaseParameters(
    const EquationCoordinates& coordinates, const RowMatrixXd& R,
    const RowMatrixXd& E, const Eigen::VectorXd& xi);

// What the regression tells of each parameter alone: its value is determined
// where no change of theta that the rows A (d xi / d theta under R) do not
// notice moves it. Others are listed in groups that such a change joins. How
// well it is known is its standard error's to say.
Estimates EstimatesByRank(const ShootingProblem& problem,
                          const Eigen::VectorXd& theta, const RowMatrixXd& A,
                          const RowMatrixXd& E);

}  // namespace sysid
