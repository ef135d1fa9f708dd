#include <cmath>

#include "models/integrator.h"
#include "sysid/report/comparison_report.h"
#include "sysid/report/json.h"

namespace sysid {
namespace {

Json List(const Eigen::VectorXd& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(Finite(value));
  return list;
}

Json List(const Eigen::MatrixXd& rows) {
  Json list = Json::array();
  for (int i = 0; i < rows.rows(); ++i) {
    list.push_back(List(Eigen::VectorXd(rows.row(i))));
  }
  return list;
}

Json Path(const std::vector<PathPoint>& path) {
  Json list = Json::array();
  for (const PathPoint& point : path) {
    list.push_back({{"iteration", point.iteration},
                    {"time_s", point.time_s},
                    {"loss", Finite(point.loss)},
                    {"values", List(point.values)}});
  }
  return list;
}

Json OfSolver(const SolverRun& run) {
  Json estimates = Json::array();
  for (const ParameterEstimate& p : run.fit.parameters) {
    estimates.push_back({{"name", p.name},
                         {"value", Finite(p.value)},
                         {"std_error", Finite(p.std_error)},
                         {"identifiable", p.identifiable}});
  }
  Json json = {{"solver", run.solver},
               {"converged", run.fit.converged},
               {"termination", run.fit.termination},
               {"iterations", run.fit.iterations},
               {"settled_at", run.settled},
               {"segment_s", Finite(run.fit.segment_s)},
               {"evaluations", run.fit.evaluations},
               {"time_s", run.fit.wall_time_s},
               {"loss_start", Finite(run.path.front().loss)},
               {"loss", Finite(run.path.back().loss)},
               {"normalized_rms", Finite(run.fit.train.total.normalized_rms)},
               {"distance", Finite(run.distance)},
               {"parameters", estimates},
               {"not_identifiable", run.fit.not_identifiable},
               {"path", Path(run.path)}};
  if (run.mixture) {
    const ParameterMixture& kernels = run.mixture->mixture;
    json["mixture"] = {{"weights", List(kernels.weights)},
                       {"means", List(kernels.means)},
                       {"stds", List(kernels.stds)}};
    json["disagreeing"] = run.mixture->disagreeing;
    json["remarks"] = run.mixture->remarks;
  }
  return json;
}

}  // namespace

std::string ComparisonJson(const Session& session,
                           const Comparison& comparison) {
  Json json;
  json["schema"] = "sysid.comparison/1";
  json["model"] = session.model_name;
  json["integrator"] = ToString(session.options.rollout.integrator);
  json["parameters"] = comparison.names;
  json["start"] = List(comparison.start);
  json["reference"] = List(comparison.reference);
  json["reference_is_truth"] = comparison.reference_is_truth;
  json["solvers"] = Json::array();
  for (const SolverRun& run : comparison.runs) {
    json["solvers"].push_back(OfSolver(run));
  }
  json["uncertainty"] = Json::array();
  for (const UncertaintyComparison& u : comparison.uncertainty) {
    json["uncertainty"].push_back({{"name", u.parameter},
                                   {"unit", u.unit},
                                   {"lm_std", Finite(u.lm_std)},
                                   {"mixture_std", Finite(u.mixture_std)},
                                   {"why", u.why}});
  }
  json["trials"] = Json::array();
  for (const ComparedStart& trial : comparison.trials) {
    Json solvers = Json::array();
    for (size_t s = 0; s < trial.solvers.size(); ++s) {
      const SolverTrial& t = trial.solvers[s];
      solvers.push_back({{"solver", comparison.runs[s].solver},
                         {"converged", t.converged},
                         {"iterations", t.iterations},
                         {"settled_at", t.settled},
                         {"evaluations", t.evaluations},
                         {"time_s", t.time_s},
                         {"loss", Finite(t.loss)},
                         {"normalized_rms", Finite(t.error)},
                         {"distance", Finite(t.distance)}});
    }
    json["trials"].push_back({{"seed", trial.seed},
                              {"start", List(trial.start)},
                              {"solvers", solvers}});
  }
  if (comparison.landscape) {
    json["landscape"] = {{"x", List(comparison.landscape->x)},
                         {"y", List(comparison.landscape->y)},
                         {"deviance", List(comparison.landscape->deviance)}};
  }
  json["notices"] = session.notices;
  return Dump(json);
}

}  // namespace sysid
