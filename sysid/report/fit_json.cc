#include <cmath>
#include <nlohmann/json.hpp>

#include "models/integrator.h"
#include "sysid/report/fit_report.h"

namespace sysid {
namespace {

using Json = nlohmann::ordered_json;

Json Finite(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json Summary(const ErrorSummary& error) {
  return {{"rms", Finite(error.rms)},
          {"normalized_rms", Finite(error.normalized_rms)}};
}

Json Channels(const RunErrors& errors) {
  Json list = Json::array();
  for (const ChannelError& channel : errors.channels) {
    list.push_back({{"name", channel.name},
                    {"unit", channel.unit},
                    {"rms", Finite(channel.rms)},
                    {"normalized_rms", Finite(channel.normalized_rms)},
                    {"noise", Finite(channel.noise)}});
  }
  return list;
}

void AppendOpen(const std::vector<OpenError>& open, bool held_out, Json* list) {
  for (const OpenError& run : open) {
    Json channels = Json::array();
    for (const OpenError::Channel& channel : run.channels) {
      channels.push_back({{"name", channel.name},
                          {"rms", Finite(channel.rms)},
                          {"unit", channel.unit}});
    }
    list->push_back({{"trajectory", run.trajectory},
                     {"duration_s", Finite(run.duration_s)},
                     {"held_out", held_out},
                     {"channels", channels}});
  }
}

Json Parameters(const Fit& fit) {
  Json list = Json::array();
  for (const ParameterEstimate& p : fit.parameters) {
    Json ci95 = nullptr;
    if (std::isfinite(p.ci95[0]) && std::isfinite(p.ci95[1])) {
      ci95 = {p.ci95[0], p.ci95[1]};
    }
    list.push_back({{"name", p.name},
                    {"unit", p.unit},
                    {"initial", Finite(p.initial)},
                    {"value", Finite(p.value)},
                    {"std_error", Finite(p.std_error)},
                    {"ci95", ci95},
                    {"lower", Finite(p.lower)},
                    {"upper", Finite(p.upper)},
                    {"at_bound", p.at_bound},
                    {"identifiable", p.identifiable}});
  }
  return list;
}

Json Correlation(const Fit& fit) {
  Json rows = Json::array();
  const int n = static_cast<int>(fit.covariance.rows());
  for (int i = 0; i < n; ++i) {
    Json row = Json::array();
    for (int j = 0; j < n; ++j) {
      row.push_back(
          Finite(fit.covariance(i, j) /
                 std::sqrt(fit.covariance(i, i) * fit.covariance(j, j))));
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

std::string FitJson(const Session& session, const ShootingProblem& problem,
                    const Fit& fit, const Holdout* holdout) {
  Json error;
  error["train"] = Summary(fit.train.total);
  error["holdout"] = holdout ? Summary(holdout->errors.total) : Json(nullptr);
  error["channels"] = Channels(fit.train);
  error["horizon"] = Json::array();
  for (const HorizonError& h : fit.horizon) {
    error["horizon"].push_back(
        {{"horizon_s", h.horizon_s}, {"rms", Finite(h.rms)}});
  }
  error["segments"] = Json::array();
  for (const SegmentError& s : fit.train.segments) {
    error["segments"].push_back({{"trajectory", s.trajectory},
                                 {"t_start", s.t_start},
                                 {"t_end", s.t_end},
                                 {"normalized_rms", Finite(s.normalized_rms)}});
  }
  error["open"] = Json::array();
  AppendOpen(fit.open, false, &error["open"]);
  if (holdout) {
    error["holdout_channels"] = Channels(holdout->errors);
    AppendOpen(holdout->open, true, &error["open"]);
  }
  Json history = Json::array();
  for (const HistoryEntry& entry : fit.history) {
    history.push_back({{"iteration", entry.iteration},
                       {"cost", Finite(entry.cost)},
                       {"time_s", entry.time_s}});
  }
  Json json;
  json["schema"] = "sysid.fit/1";
  json["model"] = session.model_name;
  json["solver"] = fit.solver;
  json["converged"] = fit.converged;
  json["termination"] = fit.termination;
  json["iterations"] = fit.iterations;
  json["wall_time_s"] = fit.wall_time_s;
  json["integrator"] = ToString(problem.options().rollout.integrator);
  json["step_s"] = Finite(fit.step_s);
  json["segment_s"] = Finite(fit.segment_s);
  json["samples"] = fit.samples;
  json["parameters"] = Parameters(fit);
  json["correlation"] = Correlation(fit);
  json["not_identifiable"] = fit.not_identifiable;
  json["effects"] = session.effects;
  json["noise"] = Finite(fit.noise);
  json["error"] = error;
  json["history"] = history;
  json["notices"] = session.notices;
  // Text from files may be no UTF-8: replaced, never refused.
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace sysid
