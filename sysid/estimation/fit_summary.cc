#include "sysid/estimation/fit_summary.h"

#include <algorithm>

#include "sysid/estimation/elimination.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/shooting_stage.h"

namespace sysid {

void SummarizeFit(const ShootingProblem& problem, const ShootingPoint& point,
                  double fitted, Fit* fit) {
  const int n = problem.map().size();
  fit->point = point;
  ShootingStage::Options options;
  options.defect = fit->defect;
  const ShootingStage stage(problem, options, &fit->point);
  RowMatrixXd R = RowMatrixXd::Zero(n, n + 1);
  std::vector<RunLinearization> runs;
  RowMatrixXd J_prior;
  Eigen::VectorXd r_prior;
  stage.LinearizePriors(&J_prior, &r_prior);
  if (stage.Linearize(&runs, ShootingStage::Rows::kTriangular)) {
    R = EliminateStates(runs, J_prior, r_prior, problem.options().threads);
  } else {
    fit->converged = false;
  }
  fit->train = EvaluateErrors(problem, point, fitted);
  const double chi2 =
      fit->train.total.normalized_rms * fit->train.total.normalized_rms;
  const double inflation =
      std::max(1.0, chi2) * AutocorrelationTime(problem, point);
  Estimates estimates =
      MakeEstimates(problem, point.theta, R.leftCols(n), inflation);
  fit->parameters = std::move(estimates.parameters);
  fit->not_identifiable = std::move(estimates.not_identifiable);
  fit->covariance = std::move(estimates.covariance);
  MechanismParameters<double> values;
  problem.map().Apply<double>(point.theta.data(), &values);
  fit->model.SetNominal(values);
  fit->step_s = problem.options().rollout.step;
  fit->segment_s = MeanSegment(problem, point);
}

}  // namespace sysid
