#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/fleet/outliers.h"
#include "sysid/fleet/read_fleet.h"

namespace sysid {

// An effect that robots lack in their model.
struct FleetEffect {
  std::string name;
  std::vector<std::string> robots;    // that miss it
  std::vector<std::string> rival_of;  // where the data do not decide
};

// A parameter across the robots that have an estimate of it.
struct FleetParameter {
  std::string name, unit;
  std::vector<size_t> robots;  // indices into Fleet::robots
  std::vector<RobotEstimate> estimates;
  std::vector<bool> outlier;
  std::vector<Deviation> deviations;  // from those that are no outliers
  RandomEffects all, without_outliers;
  std::optional<Drift> drift;  // a year
  bool drift_significant = false;
  // Robots whose estimate is compared with none: "robot: why".
  std::vector<std::string> left_out;
};

// What can be said of many robots (docs/fleet.md).
struct Fleet {
  std::vector<Robot> robots;
  std::vector<FleetEffect> effects;  // the most frequent first
  std::vector<FleetParameter> parameters;
  int tests = 0;  // robots times parameters: N of (F.15)
};
Fleet AnalyseFleet(std::vector<Robot> robots);

// The names of the parameters in which a robot is an outlier.
std::vector<std::string> OutliersOf(const Fleet& fleet, size_t robot);

// fleet.json of docs/interface.md section 6, what the terminal shows, and the
// page.
std::string FleetJson(const Fleet& fleet);
std::string FleetText(const Fleet& fleet, bool colour);
std::string FleetHtml(const Fleet& fleet);

// "adequate 35, missing_effect 4, broken 1".
std::string VerdictCounts(const Fleet& fleet);
// Broken, the verdict, or "fitted" without one.
std::string StatusOf(const Robot& robot);

}  // namespace sysid
