#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <set>

#include "models/error.h"
#include "models/integrator.h"
#include "models/urdf/write_urdf.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/io/cell.h"
#include "sysid/io/run_columns.h"
#include "sysid/report/fit_report.h"
#include "sysid/session/session_options.h"

namespace sysid {
namespace {

// Names of a channel's numbers, as docs/interface.md calls the columns.
std::vector<std::string> ColumnNames(const Channel& channel,
                                     const Mechanism& mechanism) {
  const ColumnGroup group = GroupOf(mechanism, channel);
  std::vector<std::string> names(group.columns.size());
  for (size_t i = 0; i < names.size(); ++i) {
    names[group.slots[i]] = group.columns[i];
  }
  return names;
}

struct Part {
  const ShootingProblem* problem;
  const Solution* point;
  int run;
};

// A text as YAML reads it back, whatever is in it.
std::string Quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + "'";
}

// A name as it is where YAML allows that, else quoted.
std::string Key(const std::string& name) {
  const bool plain =
      std::all_of(name.begin(), name.end(),
                  [](unsigned char c) {
                    return std::isalnum(c) != 0 || c == '_' || c == '.' ||
                           c == '-' || c == '/' || c == '@';
                  }) &&
      !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) != 0;
  return plain ? name : Quoted(name);
}

// Of the runs that were fitted alone: in another it would be another time.
std::vector<std::string> IgnoredIn(const Session& session) {
  const Mechanism& mechanism = session.model.mechanism();
  std::vector<std::string> entries;
  for (IgnoredSpan span : session.edits.ignored) {
    const ScopedName scoped = EditedName(span.name, mechanism);
    for (const std::string& run : session.run_names) {
      if (!scoped.IsFor(run)) continue;
      const std::string name = std::filesystem::path(run).filename().string();
      const bool is_one =
          std::count_if(session.run_names.begin(), session.run_names.end(),
                        [&](const std::string& other) {
                          return std::filesystem::path(other).filename() ==
                                 name;
                        }) == 1;
      span.name = (is_one ? name : run) + "/" + scoped.name;
      entries.push_back(ToString(span));
    }
  }
  return entries;
}

// What the specification or the flags said of the fit itself.
std::string Settings(const Session& session) {
  const EstimationOptions& options = session.options;
  std::string text;
  if (!session.columns.empty()) text += "columns:\n";
  for (const ColumnMapping& column : session.columns) {
    text +=
        "  " + Quoted(column.name) + ": " + Quoted(column.expression) + "\n";
  }
  if (!session.locked.empty()) text += "lock:\n";
  for (const NamedValue& lock : session.locked) {
    text += "  " + Key(lock.name) + ": " + ShortestText(*lock.value) + "\n";
  }
  std::vector<std::string> shifts;
  for (const ChannelShift& shift : session.edits.shifts) {
    shifts.push_back(ToString(shift));
  }
  const auto list = [&](const char* key, const std::vector<std::string>& of) {
    if (!of.empty()) {
      text += std::string(key) + ": " + Quoted(Join(of, ",")) + "\n";
    }
  };
  list("shift", shifts);
  list("ignore", IgnoredIn(session));
  const auto number = [&](const char* key, double value) {
    if (value > 0) text += std::string(key) + ": " + ShortestText(value) + "\n";
  };
  number("noise", options.noise);
  number("step", options.rollout.step);
  number("segment", options.segment);
  if (!options.rollout.may_change) {
    text += "integrator: " + ToString(options.rollout.integrator) + "\n";
  }
  if (options.orientation == OrientationResidual::kRotation) {
    text += "residual: rotation\n";
  }
  if (session.start != RunStart::kEstimated) {
    text += "start: " + ToString(session.start) + "\n";
  }
  if (options.loss != RobustLoss::kNone) {
    text += std::string("loss: {name: ") +
            (options.loss == RobustLoss::kHuber ? "huber" : "cauchy") +
            ", scale: " + ShortestText(options.loss_scale) + "}\n";
  }
  return text;
}

std::string Cell(double value) {
  return std::isfinite(value) ? ShortestText(value) : "";
}

}  // namespace

std::optional<Prediction> Predict(const ShootingProblem& problem,
                                  const Solution& point, int run) {
  Prediction prediction;
  if (!SampleStates(problem, point, run, &prediction.states)) {
    return std::nullopt;
  }
  prediction.channels = PredictChannels(problem, point, run, prediction.states);
  return prediction;
}

Eigen::RowVectorXd Nearest(const Channel& channel, const Mechanism& mechanism,
                           int sample, const Eigen::RowVectorXd& predicted) {
  Eigen::RowVectorXd measured = channel.values.row(sample);
  if (channel.kind == ChannelKind::kOrientation &&
      measured.dot(predicted) < 0) {
    return -measured;
  }
  if (IsScalarPosition(channel.kind) &&
      IsRotation1(mechanism.joints[channel.target].type)) {
    measured[0] -=
        2 * M_PI * std::round((measured[0] - predicted[0]) / (2 * M_PI));
  }
  return measured;
}

std::string PredictionCsv(const ShootingProblem& problem, const Fit& fit,
                          const Holdout* holdout) {
  std::vector<Part> parts;
  for (size_t r = 0; r < problem.runs().size(); ++r) {
    parts.push_back({&problem, &fit.point, static_cast<int>(r)});
  }
  if (holdout) {
    for (size_t r = 0; r < holdout->problem->runs().size(); ++r) {
      parts.push_back(
          {holdout->problem.get(), &holdout->point, static_cast<int>(r)});
    }
  }
  const Mechanism& mechanism = problem.model().mechanism();
  // The union of the runs' columns, in the order of their first appearance.
  std::vector<std::string> columns;
  for (const Part& part : parts) {
    for (const Channel& channel :
         part.problem->runs()[part.run]->run.channels) {
      for (const std::string& column : ColumnNames(channel, mechanism)) {
        if (!Contains(columns, column)) columns.push_back(column);
      }
    }
  }
  std::string text = "t,run,t_run";
  for (const std::string& column : columns) {
    text += "," + CsvCell(column + ".measured") + "," +
            CsvCell(column + ".predicted") + "," +
            CsvCell(column + ".residual");
  }
  text += "\n";
  double offset = 0.0;
  for (size_t p = 0; p < parts.size(); ++p) {
    const Part& part = parts[p];
    const Run& run = part.problem->runs()[part.run]->run;
    const std::optional<Prediction> prediction =
        Predict(*part.problem, *part.point, part.run);
    if (!prediction) continue;
    const double shift = p == 0 ? 0.0 : offset - run.t.front();
    std::vector<int> places;  // of the run's own columns
    for (const Channel& channel : run.channels) {
      for (const std::string& column : ColumnNames(channel, mechanism)) {
        places.push_back(
            static_cast<int>(std::find(columns.begin(), columns.end(), column) -
                             columns.begin()));
      }
    }
    for (int k = 0; k < run.size(); ++k) {
      text += ShortestText(run.t[k] + shift) + "," + std::to_string(p) + "," +
              ShortestText(run.t[k]);
      std::vector<std::string> cells(columns.size(), ",,,");
      auto place = places.begin();
      for (size_t c = 0; c < run.channels.size(); ++c) {
        const Eigen::RowVectorXd expected = prediction->channels[c].row(k);
        const Eigen::RowVectorXd measured =
            Nearest(run.channels[c], mechanism, k, expected);
        for (int i = 0; i < expected.size(); ++i) {
          cells[*place++] = "," + Cell(measured[i]) + "," + Cell(expected[i]) +
                            "," + Cell(measured[i] - expected[i]);
        }
      }
      for (const std::string& cell : cells) text += cell;
      text += "\n";
    }
    offset = run.t.back() + shift + 1.0;
  }
  return text;
}

std::string IdentifiedUrdf(const Session& session, const Fit& fit) {
  std::vector<std::string> comments{"identified from " + session.model_name};
  for (const ParameterEstimate& p : fit.parameters) {
    std::string line = p.name + " = " + ShortestText(p.value) + " " + p.unit;
    if (std::isfinite(p.std_error)) {
      line += ", standard error " + ShortestText(p.std_error);
    } else if (!p.identifiable) {
      line += ", not identifiable from the data";
    } else if (p.at_bound) {
      line += ", at its bound";
    }
    comments.push_back(line);
  }
  return WriteUrdf(fit.model, comments);
}

std::string IdentifiedSpecification(const Session& session, const Fit& fit) {
  std::string text =
      "# Written by sysid beside identified.urdf: goes on from the fit "
      "of " +
      session.model_name + ".\nmodel: identified.urdf\nfree:\n";
  const auto bound = [](const char* key, double value) {
    return std::isfinite(value)
               ? std::string(", ") + key + ": " + ShortestText(value)
               : std::string();
  };
  std::set<std::string> free;
  for (size_t i = 0; i < fit.parameters.size(); ++i) {
    const ParameterEstimate& p = fit.parameters[i];
    free.insert(p.name);
    // A scale is of the nominal inertia, which is now the fitted one.
    const bool scale = p.name.ends_with(".inertia_scale");
    const double value = scale ? 1.0 : p.value;
    const double unit = scale ? 1.0 / p.value : 1.0;
    text += "  " + Key(p.name) + ": {initial: " + ShortestText(value);
    // Those that somebody gave: its own a parameter has anyway, and they move
    // with its nominal value.
    const FreeParameter& asked = session.free[i];
    if (asked.lower > asked.parameter.lower) {
      text += bound("lower", p.lower * unit);
    }
    if (asked.upper < asked.parameter.upper) {
      text += bound("upper", p.upper * unit);
    }
    if (const auto& prior = session.free[i].prior) {
      text += ", prior: {mean: " + ShortestText(prior->mean * unit) +
              ", std: " + ShortestText(prior->std * unit) + "}";
    }
    text += "}\n";
  }
  std::string fixed;
  const EffectSet& effects = fit.model.effects();
  for (size_t i = 0; i < effects.parameters().size(); ++i) {
    const std::string& name = effects.parameters()[i].name;
    if (free.count(name) > 0) continue;
    fixed += "  " + Key(name) + ": " +
             ShortestText(fit.model.nominal().effects[i]) + "\n";
  }
  for (int i = 0; i < effects.size(); ++i) {
    for (const std::string& name : effects.effect(i).adjusts_nominal()) {
      if (free.count(name) > 0) continue;
      fixed +=
          "  " + Key(name) + ": " +
          ShortestText(FindParameters(fit.model, {name}, "").front().nominal) +
          "\n";
    }
  }
  if (free.count("gravity") == 0 && fit.model.nominal().gravity != 9.81) {
    fixed += "  gravity: " + ShortestText(fit.model.nominal().gravity) + "\n";
  }
  if (!fixed.empty()) text += "fix:\n" + fixed;
  if (effects.size() > 0) {
    text += "effects:\n";
    for (const std::string& name : effects.names()) {
      text += "  - " + Key(name) + "\n";
    }
  }
  return text + Settings(session);
}

}  // namespace sysid
