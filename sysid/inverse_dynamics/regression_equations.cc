#include "sysid/inverse_dynamics/regression_equations.h"

#include <utility>

namespace sysid {

void RegressionEquations::Evaluate(const double* theta, double* r,
                                   RowMatrixXd* J) const {
  Eigen::VectorXd xi;
  if (J != nullptr) {
    CoordinatesAt at =
        DifferentiateCoordinates(coordinates_, problem_.map(), theta);
    *J = R_ * at.D;
    xi = std::move(at.xi);
  } else {
    MechanismParameters<double> values;
    problem_.map().Apply<double>(theta, &values);
    xi.resize(coordinates_.size());
    coordinates_.Read<double>(values, xi.data());
  }
  Eigen::Map<Eigen::VectorXd>(r, rows()) = R_ * (xi - xi0_) + z_;
}

}  // namespace sysid
