#include <algorithm>
#include <cmath>

#include "models/math/decompositions.h"
#include "sysid/report/comparison_report.h"
#include "sysid/report/svg_plot.h"
#include "sysid/report/text.h"

namespace sysid {
namespace {

// Distinct to all readers (Okabe and Ito 2008).
constexpr char kTruth[] = "#555555";
constexpr char kTruthDashes[] = "5 4";

std::string Colour(const std::string& solver) {
  return solver == "lm" ? "#0072b2" : solver == "adam" ? "#d55e00" : "#009e73";
}

constexpr double kPanelWidth = 330, kPanelHeight = 220;
constexpr double kColumn = 430, kRow = 296, kLeft = 84, kTop = 58;

PlotBox BoxAt(int index) {
  return {kLeft + kColumn * (index % 2), kTop + kRow * (index / 2), kPanelWidth,
          kPanelHeight};
}

// The iteration of a point as plotted: from 1 on a logarithmic axis.
double Position(const PathPoint& point) { return point.iteration + 1.0; }

// The path of a solver over its points; `mark`: with a marker at its end.
template <typename X, typename Y>
void DrawPath(const SolverRun& run, const X& x_of, const Y& y_of, double width,
              double mark, SvgPanel* panel) {
  std::vector<double> x, y;
  for (const PathPoint& point : run.path) {
    x.push_back(x_of(point));
    y.push_back(y_of(point));
  }
  panel->Line(x, y, Colour(run.solver), width);
  if (mark > 0) panel->Marker(x.back(), y.back(), Colour(run.solver), mark);
}

SvgPanel LossPanel(const Comparison& comparison, int index, bool over_time) {
  std::vector<double> xs, ys;
  const auto x_of = [&](const PathPoint& point) {
    return over_time ? std::max(point.time_s, 1e-5) : Position(point);
  };
  for (const SolverRun& run : comparison.runs) {
    for (const PathPoint& point : run.path) {
      xs.push_back(x_of(point));
      ys.push_back(point.loss);
    }
  }
  SvgPanel panel(
      BoxAt(index),
      AxisOver(over_time ? "time, s" : "1 + iteration (epoch)", xs, true),
      AxisOver("loss", ys, true),
      over_time ? "Loss against time" : "Loss against iteration");
  for (const SolverRun& run : comparison.runs) {
    const auto loss = [](const PathPoint& point) { return point.loss; };
    DrawPath(run, x_of, loss, 1.6, 0, &panel);
  }
  return panel;
}

SvgPanel PathPanel(const Comparison& comparison, int parameter, int index) {
  std::vector<double> xs{0.0}, ys{comparison.start[parameter]};
  if (comparison.reference_is_truth) {
    ys.push_back(comparison.reference[parameter]);
  }
  std::vector<double> epochs, lower, upper;
  for (const SolverRun& run : comparison.runs) {
    for (const PathPoint& point : run.path) {
      xs.push_back(point.iteration);
      ys.push_back(point.values[parameter]);
    }
    if (!run.mixture) continue;
    for (const MixtureEpoch& epoch : run.mixture->epochs) {
      const double mean = epoch.kernels.Mean()[parameter];
      const double std = epoch.kernels.Std()[parameter];
      epochs.push_back(epoch.epoch);
      lower.push_back(mean - std);
      upper.push_back(mean + std);
    }
  }
  ys.insert(ys.end(), lower.begin(), lower.end());
  ys.insert(ys.end(), upper.begin(), upper.end());
  SvgPanel panel(BoxAt(index), AxisOver("iteration (epoch)", xs),
                 AxisOver(comparison.units[parameter], ys),
                 comparison.names[parameter]);
  panel.Band(epochs, lower, upper, Colour("gmm"));
  const double last = *std::max_element(xs.begin(), xs.end());
  if (comparison.reference_is_truth) {
    panel.Line(
        {0.0, last},
        {comparison.reference[parameter], comparison.reference[parameter]},
        kTruth, 1.2, kTruthDashes);
  }
  for (const SolverRun& run : comparison.runs) {
    DrawPath(
        run, [](const PathPoint& point) { return point.iteration; },
        [&](const PathPoint& point) { return point.values[parameter]; }, 1.6,
        2.8, &panel);
  }
  return panel;
}

// Dark where the likelihood is, lighter by every tenfold of the deviance.
std::string Shade(double deviance) {
  if (!std::isfinite(deviance)) return "";
  if (deviance < 5.99) return "#7a7a9c";  // 95 % of two parameters
  const double decades = std::log10(deviance / 5.99);
  const int grey = std::clamp(static_cast<int>(175 + 20.0 * decades), 175, 255);
  return Format("#%02x%02x%02x", grey, grey, std::min(255, grey + 8));
}

void ShadeLikelihood(const Landscape& landscape, SvgPanel* panel) {
  const double dx = landscape.x[1] - landscape.x[0];
  const double dy = landscape.y[1] - landscape.y[0];
  const int columns = static_cast<int>(landscape.x.size());
  for (int row = 0; row < landscape.y.size(); ++row) {
    const double y = landscape.y[row];
    // Neighbours of one shade are one rectangle.
    for (int first = 0, last; first < columns; first = last) {
      const std::string colour = Shade(landscape.deviance(row, first));
      last = first + 1;
      while (last < columns && Shade(landscape.deviance(row, last)) == colour) {
        ++last;
      }
      if (colour.empty()) continue;
      panel->Cell(landscape.x[first] - 0.51 * dx, y - 0.51 * dy,
                  landscape.x[last - 1] + 0.51 * dx, y + 0.51 * dy, colour);
    }
  }
}

// The 95 % ellipse of Levenberg-Marquardt's covariance; a line across the whole
// panel where the data leaves a direction open.
void DrawCovariance(const Comparison& comparison, SvgPanel* panel) {
  const Fit& fit = comparison.runs[0].fit;
  const double x = fit.parameters[0].value, y = fit.parameters[1].value;
  const bool open =
      !fit.parameters[0].identifiable || !fit.parameters[1].identifiable;
  const std::string colour = Colour("lm");
  if (open) {
    const Eigen::Vector2d& along = comparison.landscape->valley;
    const Landscape& land = *comparison.landscape;
    const double far = 2.0 * (land.x[land.x.size() - 1] - land.x[0] +
                              land.y[land.y.size() - 1] - land.y[0]);
    panel->Line({x - far * along[0], x + far * along[0]},
                {y - far * along[1], y + far * along[1]}, colour, 1.4, "7 3");
    panel->Note("dashed: the direction in which lm's", colour);
    panel->Note("covariance is open (not identifiable)", colour);
  } else {
    const SymmetricEigen eigen = EigenOfSymmetric(fit.covariance);
    const double chi = std::sqrt(5.991);
    const Eigen::VectorXd a =
        chi * std::sqrt(std::max(0.0, eigen.values[0])) * eigen.vectors.col(0);
    const Eigen::VectorXd b =
        chi * std::sqrt(std::max(0.0, eigen.values[1])) * eigen.vectors.col(1);
    panel->Ellipse(x, y, a.data(), b.data(), colour);
    panel->Note("ellipse: 95 % by lm's covariance", colour);
  }
  panel->Marker(x, y, colour);
}

SvgPanel LandscapePanel(const Comparison& comparison, int index) {
  const Landscape& landscape = *comparison.landscape;
  const auto axis = [&](int i, const Eigen::VectorXd& at) {
    return PlotAxis{comparison.names[i] + ", " + comparison.units[i], at[0],
                    at[at.size() - 1], false};
  };
  SvgPanel panel(BoxAt(index), axis(0, landscape.x), axis(1, landscape.y),
                 "Likelihood on a grid, and what the solvers say");
  ShadeLikelihood(landscape, &panel);
  for (const SolverRun& run : comparison.runs) {
    DrawPath(
        run, [](const PathPoint& point) { return point.values[0]; },
        [](const PathPoint& point) { return point.values[1]; }, 0.9,
        run.solver == "adam" ? 3.5 : 0, &panel);
    if (!run.mixture) continue;
    const ParameterMixture& first = run.mixture->epochs.front().kernels;
    const ParameterMixture& last = run.mixture->mixture;
    for (const ParameterMixture* kernels : {&first, &last}) {
      for (int k = 0; k < kernels->weights.size(); ++k) {
        const double a[2] = {kernels->stds(k, 0), 0.0};
        const double b[2] = {0.0, kernels->stds(k, 1)};
        panel.Ellipse(kernels->means(k, 0), kernels->means(k, 1), a, b,
                      Colour("gmm"), kernels == &first ? "2 3" : "");
        if (kernels == &last) {
          panel.Marker(kernels->means(k, 0), kernels->means(k, 1),
                       Colour("gmm"), 1.0 + 3.0 * kernels->weights[k]);
        }
      }
    }
    panel.Note("ellipses: kernels at one deviation,", Colour("gmm"));
    panel.Note("dotted at the start", Colour("gmm"));
  }
  panel.Note("shade: the likelihood on a grid, dark", kTruth);
  panel.Note("within 95 %, then a shade each time", kTruth);
  panel.Note("the deviance grows threefold", kTruth);
  DrawCovariance(comparison, &panel);
  if (comparison.reference_is_truth) {
    panel.Cross(comparison.reference[0], comparison.reference[1], "#000000");
    panel.Note("cross: truth", "#000000");
  }
  return panel;
}

}  // namespace

std::string ComparisonFigure(const Session& session,
                             const Comparison& comparison) {
  std::vector<SvgPanel> panels{LossPanel(comparison, 0, false),
                               LossPanel(comparison, 1, true)};
  for (size_t i = 0; i < comparison.names.size(); ++i) {
    panels.push_back(PathPanel(comparison, static_cast<int>(i),
                               static_cast<int>(panels.size())));
  }
  if (comparison.landscape) {
    // In a row of its own: its notes stand beside it.
    const int index = static_cast<int>(panels.size());
    panels.push_back(LandscapePanel(comparison, index + index % 2));
  }
  std::vector<LegendEntry> legend;
  for (const SolverRun& run : comparison.runs) {
    legend.push_back({SolverTitle(run.solver), Colour(run.solver), ""});
  }
  if (comparison.reference_is_truth) {
    legend.push_back({"truth", kTruth, kTruthDashes});
  }
  const int rows = (static_cast<int>(panels.size()) + 1) / 2;
  return SvgFigure(kLeft + 2 * kColumn - 60, kTop + kRow * rows + 4,
                   session.model_name + ": three solvers from the same values",
                   panels, legend);
}

}  // namespace sysid
