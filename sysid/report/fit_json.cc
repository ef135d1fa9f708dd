#include <cmath>
#include <limits>

#include "models/integrator.h"
#include "sysid/io/cell.h"
#include "sysid/report/findings.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/json.h"
#include "sysid/report/mixture_report.h"

namespace sysid {
namespace {

Json Parameters(const Session& session, const Fit& fit) {
  const auto written = [](const ParameterEstimate& p) -> Json {
    Json ci95 = nullptr;
    if (std::isfinite(p.ci95[0]) && std::isfinite(p.ci95[1])) {
      ci95 = {p.ci95[0], p.ci95[1]};
    }
    return {{"name", p.name},
            {"unit", p.unit},
            {"initial", Finite(p.initial)},
            {"value", Finite(p.value)},
            {"std_error", Finite(p.std_error)},
            {"ci95", ci95},
            {"lower", Finite(p.lower)},
            {"upper", Finite(p.upper)},
            {"at_bound", p.at_bound},
            {"identifiable", p.identifiable}};
  };
  return List(ReportedParameters(session, fit), written);
}

// The cost and time of each epoch, and the kernels after it; first those of the
// start.
Json MixtureHistory(const MixtureFit& mixture) {
  Json history = Json::array();
  for (size_t i = 0; i < mixture.epochs.size(); ++i) {
    const MixtureEpoch& epoch = mixture.epochs[i];
    const HistoryEntry* entry =
        i < mixture.fit.history.size() ? &mixture.fit.history[i] : nullptr;
    Json json = {{"iteration", epoch.epoch},
                 {"cost", entry ? Finite(entry->cost) : Json(nullptr)},
                 {"time_s", entry ? entry->time_s : 0.0},
                 {"rollouts", epoch.rollouts}};
    json.update(Json(epoch.kernels));
    history.push_back(json);
  }
  return history;
}

}  // namespace

std::vector<ParameterEstimate> ReportedParameters(const Session& session,
                                                  const Fit& fit) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<ParameterEstimate> list = fit.parameters;
  // Whole numbers of effects are searched, not fitted.
  const EffectSet& effects = fit.model.effects();
  for (size_t i = 0; i < effects.parameters().size(); ++i) {
    const EffectParameter& p = effects.parameters()[i];
    if (!p.whole || Contains(session.fixed, p.name)) continue;
    list.push_back({p.name,
                    p.unit,
                    p.null_value,
                    fit.model.nominal().effects[i],
                    p.lower,
                    p.upper,
                    kNone,
                    {kNone, kNone},
                    false,
                    true});
  }
  return list;
}

std::string FitJson(const Session& session, const ShootingProblem& problem,
                    const Fit& fit, const Holdout* holdout,
                    const AddedEffects* added, const MixtureFit* mixture) {
  Json error;
  error["train"] = fit.train.total;
  error["holdout"] = holdout ? Json(holdout->errors.total) : Json(nullptr);
  error["channels"] = fit.train.channels;
  error["horizon"] = fit.horizon;
  error["segments"] = fit.train.segments;
  error["open"] = OpenJson(fit.open, false);
  error["effort"] = fit.effort;
  error["effort_cut_off_hz"] =
      fit.cut_off_hz > 0.0 ? Finite(fit.cut_off_hz) : Json(nullptr);
  if (holdout) {
    error["holdout_effort"] = holdout->effort;
    error["holdout_channels"] = holdout->errors.channels;
    for (const Json& open : OpenJson(holdout->open, true)) {
      error["open"].push_back(open);
    }
  }
  Json json;
  json["schema"] = "sysid.fit/1";
  json["model"] = session.model_name;
  json["solver"] = fit.solver;
  json["converged"] = fit.converged;
  json["termination"] = fit.termination;
  json["stopped"] = StoppedJson(fit.stopped_by);
  json["iterations"] = fit.iterations;
  json["wall_time_s"] = fit.wall_time_s;
  json["cpu_time_s"] = fit.cpu_time_s;
  if (fit.processes > 0) json["processes"] = fit.processes;
  json["integrator"] = ToString(fit.point.rollout.integrator);
  json["step_s"] = Finite(fit.step_s);
  json["linearization"] =
      ToString(PathOf(problem.model(), problem.options().rollout));
  json["segment_s"] = Finite(fit.segment_s);
  json["samples"] = fit.samples;
  json["parameters"] = Parameters(session, fit);
  json["correlation"] = Correlation(fit.covariance);
  json["not_identifiable"] = fit.not_identifiable;
  if (!fit.base.empty()) json["base_parameters"] = fit.base;
  json["effects"] = session.effects;
  if (added != nullptr) {
    const auto held = [&](double error) {
      return holdout ? Finite(error) : Json(nullptr);
    };
    json["added"] = {
        {"effects", added->effects},
        {"predicted",
         added->predicted > 0 ? Finite(added->predicted) : Json(nullptr)},
        {"train_before", Finite(added->train_before)},
        {"train_after", Finite(added->train_after)},
        {"holdout_before", held(added->holdout_before)},
        {"holdout_after", held(added->holdout_after)}};
  }
  json["noise"] = Finite(fit.noise);
  json["discrepancy"] = fit.discrepancy;
  json["error"] = error;
  if (mixture != nullptr) {
    json["mixture"] = mixture->mixture;
    json["remarks"] = mixture->remarks;
  }
  json["history"] = mixture ? MixtureHistory(*mixture) : Json(fit.history);
  json["findings"] = session.findings;
  json["skipped_runs"] = session.skipped_runs;
  json["notices"] = session.notices;
  return Dump(json);
}

std::string FitJson(const IdentifyResult& result) {
  return FitJson(result.session, *result.problem, result.fit(),
                 result.holdout ? &*result.holdout : nullptr,
                 result.added ? &*result.added : nullptr,
                 result.solved.mixture ? &*result.solved.mixture : nullptr);
}

}  // namespace sysid
