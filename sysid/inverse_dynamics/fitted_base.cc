#include "sysid/inverse_dynamics/fitted_base.h"

#include "models/math/decompositions.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/inverse_dynamics/base_parameters.h"
#include "sysid/inverse_dynamics/effort_comparison.h"
#include "sysid/inverse_dynamics/regression.h"

namespace sysid {
namespace {

// Of which the equations of the joints' motion do not tell.
bool HasInternalStates(const Model& model) { return model.layout().nz() > 0; }

void AddBaseParametersOf(const ShootingProblem& fitted, Fit* fit) {
  const ShootingProblem problem = WithRowsInMemory(fitted);
  const Model& model = problem.model();
  const ParameterMap& map = problem.map();
  if (map.size() == 0 || fit->covariance.rows() != map.size() ||
      !fit->covariance.allFinite()) {
    return;
  }
  if (!MeasuresAllJoints(problem) || HasInternalStates(model)) return;
  const double* theta = fit->point.theta.data();
  const EquationCoordinates coordinates(model, map.parameters());
  if (coordinates.Links().empty()) return;
  const CoordinatesAt at = DifferentiateCoordinates(coordinates, map, theta);
  if (RankOf(at.D) != coordinates.size()) return;
  MechanismParameters<double> values;
  map.Apply<double>(theta, &values);
  const EquationRegression regression = RegressEquations(
      problem, coordinates, SampleRuns(problem, ChooseFilter(problem, values)),
      values, UndrivenJoints(problem));
  if (regression.times() == 0 || regression.IsHomogeneous(at.xi)) return;
  const RowMatrixXd R = regression.Triangle().leftCols(coordinates.size());
  // d xi = D d theta = D (d values / d theta)^-1 d values.
  const Eigen::MatrixXd by_theta = SolveSquare(
      map.ValueJacobian(fit->point.theta), RootOfCovariance(fit->covariance));
  fit->base = BaseParameters(coordinates, R, R * at.D * by_theta, at.xi);
}

}  // namespace

void AddBaseParameters(const ShootingProblem& problem, Fit* fit) {
  // A fit that may be stopped with a point to keep keeps it.
  try {
    AddBaseParametersOf(problem, fit);
  } catch (const Cancelled&) {
    if (!problem.options().keep_best) throw;
  }
}

}  // namespace sysid
