#include <algorithm>
#include <cmath>

#include "sysid/fleet/fleet.h"
#include "sysid/report/json.h"

namespace sysid {
namespace {

Json Interval(const std::array<double, 2>& interval) {
  if (!std::isfinite(interval[0]) || !std::isfinite(interval[1])) {
    return nullptr;
  }
  return {interval[0], interval[1]};
}

Json TextOrNull(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json Pooled(const RandomEffects& pooled) {
  if (pooled.count == 0) return nullptr;
  return {{"robots", pooled.count},
          {"mean", Finite(pooled.mean)},
          {"std_error", Finite(pooled.std_error)},
          {"ci95", Interval(pooled.Ci95())},
          {"predicted95", Interval(pooled.Predicted95())},
          {"tau", Finite(std::sqrt(pooled.tau2))},
          {"tau2", Finite(pooled.tau2)},
          {"i2", Finite(pooled.i2)},
          {"q", Finite(pooled.q)},
          {"q_p_value", Finite(pooled.QPValue())}};
}

Json DriftJson(const FleetParameter& parameter) {
  if (!parameter.drift) return nullptr;
  const Drift& drift = *parameter.drift;
  return {{"robots", drift.count},
          {"per_year", Finite(drift.slope)},
          {"std_error", Finite(drift.std_error)},
          {"ci95", Interval(drift.ci95)},
          {"p_value", Finite(drift.p_value)},
          {"significant", parameter.drift_significant}};
}

Json RobotJson(const Fleet& fleet, size_t index) {
  const Robot& robot = fleet.robots[index];
  return {
      {"name", robot.name},
      {"file", robot.file},
      {"status", StatusOf(robot)},
      {"reason", TextOrNull(robot.broken)},
      {"model", TextOrNull(robot.model)},
      {"verdict", TextOrNull(robot.verdict)},
      {"final_verdict", TextOrNull(robot.final_verdict)},
      {"missing", robot.missing},
      {"rivals", robot.rivals},
      {"train", robot.broken.empty() ? Finite(robot.train) : Json(nullptr)},
      {"holdout", robot.broken.empty() ? Finite(robot.holdout) : Json(nullptr)},
      {"outlier_in", OutliersOf(fleet, index)},
      {"not_compared", TextOrNull(robot.not_compared)},
      {"skipped_runs", robot.skipped_runs},
      {"recorded",
       robot.recorded ? Json(DateText(*robot.recorded)) : Json(nullptr)},
      {"recorded_from", TextOrNull(robot.recorded_from)}};
}

// How many times p is allowed for.
double Corrected(double p, int tests) { return std::min(1.0, p * tests); }

Json ParameterJson(const Fleet& fleet, const FleetParameter& parameter) {
  Json estimates = Json::array();
  for (size_t i = 0; i < parameter.robots.size(); ++i) {
    const Deviation& deviation = parameter.deviations[i];
    estimates.push_back(
        {{"robot", fleet.robots[parameter.robots[i]].name},
         {"value", Finite(parameter.estimates[i].value)},
         {"std_error", Finite(parameter.estimates[i].std_error)},
         {"deviation", Finite(deviation.deviation)},
         {"p_value", Finite(deviation.p_value)},
         {"outlier", bool{parameter.outlier[i]}}});
  }
  return {{"name", parameter.name},
          {"unit", parameter.unit},
          {"all", Pooled(parameter.all)},
          {"without_outliers", Pooled(parameter.without_outliers)},
          {"drift", DriftJson(parameter)},
          {"estimates", estimates},
          {"left_out", parameter.left_out}};
}

Json OutliersJson(const Fleet& fleet) {
  Json outliers = Json::array();
  for (const FleetParameter& parameter : fleet.parameters) {
    for (size_t i = 0; i < parameter.robots.size(); ++i) {
      if (!parameter.outlier[i]) continue;
      const Deviation& deviation = parameter.deviations[i];
      outliers.push_back(
          {{"robot", fleet.robots[parameter.robots[i]].name},
           {"parameter", parameter.name},
           {"unit", parameter.unit},
           {"value", Finite(parameter.estimates[i].value)},
           {"std_error", Finite(parameter.estimates[i].std_error)},
           {"others", Finite(deviation.others.mean)},
           {"deviation", Finite(deviation.deviation)},
           {"p_corrected", Finite(Corrected(deviation.p_value, fleet.tests))}});
    }
  }
  return outliers;
}

}  // namespace

std::string FleetJson(const Fleet& fleet) {
  Json robots = Json::array();
  for (size_t i = 0; i < fleet.robots.size(); ++i) {
    robots.push_back(RobotJson(fleet, i));
  }
  Json json;
  json["schema"] = "sysid.fleet/1";
  json["robots"] = robots;
  json["effects"] = List(fleet.effects, [](const FleetEffect& effect) -> Json {
    return {{"effect", effect.name},
            {"robots", effect.robots},
            {"rival_of", effect.rival_of}};
  });
  json["outliers"] = OutliersJson(fleet);
  json["level"] = kFleetLevel;
  json["tests"] = fleet.tests;
  json["parameters"] =
      List(fleet.parameters, [&](const FleetParameter& parameter) {
        return ParameterJson(fleet, parameter);
      });
  return Dump(json);
}

}  // namespace sysid
