#include <algorithm>
#include <cmath>

#include "models/effects/force_table.h"
#include "models/error.h"
#include "models/integrator.h"
#include "models/parameters.h"
#include "models/printable.h"
#include "sysid/io/cell.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/mixture_report.h"
#include "sysid/report/text.h"
#include "sysid/session/check_session.h"
#include "sysid/stochastic/solvers.h"

namespace sysid {
namespace {

// The table of which a parameter is a weight, "force_table@joint1"; else empty.
// Nobody reads 49 of them: they are in fit.json, the table in a file.
std::string TableOf(const Fit& fit, const std::string& parameter) {
  const EffectSet& effects = fit.model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    if (effect.kind() != ForceTable::kName) continue;
    for (const EffectParameter& p : effect.parameters()) {
      if (p.name == parameter) return effect.name();
    }
  }
  return "";
}

// Weights of a table as one.
std::vector<std::string> WithTablesAsOne(
    const Fit& fit, const std::vector<std::string>& parameters) {
  std::vector<std::string> names;
  for (const std::string& name : parameters) {
    const std::string table = TableOf(fit, name);
    const std::string shown = table.empty() ? name : "weights of " + table;
    if (!Contains(names, shown)) names.push_back(shown);
  }
  return names;
}

std::string ParameterTable(const Fit& fit) {
  size_t name_width = 9;
  std::string tables;
  std::vector<std::string> names;
  for (const ParameterEstimate& p : fit.parameters) names.push_back(p.name);
  for (const std::string& name : WithTablesAsOne(fit, names)) {
    if (Contains(names, name)) continue;
    tables += "  and the " + name + ", which --out has as " +
              name.substr(name.find('@') + 1) + ".force_table.csv\n";
  }
  for (const ParameterEstimate& p : fit.parameters) {
    if (!TableOf(fit, p.name).empty()) continue;
    name_width = std::max(name_width, p.name.size());
  }
  std::string text =
      Format("  %-*s %12s %16s %12s  %s\n", static_cast<int>(name_width),
             "parameter", "start", "value", "+- (95 %)", "unit");
  for (const ParameterEstimate& p : fit.parameters) {
    if (!TableOf(fit, p.name).empty()) continue;
    std::string remark = p.unit;
    std::string width = "-";
    if (!p.identifiable) {
      remark += "  not identifiable from this data";
    } else if (p.at_bound) {
      remark += "  at its bound";
    }
    if (std::isfinite(p.std_error)) {
      width = Format("%.2g", 1.959964 * p.std_error);
    }
    text += Format("  %-*s %12s %16s %12s  ", static_cast<int>(name_width),
                   p.name.c_str(), Format("%.6g", p.initial).c_str(),
                   Value(p.value, p.std_error).c_str(), width.c_str()) +
            remark + "\n";
  }
  return text + tables;
}

std::string SomeParameters(const Model& model) {
  constexpr size_t kShown = 8;
  const std::vector<Parameter> all = AllParameters(model);
  std::vector<std::string> names;
  for (size_t i = 0; i < std::min(all.size(), kShown); ++i) {
    names.push_back(all[i].name);
  }
  return Join(names) +
         (all.size() > kShown
              ? Format(" and %d more", static_cast<int>(all.size() - kShown))
              : "");
}

std::string DiscrepancyLine(const Fit& fit) {
  if (fit.discrepancy.empty()) return "";
  std::string text = "  model error as a random force:";
  for (const Discrepancy& missing : fit.discrepancy) {
    const auto& joints = fit.model.mechanism().joints;
    const auto joint =
        std::find_if(joints.begin(), joints.end(),
                     [&](const Joint& j) { return j.name == missing.joint; });
    const bool slide =
        joint != joints.end() && joint->type == JointType::kPrismatic;
    text += " " + missing.joint + Format(" %.3g ", missing.force_std) +
            (slide ? "N," : "N m,");
  }
  text.back() = ';';
  return text + Format(" correlation time %.2g s\n",
                       fit.discrepancy[0].correlation_time_s);
}

// Positions beside the efforts: what those are worth in a prediction.
std::string HorizonLine(const Fit& fit) {
  const std::string unit = CommonUnit(fit.train.channels);
  if (fit.horizon.empty() || unit.empty()) return "";
  std::string text = "  error of predicted positions, " + unit + ":";
  for (const HorizonError& error : fit.horizon) {
    text +=
        Format(" %.3g after ", error.rms) + Format("%g s,", error.horizon_s);
  }
  text.back() = '\n';
  return text;
}

// What a fit without efforts says of scales: nothing.
std::string RatioLine(const Fit& fit) {
  if (!fit.only_ratios || fit.parameters.empty()) return "";
  return Format(
             "  no efforts were measured (equations of motion up to %.2g "
             "Hz): only ratios of inertias, ",
             fit.cut_off_hz) +
         "frictions and other forces are identifiable" +
         (fit.holds_scale
              ? "; all values and intervals hold for the scale of the "
                "starting values, which is held\n"
              : "\n");
}

// Whether the error is no more than noise: up to 1.1, and three standard
// deviations of what chance makes of the residuals. An estimated noise is
// itself uncertain, about three times as much as its number of measurements
// says (its differences overlap): an error within that may be noise, too.
enum class Floor { kReached, kPerhaps, kMissed };

Floor FloorOf(const ShootingProblem& problem, const Fit& fit) {
  const double dof = std::max(1.0, problem.data().DofPerSample() * fit.samples);
  const double chance = 0.5 / dof;
  const double estimate = problem.options().noise > 0 ? 0.0 : 9.0 * chance;
  const double error = fit.train.total.normalized_rms;
  return error < 1.1 + 3.0 * std::sqrt(chance)              ? Floor::kReached
         : error < 1.1 + 3.0 * std::sqrt(chance + estimate) ? Floor::kPerhaps
                                                            : Floor::kMissed;
}

// What the error says of the model.
std::string ErrorVerdict(const Fit& fit, Floor floor) {
  if (!fit.converged) return "but the fit did not converge";
  switch (floor) {
    case Floor::kReached:
      return "at the noise floor";
    case Floor::kPerhaps:
      return "at the noise floor, as far as the noise can be estimated from " +
             CountOf(fit.samples, "sample");
    case Floor::kMissed:
      break;
  }
  return fit.solver == "lm"
             ? "the model does not explain the data"
             : "the model does not explain the data, or the first states, "
               "which are "
               "given by the data here, are off (--solver lm estimates them)";
}

// The error in its unit, as a share of the motion, beside the noise.
std::string ErrorLine(const std::string& label, const RunErrors& errors) {
  return label + "error " + ErrorWords(errors);
}

std::string ChannelLine(const RunErrors& errors) {
  if (errors.channels.size() < 2) return "";
  std::string text = "  by channel:";
  for (const ChannelError& channel : errors.channels) {
    text += " " + channel.name + Format(" %.3g ", channel.rms) + channel.unit +
            OfTheMotion(channel.fit_percent) +
            Format(", %.3g times its noise;", channel.normalized_rms);
  }
  text.back() = '\n';
  return text;
}

std::string WorstLine(const RunErrors& errors) {
  const auto by_error = [](const auto& a, const auto& b) {
    return a.normalized_rms < b.normalized_rms;
  };
  const auto channel = std::max_element(errors.channels.begin(),
                                        errors.channels.end(), by_error);
  const auto segment = std::max_element(errors.segments.begin(),
                                        errors.segments.end(), by_error);
  if (channel == errors.channels.end() || segment == errors.segments.end()) {
    return "";
  }
  return "  worst: channel " + channel->name +
         Format(" at %.3g times its noise; ", channel->normalized_rms) +
         Printable(segment->trajectory) +
         Format(" from %.10g s to %.10g s at %.3g times\n", segment->t_start,
                segment->t_end, segment->normalized_rms);
}

}  // namespace

bool ReachesNoise(const ShootingProblem& problem, const Fit& fit) {
  return fit.converged && FloorOf(problem, fit) != Floor::kMissed;
}

std::string FitSentence(const ShootingProblem& problem, const Fit& fit,
                        const Holdout* holdout) {
  std::string text = "The error is " + ErrorWords(fit.train);
  if (holdout != nullptr) {
    text += " (held out " + Times(holdout->errors.total.normalized_rms) + ")";
  }
  return text + ": " + ErrorVerdict(fit, FloorOf(problem, fit)) + ".";
}

std::string FitText(const Session& session, const ShootingProblem& problem,
                    const Fit& fit, const Holdout* holdout,
                    const AddedEffects* added, bool colour) {
  const bool regrouped = ShowsCombinations(fit);
  const SolverKind kind = FindSolver(fit.solver).kind;
  std::string text =
      Paint(colour, kBold, session.model_name) + ": " +
      (fit.parameters.empty()
           ? "no free parameters: compared with "
           : CountOf(fit.parameters.size(), "parameter") + " fitted to ") +
      CountOf(problem.data().run_count(), "run") + ", " +
      CountOf(fit.samples, "sample") + ", " +
      CountOf(fit.iterations,
              kind == SolverKind::kStochastic ? "epoch" : "iteration") +
      Format(", %.2g s\n", fit.wall_time_s);
  text += Format("  noise %.3g (%s), segments of %s, steps of %.3g s (%s)",
                 fit.noise, problem.options().noise > 0 ? "given" : "estimated",
                 SegmentLengths(fit).c_str(), fit.step_s,
                 ToString(fit.point.rollout.integrator).c_str());
  if (PathOf(problem.model(), problem.options().rollout) ==
      LinearizationPath::kJets) {
    text += ", derivatives by Jets of whole steps (slow)";
  }
  if (!session.effects.empty()) {
    text += ", effects: " + ListEffects(session.effects, ", ");
  }
  constexpr double kLonger = 1.5;
  if (problem.options().segment > 0 &&
      fit.segment_s > kLonger * problem.options().segment) {
    text += Format(
        "\n  (--segment %g s is too short to say anything: these are "
        "the shortest that do)",
        problem.options().segment);
  }
  if (fit.parameters.empty()) {
    text += "\n  free with --free what is not known: this model has " +
            SomeParameters(problem.model());
  }
  text += "\n" + CheckedLine(session);
  if (!fit.parameters.empty()) {
    text += "\n" + (regrouped ? BaseTable(fit) : ParameterTable(fit)) + "\n";
  }
  text += RatioLine(fit);
  std::string verdict = ErrorLine("", fit.train);
  verdict += ": " + ErrorVerdict(fit, FloorOf(problem, fit));
  text += "  " +
          Paint(colour, ReachesNoise(problem, fit) ? kGreen : kRed, verdict) +
          "\n";
  if (added != nullptr) {
    text += "  adding " + ListEffects(added->effects, ", ") +
            Format(": error %.3g -> %.3g times the noise", added->train_before,
                   added->train_after);
    if (added->predicted > 0) {
      text += Format(" (predicted %.3g)", added->predicted);
    }
    if (holdout) {
      text += Format(", held out %.3g -> %.3g", added->holdout_before,
                     added->holdout_after);
    }
    text += ", before the fit, each segment from its own initial state\n";
  }
  text += ChannelLine(fit.train) + DiscrepancyLine(fit) +
          (kind == SolverKind::kEquations ? HorizonLine(fit) : "") +
          EffortLine("  ", fit.effort, fit.cut_off_hz) + WorstLine(fit.train);
  if (holdout) {
    text += ErrorLine("  held out: ", holdout->errors) +
            ", each segment from its own initial state\n" +
            EffortLine("  held out: ", holdout->effort, 0.0);
  }
  text += OpenLines(fit.open, "");
  if (holdout) text += OpenLines(holdout->open, "held-out ");
  for (const std::vector<std::string>& all : fit.not_identifiable) {
    if (regrouped) break;  // as the table says
    const std::vector<std::string> group = WithTablesAsOne(fit, all);
    // Within a table what is not determined is smooth.
    if (group.size() == 1 && group != all) continue;
    text += "  " + Paint(colour, kRed, NotIdentifiable(group)) +
            (group.size() == 1 ? ": fix it\n"
                               : ": fix one of them, or give a prior\n");
  }
  for (const ParameterEstimate& p : fit.parameters) {
    if (p.at_bound && p.identifiable) {
      text += "  " + p.name +
              Format(" ended at its bound [%g, %g] ", p.lower, p.upper) +
              p.unit + "\n";
    }
  }
  if (!fit.converged) {
    text +=
        "  " + Paint(colour, kRed, "not converged: " + fit.termination) + "\n";
  }
  return text;
}

std::string FitText(const IdentifyResult& result, bool colour) {
  std::string text = FitText(result.session, *result.problem, result.fit(),
                             result.holdout ? &*result.holdout : nullptr,
                             result.added ? &*result.added : nullptr, colour);
  if (result.solved.mixture) text += MixtureText(*result.solved.mixture);
  return text;
}

}  // namespace sysid
