#pragma once

#include <string>
#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

struct ParameterEstimate {
  std::string name, unit;
  double initial = 0.0, value = 0.0;
  double lower = 0.0, upper = 0.0;  // +-infinity where none
  // NaN where the data does not determine the parameter, or where it is held
  // by its bound.
  double std_error = 0.0;
  double ci95[2] = {0.0, 0.0};
  bool at_bound = false;
  bool identifiable = true;
};

// Parameters with their uncertainty.
struct Estimates {
  std::vector<ParameterEstimate> parameters;
  // By name: groups that the data cannot tell apart, and single parameters that
  // it says nothing of.
  std::vector<std::vector<std::string>> not_identifiable;
  Eigen::MatrixXd covariance;  // of the parameters' values
  // Of theta (models/parameters.h), from which that follows by
  // ParameterMap::ValueJacobian: zero along what the data does not determine.
  Eigen::MatrixXd theta_covariance;
  // Moves of the values that the data does not determine, each of one standard
  // deviation, or 1e6 sizes: values x their number.
  Eigen::MatrixXd undetermined;
};

// "a is not identifiable from this data", of a group of
// Estimates::not_identifiable.
std::string NotIdentifiable(const std::vector<std::string>& group);

// The sizes of theta: 1 where it is a logarithm or a ratio by (4.1), else the
// larger of |theta_i| and a typical one.
Eigen::VectorXd ThetaScale(const ShootingProblem& problem,
                           const Eigen::VectorXd& theta);

// Whether a value is at one of its bounds.
bool HeldByBounds(const FreeParameter& free, double value);

// Of one parameter; std_error NaN where it has none.
ParameterEstimate MakeEstimate(const FreeParameter& free, double value,
                               double std_error, bool identifiable);

// From the triangular factor R of theta's information (EliminateStates) and the
// covariance of the score J^T r, R^T R where the residuals are white and of
// unit variance. Theta's covariance is
//
//   (R^T R)^-1 score_covariance (R^T R)^-1
//
// (Huber 1967; White 1982), over the directions that the data determines, with
// parameters at a bound held there.
Estimates MakeEstimates(const ShootingProblem& problem,
                        const Eigen::VectorXd& theta, const RowMatrixXd& R,
                        const Eigen::MatrixXd& score_covariance);

}  // namespace sysid
