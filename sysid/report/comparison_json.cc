#include "models/integrator.h"
#include "sysid/report/comparison_report.h"
#include "sysid/report/findings.h"
#include "sysid/report/json.h"
#include "sysid/report/mixture_report.h"

namespace sysid {

SYSID_JSON(PathPoint, iteration, time_s, loss, values)
SYSID_JSON(Landscape, x, y, deviance)

namespace {

Json OfSolver(const SolverRun& run) {
  const auto estimate = [](const ParameterEstimate& p) -> Json {
    return {{"name", p.name},
            {"value", Finite(p.value)},
            {"std_error", Finite(p.std_error)},
            {"identifiable", p.identifiable}};
  };
  Json json = {{"solver", run.solver},
               {"converged", run.fit.converged},
               {"termination", run.fit.termination},
               {"iterations", run.fit.iterations},
               {"settled_at", run.settled},
               {"integrator", ToString(run.fit.point.rollout.integrator)},
               {"segment_s", Finite(run.fit.segment_s)},
               {"evaluations", run.fit.evaluations},
               {"time_s", run.fit.wall_time_s},
               {"loss_start", Finite(run.path.front().loss)},
               {"loss", Finite(run.path.back().loss)},
               {"normalized_rms", Finite(run.fit.train.total.normalized_rms)},
               {"distance", Finite(run.distance)},
               {"parameters", List(run.fit.parameters, estimate)},
               {"not_identifiable", run.fit.not_identifiable},
               {"path", run.path}};
  if (run.mixture) {
    json["mixture"] = run.mixture->mixture;
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
  json["integrator"] = ToString(comparison.rollout.integrator);
  json["parameters"] = comparison.names;
  json["start"] = Finite(comparison.start);
  json["reference"] = Finite(comparison.reference);
  json["reference_is_truth"] = comparison.reference_is_truth;
  json["stopped"] = StoppedJson(comparison.stopped_by);
  json["solvers"] = List(comparison.runs, OfSolver);
  json["uncertainty"] =
      List(comparison.uncertainty, [](const UncertaintyComparison& u) -> Json {
        return {{"name", u.parameter},
                {"unit", u.unit},
                {"lm_std", Finite(u.lm_std)},
                {"mixture_std", Finite(u.mixture_std)},
                {"why", u.why}};
      });
  json["trials"] =
      List(comparison.trials, [&](const ComparedStart& trial) -> Json {
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
        return {{"seed", trial.seed},
                {"start", Finite(trial.start)},
                {"solvers", solvers}};
      });
  if (comparison.landscape) json["landscape"] = *comparison.landscape;
  json["skipped_runs"] = session.skipped_runs;
  json["notices"] = session.notices;
  return Dump(json);
}

}  // namespace sysid
