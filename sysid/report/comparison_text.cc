#include <algorithm>
#include <cmath>
#include <functional>

#include "models/error.h"
#include "sysid/report/comparison_report.h"
#include "sysid/report/text.h"
#include "sysid/session/check_session.h"

namespace sysid {
namespace {

std::string Cells(const std::string& name,
                  const std::vector<std::string>& cells, int width = 18) {
  std::string text = Format("  %-22s", name.c_str());
  for (const std::string& cell : cells) {
    text += Format(" %*s", width, cell.c_str());
  }
  return text + "\n";
}

// Which parameters have no reference, and why.
std::string NoReference(const Comparison& comparison) {
  std::vector<std::string> names;
  for (size_t i = 0; i < comparison.names.size(); ++i) {
    if (std::isnan(comparison.reference[i])) {
      names.push_back(comparison.names[i]);
    }
  }
  if (names.empty()) return "";
  return "  no distance from lm in " + Join(names) + ": " +
         (comparison.runs[0].fit.converged ? "not identifiable\n"
                                           : "lm has not converged\n");
}

std::string SolverTable(const Comparison& comparison) {
  using Cell = std::function<std::string(const SolverRun&)>;
  const std::pair<const char*, Cell> rows[] = {
      {"", [](const SolverRun& run) { return run.solver; }},
      {"iterations, epochs",
       [](const SolverRun& run) { return std::to_string(run.fit.iterations); }},
      {"settled at",
       [](const SolverRun& run) { return std::to_string(run.settled); }},
      {"evaluations",
       [](const SolverRun& run) {
         return std::to_string(run.fit.evaluations);
       }},
      {"time, s",
       [](const SolverRun& run) {
         return Format("%.2g", run.fit.wall_time_s);
       }},
      {"segments of",
       [](const SolverRun& run) { return SegmentLengths(run.fit); }},
      {"loss at the start",
       [](const SolverRun& run) {
         return Format("%.3g", run.path.front().loss);
       }},
      {"loss",
       [](const SolverRun& run) {
         return Format("%.3g", run.path.back().loss);
       }},
      {"error over noise",
       [](const SolverRun& run) {
         return Format("%.3g", run.fit.train.total.normalized_rms);
       }},
      {comparison.reference_is_truth ? "farthest from truth"
                                     : "farthest from lm",
       [](const SolverRun& run) {
         return run.farthest.empty() ? "-"
                                     : Format("%.3g %%", 100.0 * run.distance);
       }},
      {"",
       [](const SolverRun& run) {
         return run.farthest.empty() ? "" : "(" + run.farthest + ")";
       }},
      {"converged",
       [](const SolverRun& run) { return run.fit.converged ? "yes" : "no"; }},
  };
  std::string text;
  for (const auto& [name, cell] : rows) {
    std::vector<std::string> cells;
    for (const SolverRun& run : comparison.runs) cells.push_back(cell(run));
    text += Cells(name, cells);
  }
  return text + NoReference(comparison);
}

std::string ComparedParameters(const Comparison& comparison) {
  std::string text =
      Cells("parameter", {"start", "lm +- std", "adam", "gmm +- std",
                          comparison.reference_is_truth ? "truth" : "unit"});
  for (size_t i = 0; i < comparison.names.size(); ++i) {
    const UncertaintyComparison& u = comparison.uncertainty[i];
    const auto value = [&](int solver) {
      return comparison.runs[solver].fit.parameters[i].value;
    };
    const std::string lm_std =
        std::isfinite(u.lm_std) ? Format(" +- %.2g", u.lm_std) : " +- -";
    text += Cells(
        comparison.names[i],
        {Format("%.5g", comparison.start[i]), Format("%.5g", value(0)) + lm_std,
         Format("%.5g", value(1)),
         Format("%.5g +- %.2g", value(2), u.mixture_std),
         comparison.reference_is_truth ? Format("%.5g", comparison.reference[i])
                                       : u.unit});
  }
  return text;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

std::string TrialTable(const Comparison& comparison) {
  constexpr int kWidth = 28;
  const size_t count = comparison.trials.size();
  std::string text =
      Format("\n  over %zu starts: median (least to most)\n", count);
  const auto row = [&](const char* name, const char* format, double factor,
                       double SolverTrial::*number) {
    std::vector<std::string> cells;
    for (size_t s = 0; s < comparison.runs.size(); ++s) {
      std::vector<double> values;
      for (const ComparedStart& trial : comparison.trials) {
        const double value = factor * (trial.solvers[s].*number);
        if (!std::isnan(value)) values.push_back(value);  // no reference
      }
      if (values.empty()) {
        cells.push_back("-");
        continue;
      }
      const auto [least, most] =
          std::minmax_element(values.begin(), values.end());
      cells.push_back(Format(format, Median(values)) + " (" +
                      Format(format, *least) + " to " + Format(format, *most) +
                      (values.size() < count
                           ? Format("; of %zu starts)", values.size())
                           : ")"));
    }
    text += Cells(name, cells, kWidth);
  };
  std::vector<std::string> solvers, settled, converged;
  for (size_t s = 0; s < comparison.runs.size(); ++s) {
    std::vector<double> at;
    int done = 0;
    for (const ComparedStart& trial : comparison.trials) {
      at.push_back(trial.solvers[s].settled);
      done += trial.solvers[s].converged;
    }
    const auto [least, most] = std::minmax_element(at.begin(), at.end());
    solvers.push_back(comparison.runs[s].solver);
    settled.push_back(Format("%g (%g to %g)", Median(at), *least, *most));
    converged.push_back(Format("%d of %zu", done, count));
  }
  text += Cells("", solvers, kWidth) + Cells("settled at", settled, kWidth);
  row("time, s", "%.2g", 1.0, &SolverTrial::time_s);
  row("loss", "%.3g", 1.0, &SolverTrial::loss);
  row("error over noise", "%.3g", 1.0, &SolverTrial::error);
  row("farthest, %", "%.3g", 100.0, &SolverTrial::distance);
  return text + Cells("converged", converged, kWidth);
}

}  // namespace

std::string SolverTitle(const std::string& solver) {
  return solver == "lm"     ? "Levenberg-Marquardt"
         : solver == "adam" ? "Adam"
                            : "Gaussian mixture";
}

std::string ComparisonText(const Session& session,
                           const Comparison& comparison) {
  std::string text =
      session.model_name + ": " +
      CountOf(comparison.names.size(), "parameter") + ", " +
      CountOf(session.runs.size(), "run") + ", " +
      CountOf(comparison.runs[0].fit.samples, "sample") +
      ", three solvers from the same values (lm: inverse dynamics first)\n" +
      CheckedLine(session) + "\n" + SolverTable(comparison) + "\n" +
      ComparedParameters(comparison) + "\n" +
      "  the mixture's standard deviation compared with Levenberg-Marquardt's "
      "standard error:\n";
  for (const UncertaintyComparison& u : comparison.uncertainty) {
    text += "  " + u.parameter + ": " + u.why + "\n";
  }
  for (const SolverRun& run : comparison.runs) {
    for (const std::vector<std::string>& group : run.fit.not_identifiable) {
      text += "  " + run.solver + ": " + NotIdentifiable(group) + "\n";
    }
    if (run.mixture) {
      for (const std::string& remark : run.mixture->remarks) {
        text += "  " + run.solver + ": " + remark + "\n";
      }
    }
    if (!run.fit.converged) {
      text +=
          "  " + run.solver + ": not converged: " + run.fit.termination + "\n";
    }
  }
  if (comparison.trials.size() > 1) text += TrialTable(comparison);
  return text;
}

}  // namespace sysid
