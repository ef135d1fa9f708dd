#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "models/error.h"
#include "models/printable.h"
#include "sysid/report/arm_text.h"
#include "sysid/report/diagnosis_report.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/text.h"
#include "sysid/session/check_session.h"

namespace sysid {
namespace {

constexpr size_t kMostShown = 8;  // candidates
constexpr size_t kFewestShown = 3;
constexpr double kSignificant = 0.01;  // of a p-value, which pays for all tests

// Errors over the noise in the unit of the positions, where all have one.
struct ErrorScale {
  double size = 1.0;
  std::string unit;

  ErrorScale(const ErrorSummary& total, const std::string& common_unit) {
    if (!(total.normalized_rms > 0) || !std::isfinite(total.rms)) return;
    unit = common_unit;
    if (!unit.empty()) size = total.rms / total.normalized_rms;
  }
  explicit ErrorScale(const RunErrors& errors)
      : ErrorScale(errors.total, CommonUnit(errors.channels)) {}
  std::string Name() const {
    return unit.empty() ? "errors over the noise" : "errors in " + unit;
  }
  std::string operator()(double error) const {
    return std::isfinite(error) ? Format("%.3g", size * error) : "-";
  }
};

std::string ParameterLines(const Fit& fit) {
  std::string text;
  for (const ParameterEstimate& p : fit.parameters) {
    text += "  " + p.name + " = " + Value(p.value, p.std_error) +
            (std::isfinite(p.std_error) ? Format(" +- %.2g", 1.96 * p.std_error)
                                        : std::string()) +
            Behind(p.unit) +
            (p.identifiable ? "" : ", not identifiable from this data") +
            (p.at_bound ? ", at its bound" : "") + "\n";
  }
  return text;
}

std::string Expected(const ScreenedEffect& effect) {
  std::vector<std::string> parts;
  for (const ExpectedParameter& p : effect.parameters) {
    std::string part = p.name + " " + Value(p.value, p.std_error);
    if (!p.searched && p.std_error > 0) {
      part += Format(" +- %.2g", 1.96 * p.std_error);
    }
    parts.push_back(part + Behind(p.unit));
  }
  return Join(parts);
}

std::string WhereText(const Where& where) {
  std::string text = "where\n ";
  for (const ChannelError& channel : where.channels) {
    text += " " + channel.name + Format(" %.3g", channel.rms) +
            Behind(channel.unit) + ", " + Times(channel.normalized_rms) +
            " times its noise;";
  }
  text.back() = '\n';
  const auto worst =
      std::max_element(where.segments.begin(), where.segments.end(),
                       [](const SegmentError& a, const SegmentError& b) {
                         return a.normalized_rms < b.normalized_rms;
                       });
  if (worst != where.segments.end()) {
    text += "  worst in " + Printable(worst->trajectory) +
            Format(" from %.4g s to %.4g s: %.3g times\n", worst->t_start,
                   worst->t_end, worst->normalized_rms);
  }
  for (const JointForce& force : where.joints) {
    if (!force.significant) continue;
    text += "  unexplained force of " + force.joint +
            Format(": %.2g ", force.rms) + force.unit + " rms";
    for (const ForceRegression& law : where.regression) {
      if (law.joint != force.joint) continue;
      text += ", " + Format("%.0f %% explained by ", 100 * law.r2) + law.label;
      break;
    }
    text += "\n";
  }
  for (const RejectedEffort& rejected : where.rejected_efforts) {
    text += "  the recorded effort of " + rejected.joint +
            " is no effort of that joint, and is left out\n";
  }
  for (const FollowedMotion& followed : where.followed) {
    text += "  inverse-dynamics residual of " + followed.joint +
            " follows the motion of " + followed.of +
            Format(" (%.0f %% of its mean square)\n", 100 * followed.share);
  }
  for (const Whiteness& white : where.whiteness) {
    if (!(white.p_value < 0.01)) continue;
    text += "  residuals of " + white.channel +
            Format(" are not white: correlated over %.2g samples (p %s)\n",
                   white.time, Probability(white.p_value).c_str());
  }
  for (const InputCorrelation& input : where.inputs) {
    if (!input.significant) continue;
    text +=
        "  residuals of " + input.channel +
        " are correlated with the effort of " + input.input +
        Format(" (%.2g at a lag of %.3g s)\n", input.correlation, input.lag_s);
  }
  return text;
}

// How many candidates are worth a line: those that were refitted or stand out.
size_t Shown(const std::vector<CandidateEffect>& candidates) {
  size_t count = 0;
  while (count < std::min(candidates.size(), kMostShown) &&
         (count < kFewestShown || candidates[count].confirmed ||
          candidates[count].screened.p_value < 0.01)) {
    ++count;
  }
  return count;
}

std::string WhichText(const Diagnosis& diagnosis) {
  const std::vector<CandidateEffect>& candidates = diagnosis.candidates;
  const size_t shown = Shown(candidates);
  const ErrorScale scale(diagnosis.base.fit.train);
  std::string text =
      Format("which of %zu effects (", candidates.size()) + scale.Name() +
      " over segments of " + SegmentLengths(diagnosis.base.fit) +
      Format("; p-values corrected for %d tests)\n", diagnosis.tests);
  size_t width = 6;
  for (size_t i = 0; i < shown; ++i) {
    width = std::max(width, candidates[i].screened.name().size());
  }
  text += Format("  %-*s %9s %9s %9s %8s  %s\n", static_cast<int>(width),
                 "effect", "predicted", "refitted", "held out", "p-value",
                 "expected (+- 95 %)");
  for (size_t i = 0; i < shown; ++i) {
    const CandidateEffect& c = candidates[i];
    text += Format("  %-*s %9s %9s %9s %8s  ", static_cast<int>(width),
                   c.screened.name().c_str(),
                   scale(c.screened.predicted_error).c_str(),
                   c.confirmed ? scale(c.confirmed->train).c_str() : "-",
                   c.confirmed ? scale(c.confirmed->holdout).c_str() : "-",
                   Probability(c.screened.p_value).c_str()) +
            Expected(c.screened) + "\n";
    if (c.confirmed && !c.confirmed->together_with.empty()) {
      text +=
          Format("  %-*s refitted together with ", static_cast<int>(width),
                 "") +
          Join(c.confirmed->together_with) +
          (c.confirmed->segment_s == diagnosis.base.fit.segment_s
               ? ""
               : Format(", over segments of %.3g s", c.confirmed->segment_s)) +
          "\n";
    }
    if (c.confirmed && !c.confirmed->accepted) {
      text += Format("  %-*s rejected: ", static_cast<int>(width), "") +
              c.confirmed->refused + "\n";
    }
  }
  if (!candidates.empty() && candidates[0].confirmed &&
      candidates[0].confirmed->accepted &&
      !candidates[0].indistinguishable_from.empty()) {
    text += "  " + candidates[0].screened.name() +
            " is indistinguishable from " +
            Join(candidates[0].indistinguishable_from) +
            " in this data: " + candidates[0].told_apart_by + "\n";
  }
  return text;
}

// What this data would have shown.
std::string PowerText(const Diagnosis& diagnosis) {
  std::string text = "smallest detectable parameters with this data\n ";
  size_t column = 0;
  for (const CandidateEffect& c : diagnosis.candidates) {
    for (const ExpectedParameter& p : c.screened.parameters) {
      if (p.searched || !(p.detectable > 0)) continue;
      const std::string item =
          " " + p.name + Format(" %.2g", p.detectable) + Behind(p.unit);
      if (column + item.size() > 76) {
        text += "\n ";
        column = 0;
      }
      text += item + ",";
      column += item.size() + 1;
    }
  }
  text.back() = '\n';
  return text;
}

// " (with coulomb_friction@joint1)": of the model as given, or nothing.
std::string GivenEffects(const Diagnosis& diagnosis) {
  const EffectSet& effects = diagnosis.base.fit.model.effects();
  std::vector<std::string> names;
  for (int i = 0; i < effects.size(); ++i) {
    names.push_back(effects.effect(i).name());
  }
  return names.empty() ? "" : " (with " + Join(names) + ")";
}

// The models of the search and the neighbours of the last one, over segments of
// one length; of a search that was interrupted, each over its own.
std::string ModelsText(const Diagnosis& diagnosis) {
  constexpr size_t kMostAdded = 3;
  const ModelComparison& models = diagnosis.comparison;
  const ErrorScale scale(diagnosis.last().fit.train);
  const auto errors = [&](const ModelErrors& model) {
    // Channels differ in noise: each model has its own errors in the unit.
    const ErrorScale train(model.train, scale.unit);
    const ErrorScale holdout(model.holdout, scale.unit);
    return Format(
        "  %9s %9s %9s +- %-8s  ", train(model.train.normalized_rms).c_str(),
        holdout(model.holdout.normalized_rms).c_str(),
        train(model.cv.error()).c_str(), train(model.cv.std_error()).c_str());
  };
  std::string text = "models (" + scale.Name();
  if (diagnosis.interrupted.empty()) {
    text += " over segments of " + SegmentLengths(diagnosis.last().fit);
  }
  text += Format(")\n  %9s %9s %9s +- %-8s\n", "fitted", "held out",
                 "cross-val", "std error");
  for (size_t i = 0; i < models.path.size(); ++i) {
    text += errors(models.path[i]);
    if (i == 0) {
      text += "as given" + GivenEffects(diagnosis) + "\n";
      continue;
    }
    const DiagnosisStep& step = diagnosis.steps[i - 1];
    std::vector<std::string> changes;
    if (!step.removed.empty()) changes.push_back("- " + step.removed);
    for (const std::string& name : step.effects) changes.push_back("+ " + name);
    text += Join(changes, " ");
    if (models.path[i].segment_s != models.path[i - 1].segment_s) {
      text += Format(" (over segments of %.3g s)", models.path[i].segment_s);
    }
    for (const ParameterEstimate& p : step.parameters) {
      text +=
          "  " + p.name + " " + Value(p.value, p.std_error) + Behind(p.unit);
    }
    text += "\n";
    const std::string indent(47, ' ');
    for (const std::vector<std::string>& others : step.indistinguishable_from) {
      if (others.empty()) continue;
      text += indent + "equally good: " + Join(others) + "\n";
    }
  }
  if (models.left_out.empty() && models.added.empty()) return text;
  text += "  the last of them with one effect less or more, fitted again\n";
  for (const ModelErrors& model : models.left_out) {
    text += errors(model) + "without " + model.change + "\n";
  }
  for (size_t i = 0; i < std::min(models.added.size(), kMostAdded); ++i) {
    text += errors(models.added[i]) + "with " + models.added[i].change + "\n";
  }
  return text;
}

const char* UnitOf(const ParameterByStrata& one) {
  switch (one.strata) {
    case Strata::kTime:
      return " s";
    case Strata::kSpeed:
      return one.is_slide ? " m/s" : " rad/s";
    case Strata::kPosition:
    case Strata::kAmplitude:
      return one.is_slide ? " m" : " rad";
    case Strata::kEffort:
      return one.is_slide ? " N" : " N m";
    case Strata::kRun:
      break;
  }
  return "";
}

// "joint1.drag rises with the speed of joint1: 0.1 at 0 to 1 rad/s, 0.3 at 4 to
// 5 rad/s".
std::string HowItVaries(const ParameterByStrata& one) {
  std::string of = NameOf(one.strata);
  if (one.strata != Strata::kTime && one.strata != Strata::kRun) {
    of += " of " + one.joint;
  }
  // Of what is below zero, or off elsewhere, the size may fall where the value
  // rises.
  const bool up = one.estimates.back().value > one.estimates.front().value;
  const bool of_size = up != (one.trend == Trend::kRises);
  std::string text = one.parameter +
                     (one.trend == Trend::kNone
                          ? " is not the same at each "
                          : std::string(" ") + NameOf(one.trend) +
                                (of_size ? " in size" : "") + " with the ") +
                     of + ":";
  for (const StratumEstimate& at : one.estimates) {
    if (one.trend != Trend::kNone && &at != &one.estimates.front() &&
        &at != &one.estimates.back()) {
      continue;
    }
    text +=
        " " + Value(at.value, at.std_error) + " at " +
        (one.strata == Strata::kRun ? "run " + Format("%.0f", at.from)
                                    : Format("%.3g to %.3g", at.from, at.to)) +
        UnitOf(one) + ",";
  }
  text.pop_back();
  return text;
}

std::string StandInText(const Diagnosis& diagnosis) {
  if (diagnosis.stand_ins.empty()) return "";
  std::vector<std::string> effects, how;
  for (const ParameterByStrata& one : diagnosis.stand_ins) {
    effects.push_back(one.effect);
    how.push_back(HowItVaries(one));
  }
  return " " + ListEffects(effects, " and ") +
         (effects.size() == 1 ? " lowers" : " lower") +
         " the error, but a law that explains is constant, and " +
         Join(how, "; ") + ". " +
         (effects.size() == 1 ? "It stands" : "They stand") +
         " in for another law.";
}

// What is missing, and the errors with it: of all steps, or else of the first
// candidate.
struct Answer {
  std::vector<std::string> effects;
  double train = 0.0, holdout = 0.0;
};

Answer AnswerOf(const Diagnosis& diagnosis) {
  if (!diagnosis.steps.empty()) {
    return {diagnosis.added(), diagnosis.last().train_error(),
            diagnosis.last().holdout_error()};
  }
  if (diagnosis.proposed.empty()) return {};
  const Confirmation& first = *diagnosis.candidates.front().confirmed;
  return {diagnosis.proposed, first.train, first.holdout};
}

std::string TheErrorIs(const Diagnosis& diagnosis, const Answer& answer) {
  const ErrorScale scale(diagnosis.steps.empty() ? diagnosis.base.fit.train
                                                 : diagnosis.last().fit.train);
  const std::string in_unit =
      scale.unit.empty() ? "" : scale(answer.train) + Behind(scale.unit) + ", ";
  return " the error is " + in_unit + Times(answer.train) +
         " times the noise (held out " + Times(answer.holdout) + ").";
}

// The error of the model as given, over the segments of the answer.
std::string ErrorAsGiven(const Diagnosis& diagnosis) {
  const EvaluatedModel& base = diagnosis.base;
  if (diagnosis.comparison.path.empty() ||
      diagnosis.comparison.path[0].segment_s == base.fit.segment_s) {
    return "The error is " + ErrorWords(base.fit.train) + " (held out " +
           Times(base.holdout_error()) + ")";
  }
  const ModelErrors& given = diagnosis.comparison.path[0];
  return "Over segments of " + SegmentLengths(diagnosis.last().fit) +
         " the error is " +
         ErrorWords(given.train, CommonUnit(base.fit.train.channels)) +
         " (held out " + Times(given.holdout.normalized_rms) + ")";
}

// Where a search ended that does not explain the data.
std::string AfterSteps(const Diagnosis& diagnosis, const Answer& answer) {
  if (diagnosis.steps.empty() || answer.effects.empty()) return "";
  return " With " + ListEffects(answer.effects, " and ") +
         TheErrorIs(diagnosis, answer);
}

// The first of the proposals, for the sentence.
std::string FormulaWords(const Diagnosis& diagnosis) {
  if (diagnosis.proposals.empty()) return "";
  const FormulaProposal& best = diagnosis.proposals.front();
  return " A formula that is read off the data, " +
         Join(best.effects(), " and ") +
         (best.replaces.empty()
              ? ""
              : ", without " + ListEffects(best.replaces, " and ")) +
         ", leaves " + Times(best.cv_error) + " times the noise (held out " +
         Times(best.holdout) + ").";
}

std::string FormulasText(const Diagnosis& diagnosis,
                         const std::string& command) {
  if (diagnosis.proposals.empty()) return "";
  std::string text =
      "formulas for the missing force (errors over the noise, over segments of "
      "other runs than were fitted; held out)\n";
  for (const FormulaProposal& proposal : diagnosis.proposals) {
    std::vector<std::string> values;
    for (const ParameterEstimate& p : proposal.parameters) {
      values.push_back(p.name + " = " + Value(p.value, p.std_error) +
                       Behind(p.unit));
    }
    text += "  " + Format("%.3g  %.3g  ", proposal.cv_error, proposal.holdout) +
            Join(proposal.effects(), ", ") + "  (" + Join(values) + ")\n";
  }
  return text + "  to try the first: " + command + "\n";
}

// Of the final model. Without --auto an effect may be missing from it.
const char* FinalWords(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAdequate:
      return ": adequate";
    case Verdict::kMissingEffect:
    case Verdict::kUndecided:
      return ": an effect is missing";
    case Verdict::kUnexplained:
      break;
  }
  return ": above the noise floor";
}

}  // namespace

std::string DiagnosisSentence(const Diagnosis& diagnosis) {
  if (!diagnosis.usable) return "The model could not be fitted to this data.";
  if (diagnosis.by_equations && diagnosis.interrupted.empty()) {
    return ArmSentence(diagnosis);
  }
  std::string text = ErrorAsGiven(diagnosis);
  if (!diagnosis.interrupted.empty()) {
    text += diagnosis.stopped_by == StoppedBy::kTime
                ? ", and time ran out while "
                : ", and the search for what is missing was interrupted while ";
    text += diagnosis.interrupted;
    if (!diagnosis.proposed.empty()) {
      text +=
          "; " + Join(diagnosis.proposed, " and ") + " was the best by then";
    }
    return text + "." + AfterSteps(diagnosis, AnswerOf(diagnosis));
  }
  if (diagnosis.verdict == Verdict::kAdequate) {
    text += ": no relevant effect is missing";
    for (const CandidateEffect& candidate : diagnosis.candidates) {
      if (!(candidate.screened.p_value < kSignificant)) continue;
      text +=
          Format("; %s may be there (p %.2g), and would lower it to %.3g",
                 candidate.screened.name().c_str(), candidate.screened.p_value,
                 candidate.screened.predicted_error);
      break;
    }
    return text + ".";
  }
  const Answer answer = AnswerOf(diagnosis);
  if (diagnosis.verdict == Verdict::kUnexplained) {
    text += diagnosis.narrowed
                ? ", and none of the chosen candidates explains it"
                : ", and no effect of the catalogue explains it";
    if (diagnosis.steps.empty() && !answer.effects.empty()) {
      text += "; " + ListEffects(answer.effects, " and ") +
              ", the best of them, leaves " + Times(answer.holdout);
    }
    return text + ": the unexplained forces show what is left." +
           AfterSteps(diagnosis, answer) + StandInText(diagnosis) +
           FormulaWords(diagnosis);
  }
  if (diagnosis.verdict == Verdict::kUndecided) {
    std::vector<std::string> rivals;
    for (const RivalModel& rival : diagnosis.rivals) {
      rivals.push_back(ListEffects(rival.effects, " and "));
    }
    return text +
           ": an effect is missing; these explain the data equally well: " +
           Join(rivals, "; ") + ". With the first" +
           TheErrorIs(diagnosis, answer);
  }
  text += ": " + ListEffects(answer.effects, " and ");
  std::vector<std::string> names;
  for (size_t i = 1; i < diagnosis.rivals.size(); ++i) {
    names.push_back(ListEffects(diagnosis.rivals[i].effects, " and "));
  }
  if (!names.empty()) {
    text += " (in this data the same force as " + Join(names, " or ") + ")";
  }
  if (answer.effects.size() < 2) {
    return text + " is missing; with it" + TheErrorIs(diagnosis, answer);
  }
  return text + " are missing" +
         (diagnosis.steps.empty() ? ", which only together explain it" : "") +
         "; with them" + TheErrorIs(diagnosis, answer);
}

std::string EndSentence(const Diagnosis& diagnosis, const FinalFit& final) {
  const EvaluatedModel& last = diagnosis.last();
  std::string text;
  if (!diagnosis.steps.empty()) {
    const std::vector<std::string> added = diagnosis.added();
    text = "The search ended with " +
           (added.empty() ? std::string("no effect")
                          : ListEffects(added, " and ")) +
           ": over segments of " + SegmentLengths(last.fit) +
           ", each from its own initial state, the error is " +
           ErrorWords(last.fit.train) + " (held out " +
           Times(last.holdout_error()) + "), " +
           (diagnosis.final_verdict == Verdict::kAdequate
                ? "and no relevant effect is missing. "
                : "still above the noise floor. ");
  }
  if (diagnosis.by_equations) {
    text +=
        "So many effects are decided by the equations of motion, without "
        "rolling the motion out";
    if (!diagnosis.look.bodies.empty()) {
      text += "; the bodies of the URDF, free beside them, are fitted as well";
    }
    text +=
        ". The values are those of the inverse dynamics over whole runs. With "
        "these values";
  } else {
    text += "Fitted once more, as one trajectory over each whole run";
  }
  std::string whole = FitSentence(*final.problem, final.fit,
                                  final.holdout ? &*final.holdout : nullptr);
  whole[0] = 't';
  text += ", " + whole;
  const Verdict verdict =
      diagnosis.steps.empty() ? diagnosis.verdict : diagnosis.final_verdict;
  if (verdict == Verdict::kAdequate &&
      !ReachesNoise(*final.problem, final.fit)) {
    text += " What is small over a segment adds up over a whole run.";
  }
  return text;
}

bool EndsWell(const Diagnosis& diagnosis, const FinalFit& final) {
  const Verdict verdict =
      diagnosis.steps.empty() ? diagnosis.verdict : diagnosis.final_verdict;
  return verdict == Verdict::kAdequate &&
         ReachesNoise(*final.problem, final.fit);
}

std::string DiagnosisText(const Session& session, const Diagnosis& diagnosis,
                          const FinalFit* final, const NextCommands& next,
                          bool colour) {
  std::string text =
      Paint(colour, kBold, session.model_name) + ": " +
      Paint(colour, diagnosis.verdict == Verdict::kAdequate ? kGreen : kRed,
            ToString(diagnosis.verdict)) +
      "\n";
  for (const std::string& doubt : diagnosis.doubts) {
    text += "  " + Paint(colour, kRed, "unreliable fit: " + doubt) + "\n";
  }
  text += "  " + DiagnosisSentence(diagnosis) + "\n";
  if (!diagnosis.by_equations) {
    text += Format(
        "  noise %.3g, segments of %s, each from its own initial state\n",
        diagnosis.base.fit.noise, SegmentLengths(diagnosis.base.fit).c_str());
  }
  text += CheckedLine(session) + WhereText(diagnosis.where);
  if (diagnosis.by_equations) {
    text += ArmText(diagnosis);
  } else if (diagnosis.interrupted.empty() || !diagnosis.candidates.empty()) {
    text += WhichText(diagnosis);
  }
  text += FormulasText(diagnosis, next.formula);
  if (diagnosis.verdict == Verdict::kAdequate) text += PowerText(diagnosis);
  if (!diagnosis.steps.empty() && !diagnosis.by_equations) {
    text += ModelsText(diagnosis);
  }
  if (final != nullptr) {
    text += "final model: " +
            (final->session.effects.empty() ? std::string("no effects")
                                            : Join(final->session.effects)) +
            FinalWords(diagnosis.final_verdict) + "\n";
    text += ShowsCombinations(final->fit) ? BaseTable(final->fit)
                                          : ParameterLines(final->fit);
    if (!final->fit.converged) {
      text += "  " +
              Paint(colour, kRed,
                    "its fit did not converge: " + final->fit.termination) +
              "\n";
    }
    text += EffortLine("  ", final->fit.effort, final->fit.cut_off_hz);
    text += OpenLines(final->fit.open, "");
    if (final->holdout) {
      text += OpenLines(final->holdout->open, "held-out ");
    }
  }
  if (!next.experiment_words.empty()) {
    text += "next experiment: " + next.experiment_words + "\n";
  }
  if (!next.experiment.empty()) text += next.experiment + "\n";
  return text + "next\n" + next.fit + "\n";
}

std::string DiagnosisText(const DiagnoseResult& result,
                          const NextCommands& next, bool colour) {
  return DiagnosisText(result.session, result.diagnosis,
                       result.final ? &*result.final : nullptr, next, colour);
}

}  // namespace sysid
