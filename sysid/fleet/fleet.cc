#include "sysid/fleet/fleet.h"

#include <algorithm>
#include <map>

#include "models/error.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

constexpr double kYear = 365.25 * 86400.0;  // s
constexpr size_t kFewestDates = 4;

std::vector<FleetEffect> EffectsOf(const std::vector<Robot>& robots) {
  std::vector<FleetEffect> effects;
  const auto effect = [&](const std::string& name) -> FleetEffect& {
    for (FleetEffect& known : effects) {
      if (known.name == name) return known;
    }
    effects.push_back({name, {}, {}});
    return effects.back();
  };
  for (const Robot& robot : robots) {
    for (const std::string& name : robot.missing) {
      effect(name).robots.push_back(robot.name);
    }
    // An effect of the model as given is in every rival, and no rival.
    for (const auto& rival : robot.rivals) {
      for (const std::string& name : rival) {
        const bool in_all = std::all_of(
            robot.rivals.begin(), robot.rivals.end(),
            [&](const auto& other) { return Contains(other, name); });
        FleetEffect& known = effect(name);
        if (in_all || Contains(robot.missing, name) ||
            Contains(known.rival_of, robot.name)) {
          continue;
        }
        known.rival_of.push_back(robot.name);
      }
    }
  }
  std::erase_if(effects, [](const FleetEffect& one) {
    return one.robots.empty() && one.rival_of.empty();
  });
  std::stable_sort(effects.begin(), effects.end(),
                   [](const FleetEffect& a, const FleetEffect& b) {
                     return a.robots.size() > b.robots.size();
                   });
  return effects;
}

// In the order in which they come.
std::vector<FleetParameter> ParametersOf(const std::vector<Robot>& robots) {
  std::vector<FleetParameter> parameters;
  std::map<std::string, size_t> at;
  for (size_t i = 0; i < robots.size(); ++i) {
    for (const RobotParameter& one : robots[i].parameters) {
      if (at.emplace(one.name, parameters.size()).second) {
        parameters.emplace_back();
        parameters.back().name = one.name;
        parameters.back().unit = one.unit;
      }
      FleetParameter& parameter = parameters[at[one.name]];
      std::string why = robots[i].not_compared.empty() ? one.unusable
                                                       : robots[i].not_compared;
      if (why.empty() && one.unit != parameter.unit) {
        why = "in " + one.unit + ", not " + parameter.unit;
      }
      if (!why.empty()) {
        parameter.left_out.push_back(robots[i].name + ": " + why);
        continue;
      }
      parameter.robots.push_back(i);
      parameter.estimates.push_back(one.estimate);
    }
  }
  return parameters;
}

void FindDrift(const std::vector<Robot>& robots, size_t parameters,
               FleetParameter* parameter) {
  std::vector<RobotEstimate> estimates;
  std::vector<double> years;
  for (size_t i = 0; i < parameter->robots.size(); ++i) {
    const Robot& robot = robots[parameter->robots[i]];
    if (parameter->outlier[i] || !robot.recorded) continue;
    estimates.push_back(parameter->estimates[i]);
    years.push_back(*robot.recorded / kYear);
  }
  if (years.size() < kFewestDates ||
      std::all_of(years.begin(), years.end(),
                  [&](double year) { return year == years.front(); })) {
    return;
  }
  parameter->drift = RegressOnDates(estimates, years);
  parameter->drift_significant =
      static_cast<double>(parameters) * parameter->drift->p_value <=
      kFleetLevel;
}

}  // namespace

Fleet AnalyseFleet(std::vector<Robot> robots) {
  Fleet fleet;
  fleet.robots = std::move(robots);
  fleet.effects = EffectsOf(fleet.robots);
  fleet.parameters = ParametersOf(fleet.robots);
  for (const FleetParameter& parameter : fleet.parameters) {
    fleet.tests += static_cast<int>(parameter.estimates.size());
  }
  for (FleetParameter& parameter : fleet.parameters) {
    if (parameter.estimates.empty()) continue;
    parameter.outlier = FindOutliers(parameter.estimates, fleet.tests);
    parameter.deviations = CompareAll(parameter.estimates, parameter.outlier);
    std::vector<RobotEstimate> kept;
    for (size_t i = 0; i < parameter.estimates.size(); ++i) {
      if (!parameter.outlier[i]) kept.push_back(parameter.estimates[i]);
    }
    parameter.all = PoolEstimates(parameter.estimates);
    parameter.without_outliers = PoolEstimates(kept);
    FindDrift(fleet.robots, fleet.parameters.size(), &parameter);
  }
  return fleet;
}

std::vector<std::string> OutliersOf(const Fleet& fleet, size_t robot) {
  std::vector<std::string> names;
  for (const FleetParameter& parameter : fleet.parameters) {
    for (size_t i = 0; i < parameter.robots.size(); ++i) {
      if (parameter.robots[i] == robot && parameter.outlier[i]) {
        names.push_back(parameter.name);
      }
    }
  }
  return names;
}

std::string StatusOf(const Robot& robot) {
  if (!robot.broken.empty()) return "broken";
  return robot.verdict.empty() ? "fitted" : robot.verdict;
}

std::string VerdictCounts(const Fleet& fleet) {
  std::vector<std::string> parts;
  for (const char* const status : {"adequate", "missing_effect", "undecided",
                                   "unexplained", "fitted", "broken"}) {
    const auto count = std::count_if(
        fleet.robots.begin(), fleet.robots.end(),
        [&](const Robot& robot) { return StatusOf(robot) == status; });
    if (count == 0) continue;
    parts.push_back(std::string(status) + " " + std::to_string(count));
  }
  return Join(parts);
}

}  // namespace sysid
