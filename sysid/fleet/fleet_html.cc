#include <algorithm>
#include <cmath>
#include <cstdio>

#include "models/error.h"
#include "sysid/fleet/fleet.h"
#include "sysid/report/svg_plot.h"
#include "sysid/report/text.h"

namespace sysid {
namespace {

// The look of report.html (web/src/style.css), light: without a script there is
// no choice of a theme, and figures have one colour.
constexpr char kHead[] = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'">
<title>sysid: the fleet</title>
<style>
:root { --ink: #1b1f24; --quiet: #565e68; --edge: #ccd2d9; --view: #f4f6f8;
  --second: #d55e00; --good: #00684b; --bad: #9a4300; --warn: #fff4e0;
  color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: var(--ink);
  font: 15px/1.45 system-ui, "Segoe UI", "DejaVu Sans", sans-serif;
  overflow-wrap: break-word; }
header { padding: 0.7rem 1.2rem; border-bottom: 1px solid var(--edge); }
h1 { font-size: 1.25rem; margin: 0; }
h2 { font-size: 1.2rem; margin: 0 0 0.4rem; }
h3 { font-size: 1rem; margin: 1.2rem 0 0.3rem; }
p { margin: 0.3rem 0; }
main { padding: 0.8rem 1.2rem 3rem; display: grid; gap: 1rem;
  grid-template-columns: minmax(0, 1fr); }
.panel { border: 1px solid var(--edge); border-radius: 6px;
  padding: 0.9rem 1.1rem; min-width: 0; }
.scroll { overflow-x: auto; }
.how { color: var(--quiet); max-width: 110ch; }
.warning { background: var(--warn); border-left: 4px solid var(--second);
  padding: 0.3rem 0.8rem; }
.good { color: var(--good); } .bad { color: var(--bad); font-weight: 600; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 0.15rem 0.9rem 0.15rem 0;
  vertical-align: top; border-bottom: 1px solid var(--edge); }
th { font-weight: 600; color: var(--quiet); }
td.n, th.n { text-align: right; }
td.w { white-space: nowrap; }
tr.marked td { background: var(--warn); }
.panel svg { max-width: 100%; height: auto; display: block; }
</style>
</head>
<body>
)";

constexpr char kNormal[] = "#0072b2", kOutlier[] = "#d55e00",
               kBand[] = "#009e73";

std::string Html(const std::string& text) {
  std::string out;
  for (const char c : text) {
    out += c == '&'   ? "&amp;"
           : c == '<' ? "&lt;"
           : c == '>' ? "&gt;"
           : c == '"' ? "&quot;"
                      : std::string(1, c);
  }
  return out;
}

std::string Cell(const std::string& text, const char* kind = "") {
  return std::string("<td") +
         (*kind ? " class=\"" + std::string(kind) + "\"" : "") + ">" +
         Html(text) + "</td>";
}

std::string Number(double value, const char* format = "%.3g") {
  if (!std::isfinite(value)) return "-";
  char text[32];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

std::string Table(const std::string& head, const std::string& rows) {
  return "<div class=\"scroll\"><table><thead><tr>" + head +
         "</tr></thead><tbody>\n" + rows + "</tbody></table></div>\n";
}

std::string Panel(const std::string& title, const std::string& body) {
  return "<section class=\"panel\"><h2>" + title + "</h2>\n" + body +
         "</section>\n";
}

std::string EffectsPanel(const Fleet& fleet) {
  if (fleet.effects.empty()) {
    return Panel("Missing effects",
                 "<p class=\"good\">No effect is missing in any robot.</p>\n");
  }
  std::string rows;
  for (const FleetEffect& effect : fleet.effects) {
    rows += "<tr>" + Cell(effect.name) +
            Cell(std::to_string(effect.robots.size()), "n") +
            Cell(Join(effect.robots)) + Cell(Join(effect.rival_of)) + "</tr>\n";
  }
  return Panel("Missing effects",
               Table("<th>effect</th><th class=\"n\">robots</th><th>that miss "
                     "it</th><th>undecided in</th>",
                     rows));
}

std::string OutliersPanel(const Fleet& fleet) {
  std::string rows;
  for (const FleetParameter& parameter : fleet.parameters) {
    for (size_t i = 0; i < parameter.robots.size(); ++i) {
      if (!parameter.outlier[i]) continue;
      const RobotEstimate& estimate = parameter.estimates[i];
      const Deviation& deviation = parameter.deviations[i];
      rows +=
          "<tr>" + Cell(fleet.robots[parameter.robots[i]].name) +
          Cell(parameter.name) +
          Cell(Value(estimate.value, estimate.std_error), "n") +
          Cell(Value(deviation.others.mean, deviation.others.std_error), "n") +
          Cell(parameter.unit) + Cell(Number(deviation.deviation), "n") +
          Cell(Number(std::min(1.0, deviation.p_value * fleet.tests)), "n") +
          "</tr>\n";
    }
  }
  const std::string how =
      "<p class=\"how\">Each robot is compared with the random-effects mean of "
      "the others, in which it has no part, and with their between-robot "
      "standard deviation. The probability that a fleet without an outlier has "
      "one named is at most " +
      Number(100 * kFleetLevel) + " %, over " + std::to_string(fleet.tests) +
      " comparisons.</p>\n";
  return Panel("Outliers",
               rows.empty()
                   ? how + "<p class=\"good\">No robot is an outlier.</p>\n"
                   : how + Table("<th>robot</th><th>parameter</th><th "
                                 "class=\"n\">value</th><th class=\"n\">the "
                                 "others</th><th>unit</th><th "
                                 "class=\"n\">standard deviations "
                                 "off</th><th class=\"n\">p, corrected</th>",
                                 rows));
}

// A point and its interval for each robot, the mean and the range of one more
// robot. Over the dates where all that is drawn has one.
std::string Figure(const Fleet& fleet, const FleetParameter& parameter) {
  constexpr double kBars = 1.96;
  const RandomEffects& pooled = parameter.without_outliers;
  const std::array<double, 2> range = pooled.Predicted95();
  std::vector<double> all;
  for (const RobotEstimate& estimate : parameter.estimates) {
    all.push_back(estimate.value - kBars * estimate.std_error);
    all.push_back(estimate.value + kBars * estimate.std_error);
  }
  for (const double bound : range) all.push_back(bound);
  const double count = static_cast<double>(fleet.robots.size());
  PlotAxis x{"robot, in the order of the table", 0.0, count + 1.0, false};
  const bool has_unit = !Behind(parameter.unit).empty();
  SvgPanel panel({80, 30, 700, 170}, x,
                 AxisOver(has_unit ? parameter.unit : "", all), "");
  if (std::isfinite(range[0])) {
    panel.Band({0.0, count + 1.0}, {range[0], range[0]}, {range[1], range[1]},
               kBand);
  }
  panel.Line({0.0, count + 1.0}, {pooled.mean, pooled.mean}, kBand);
  for (size_t i = 0; i < parameter.robots.size(); ++i) {
    const RobotEstimate& estimate = parameter.estimates[i];
    const double at = static_cast<double>(parameter.robots[i]) + 1.0;
    const char* const colour = parameter.outlier[i] ? kOutlier : kNormal;
    panel.Line({at, at},
               {estimate.value - kBars * estimate.std_error,
                estimate.value + kBars * estimate.std_error},
               colour);
    panel.Marker(at, estimate.value, colour, 3.0);
    if (parameter.outlier[i]) {
      panel.Note(fleet.robots[parameter.robots[i]].name, kOutlier);
    }
  }
  return SvgFigure(960, 250, parameter.name, {panel}, {});
}

std::string ParametersPanel(const Fleet& fleet) {
  if (fleet.parameters.empty()) return "";
  std::string rows, figures;
  for (const FleetParameter& parameter : fleet.parameters) {
    const RandomEffects& pooled = parameter.without_outliers;
    if (pooled.count == 0) {
      rows += "<tr>" + Cell(parameter.name) + Cell("0", "n") +
              "<td colspan=\"6\">" + Html(Join(parameter.left_out, "; ")) +
              "</td></tr>\n";
      continue;
    }
    std::string drift = "-";
    if (parameter.drift) {
      const Drift& of = *parameter.drift;
      drift = Number(of.slope, "%+.3g") + " +- " +
              Number((of.ci95[1] - of.ci95[0]) / 2, "%.2g") +
              (parameter.drift_significant ? ": it drifts" : "");
    }
    const auto outliers =
        std::count(parameter.outlier.begin(), parameter.outlier.end(), true);
    rows += "<tr>" + Cell(parameter.name) +
            Cell(std::to_string(pooled.count), "n") +
            Cell(std::to_string(outliers), "n") +
            Cell(Value(pooled.mean, pooled.std_error), "n") +
            Cell(Number(pooled.Ci95()[1] - pooled.mean, "%.2g"), "n") +
            Cell(Number(std::sqrt(pooled.tau2)), "n") +
            Cell(Number(100.0 * pooled.i2, "%.0f %%"), "n") +
            Cell(parameter.unit) + Cell(drift, "n") + "</tr>\n";
    if (pooled.count > 1) figures += Figure(fleet, parameter);
  }
  return Panel(
      "Parameters across the fleet",
      "<p class=\"how\">Random-effects mean (DerSimonian and Laird) of the "
      "robots that are no outliers, with its 95 % interval; the between-robot "
      "standard deviation; I&sup2;, the share of the scatter that the standard "
      "errors do not explain; the drift a year, if the recordings have dates. "
      "In the figures the bars are 95 % intervals, outliers are orange, and "
      "95 % of further robots are expected in the band.</p>\n" +
          Table("<th>parameter</th><th class=\"n\">robots</th><th "
                "class=\"n\">outliers</th><th class=\"n\">mean</th><th "
                "class=\"n\">+- (95 %)</th><th class=\"n\">between "
                "robots</th><th class=\"n\">I&sup2;</th><th>unit</th><th "
                "class=\"n\">drift a year</th>",
                rows) +
          figures);
}

std::string RobotsPanel(const Fleet& fleet) {
  const bool dated = std::any_of(
      fleet.robots.begin(), fleet.robots.end(),
      [](const Robot& robot) { return robot.recorded.has_value(); });
  std::string rows;
  for (size_t i = 0; i < fleet.robots.size(); ++i) {
    const Robot& robot = fleet.robots[i];
    const std::vector<std::string> outlier_in = OutliersOf(fleet, i);
    const std::string status = StatusOf(robot);
    std::vector<std::string> rivals;
    for (const auto& rival : robot.rivals) rivals.push_back(Join(rival, " + "));
    std::vector<std::string> remarks;
    if (!robot.broken.empty()) remarks.push_back(robot.broken);
    for (const std::string& run : robot.skipped_runs) {
      remarks.push_back("without its run " + run);
    }
    if (!rivals.empty()) {
      remarks.push_back(
          (status == "undecided" ? "undecided between " : "the same force: ") +
          Join(rivals, " and "));
    }
    if (robot.broken.empty() && !robot.not_compared.empty()) {
      remarks.push_back("parameters not compared: " + robot.not_compared);
    }
    const bool marked = status != "adequate" && status != "fitted";
    rows +=
        std::string(marked || !outlier_in.empty() || !robot.skipped_runs.empty()
                        ? "<tr class=\"marked\">"
                        : "<tr>") +
        Cell(std::to_string(i + 1), "n") + Cell(robot.name) +
        Cell(status, marked ? "bad" : "good") + Cell(Join(robot.missing)) +
        Cell(Join(outlier_in)) +
        Cell(robot.broken.empty() ? Number(robot.train) : "-", "n") +
        Cell(robot.broken.empty() ? Number(robot.holdout) : "-", "n");
    if (dated) {
      rows += Cell(robot.recorded ? DateText(*robot.recorded) + " (" +
                                        robot.recorded_from + ")"
                                  : "-",
                   "w");
    }
    rows += Cell(Join(remarks, "; ")) + "</tr>\n";
  }
  return Panel(
      "Robots",
      Table(std::string("<th class=\"n\"></th><th>robot</th><th>verdict</th>"
                        "<th>missing "
                        "effects</th><th>outlier in</th><th class=\"n\">error "
                        "/ noise</th><th class=\"n\">held out</th>") +
                (dated ? "<th>recorded (from)</th>" : "") + "<th>remarks</th>",
            rows));
}

std::string Warnings(const Fleet& fleet) {
  std::string text;
  for (const Robot& robot : fleet.robots) {
    if (!robot.broken.empty()) {
      text += "<p class=\"warning\">" + Html(robot.name + ": " + robot.broken) +
              "</p>\n";
    }
    for (const std::string& run : robot.skipped_runs) {
      text += "<p class=\"warning\">" +
              Html(robot.name + ": without its run " + run) + "</p>\n";
    }
  }
  return text.empty() ? "" : Panel("Broken recordings and results", text);
}

}  // namespace

std::string FleetHtml(const Fleet& fleet) {
  return kHead +
         ("<header><h1>The fleet: " + CountOf(fleet.robots.size(), "robot") +
          "</h1><p>" + Html(VerdictCounts(fleet)) + "</p></header>\n<main>\n") +
         Warnings(fleet) + EffectsPanel(fleet) + OutliersPanel(fleet) +
         ParametersPanel(fleet) + RobotsPanel(fleet) +
         "</main>\n</body>\n</html>\n";
}

}  // namespace sysid
