#pragma once

#include <utility>

#include "sysid/estimation/shooting_problem.h"
#include "sysid/estimation/theta_equations.h"
#include "sysid/inverse_dynamics/coordinates.h"

namespace sysid {

// (11.4) at its minimum, as equations of theta.
class RegressionEquations final : public ThetaEquations {
 public:
  // `triangle` is [R z] about the coordinates xi0.
  RegressionEquations(const ShootingProblem& problem,
                      const RowMatrixXd& triangle, Eigen::VectorXd xi0)
      : problem_(problem),
        coordinates_(problem_.model(), problem_.map().parameters()),
        R_(triangle.leftCols(triangle.cols() - 1)),
        z_(triangle.rightCols<1>()),
        xi0_(std::move(xi0)) {}
  int rows() const override { return static_cast<int>(z_.size()); }
  void Evaluate(const double* theta, double* r, RowMatrixXd* J) const override;

 private:
  const ShootingProblem problem_;  // shares the question
  const EquationCoordinates coordinates_;
  const RowMatrixXd R_;
  const Eigen::VectorXd z_, xi0_;
};

}  // namespace sysid
