#include <algorithm>
#include <cmath>

#include "models/error.h"
#include "models/printable.h"
#include "sysid/fleet/fleet.h"
#include "sysid/report/text.h"

namespace sysid {
namespace {

std::string Padded(std::string text, size_t width) {
  text.resize(std::max(width, text.size()), ' ');
  return text;
}

std::string BrokenLines(const Fleet& fleet) {
  std::string text;
  for (const Robot& robot : fleet.robots) {
    if (!robot.broken.empty()) {
      text += "  " + robot.name + ": " + robot.broken + "\n";
    }
    for (const std::string& run : robot.skipped_runs) {
      text += "  " + robot.name + ": without its run " + run + "\n";
    }
  }
  return text.empty() ? "" : "\nbroken recordings and results\n" + text;
}

std::string EffectLines(const Fleet& fleet) {
  std::string text;
  for (const FleetEffect& effect : fleet.effects) {
    text += "  " + effect.name + ": ";
    if (!effect.robots.empty()) {
      text += CountOf(effect.robots.size(), "robot") + ": " +
              JoinSome(effect.robots);
    }
    if (!effect.rival_of.empty()) {
      text += (effect.robots.empty() ? "" : "; ") +
              ("undecided in " + JoinSome(effect.rival_of));
    }
    text += "\n";
  }
  return text.empty() ? "\nno effect is missing in any robot\n"
                      : "\nmissing effects\n" + text;
}

std::string OutlierLines(const Fleet& fleet) {
  std::string text;
  for (const FleetParameter& parameter : fleet.parameters) {
    for (size_t i = 0; i < parameter.robots.size(); ++i) {
      if (!parameter.outlier[i]) continue;
      const RobotEstimate& estimate = parameter.estimates[i];
      const Deviation& deviation = parameter.deviations[i];
      text += "  " + fleet.robots[parameter.robots[i]].name + ": " +
              parameter.name + " " + Value(estimate.value, estimate.std_error) +
              Behind(parameter.unit) + ", the others " +
              Value(deviation.others.mean, deviation.others.std_error) +
              Format(" (%.3g standard deviations off)\n", deviation.deviation);
    }
  }
  return text.empty() ? "\nno robot is an outlier\n" : "\noutliers\n" + text;
}

std::string ParameterLines(const Fleet& fleet) {
  size_t width = 9;
  for (const FleetParameter& parameter : fleet.parameters) {
    width = std::max(width, parameter.name.size());
  }
  std::string text = "\n" + Padded("  parameter", width + 4) +
                     "robots         mean   +- (95 %)  between robots     I^2  "
                     "unit\n";
  for (const FleetParameter& parameter : fleet.parameters) {
    const RandomEffects& pooled = parameter.without_outliers;
    text += "  " + Padded(parameter.name, width + 2);
    if (pooled.count == 0) {
      text += "     0  (" + parameter.left_out.front() + ")\n";
      continue;
    }
    const double half = pooled.Ci95()[1] - pooled.mean;
    text += Format("%6d %12s %10s %15.3g %6.0f %%  %s\n", pooled.count,
                   Value(pooled.mean, pooled.std_error).c_str(),
                   std::isfinite(half) ? Format("%.2g", half).c_str() : "-",
                   std::sqrt(pooled.tau2), 100.0 * pooled.i2,
                   parameter.unit.c_str());
  }
  return fleet.parameters.empty() ? "" : text;
}

std::string DriftLines(const Fleet& fleet) {
  std::string text;
  bool any = false;
  for (const FleetParameter& parameter : fleet.parameters) {
    if (!parameter.drift) continue;
    any = true;
    if (!parameter.drift_significant) continue;
    const Drift& drift = *parameter.drift;
    text += "  " + parameter.name +
            Format(" %+.3g +- %.2g", drift.slope,
                   (drift.ci95[1] - drift.ci95[0]) / 2) +
            Behind(parameter.unit) + " a year\n";
  }
  if (!any) return "";
  return text.empty() ? "\nno parameter drifts over the dates\n"
                      : "\ndrift over the dates\n" + text;
}

}  // namespace

std::string FleetText(const Fleet& fleet, bool colour) {
  const std::string text =
      Paint(colour, kBold, CountOf(fleet.robots.size(), "robot")) + ": " +
      VerdictCounts(fleet) + "\n" + BrokenLines(fleet) + EffectLines(fleet) +
      OutlierLines(fleet) + ParameterLines(fleet) + DriftLines(fleet);
  return colour ? text : std::string(Printable(text));
}

}  // namespace sysid
