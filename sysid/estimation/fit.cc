#include "sysid/estimation/fit.h"

#include <algorithm>

#include "sysid/estimation/elimination.h"
#include "sysid/estimation/linearization.h"
#include "sysid/estimation/segmentation.h"

namespace sysid {

void SummarizeFit(const ShootingProblem& problem, const Solution& point,
                  double fitted, Fit* fit, double tangent_step) {
  const int n = problem.map().size();
  fit->point = point;
  RowMatrixXd R = RowMatrixXd::Zero(n, n + 1);
  std::vector<RunLinearization> runs;
  RowMatrixXd J_prior;
  Eigen::VectorXd r_prior;
  LinearizePriors(problem, point.theta, &J_prior, &r_prior);
  if (Linearize(problem, point,
                {.defect = fit->defect, .tangent_step = tangent_step}, &runs)) {
    R = EliminateStates(runs, J_prior, r_prior, problem.options().threads,
                        problem.processes());
  } else {
    fit->converged = false;
  }
  double correlated = 1.0;
  fit->train = EvaluateErrors(problem, point, fitted, &correlated);
  const double chi2 = WeighedSquare(problem, fit->train);
  const double inflation = std::max(1.0, chi2) * correlated;
  const RowMatrixXd root = R.leftCols(n);
  static_cast<Estimates&>(*fit) = MakeEstimates(
      problem, point.theta, root, inflation * root.transpose() * root);
  fit->misfit = problem.misfit();
  MechanismParameters<double> values;
  problem.map().Apply<double>(point.theta.data(), &values);
  fit->model.SetNominal(values);
  fit->step_s = point.rollout.step;
  fit->segment_s = MeanSegment(problem, point);
}

bool HasBound(const Fit& fit) {
  return std::any_of(fit.parameters.begin(), fit.parameters.end(),
                     [](const ParameterEstimate& p) { return p.at_bound; });
}

bool IsDoubtful(const Fit& fit) { return !fit.converged || HasBound(fit); }

}  // namespace sysid
