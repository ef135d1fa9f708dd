#include "sysid/hypotheses/test_hypotheses.h"

#include <algorithm>
#include <cmath>

#include "models/error.h"
#include "sysid/hypotheses/constants.h"
#include "sysid/hypotheses/explanation.h"
#include "sysid/hypotheses/first_looks.h"

namespace sysid {
namespace {

using namespace hypotheses;

std::string ErrorText(double error) {
  return std::isfinite(error) ? ShortNumber(error) : "beyond computing";
}

// To the decimal place in which its standard error begins; to a multiple of the
// grain that is within its 95 % interval (recorders are late by whole samples).
double Rounded(double value, double std_error, double grain) {
  if (!(std_error > 0.0)) return value;
  const double whole = grain > 0.0 ? grain * std::round(value / grain) : 0.0;
  if (whole != 0.0 &&
      std::abs(value - whole) <= std::max(kInterval * std_error, 0.1 * grain)) {
    return whole;
  }
  const double place = std::pow(10.0, std::floor(std::log10(std_error)));
  const double rounded = place * std::round(value / place);
  return rounded != 0.0 ? rounded : value;
}

// What is supposed, as a user is told it.
Supposition Told(const Explanation& explanation) {
  Supposition told = explanation.fit.supposed;
  told.p = Rounded(told.p, explanation.std_error, told.hypothesis->grain);
  return told;
}
std::string Says(const Explanation& explanation) {
  return explanation.hypothesis().says(Told(explanation).p,
                                       kInterval * explanation.std_error);
}

// The faults that were fitted, with their verdicts.
std::vector<Explanation> FitSuspects(const std::vector<Suspect>& suspects,
                                     Competition* all) {
  std::vector<Explanation> fitted;
  bool any_accepted = false;
  const auto fit = [&](const Suspect& suspect, bool augmented) {
    std::optional<Explanation> found = all->Fit(suspect, augmented);
    if (!found) return;
    found->verdict = all->Judge(*found);
    any_accepted = any_accepted || found->verdict == DataVerdict::kAccepted;
    fitted.push_back(std::move(*found));
  };
  int refits = 0;
  for (const Suspect& suspect : suspects) {
    const DataHypothesis& hypothesis = *suspect.supposed.hypothesis;
    if (refits >= kRefits) break;
    if (!all->Affords((hypothesis.is_continuous() ? 2.0 : 1.0) *
                      all->FitWork(all->model(), kIterations))) {
      all->LeaveOut(hypothesis);
      continue;
    }
    ++refits;
    fit(suspect, false);
  }
  // Where model and data are both wrong: the augmented model with what promises
  // most.
  const double each =
      2.0 * all->FitWork(Augmented(all->model(), false), kAugmentedIterations);
  for (size_t i = 0; i < suspects.size() && !any_accepted; ++i) {
    if (static_cast<int>(i) == kAugmentedRefits || !all->Affords(each)) break;
    fit(suspects[i], true);
  }
  return fitted;
}

// The one with the least error over all windows; of those that are tied with it
// the likelier kind.
const Explanation& Best(const std::vector<Explanation>& winners,
                        const Competition& all) {
  const Explanation* best = &winners.front();
  for (const Explanation& winner : winners) {
    if (all.Gain(*best, winner, {}).mean > 0.0) best = &winner;
  }
  const Explanation* likeliest = best;
  for (const Explanation& winner : winners) {
    if (all.Gain(winner, *best, {}).IsTie() &&
        winner.place < likeliest->place) {
      likeliest = &winner;
    }
  }
  return *likeliest;
}

// A fault that one run has another may have too.
Explanation InMoreRuns(Explanation best, Competition* all) {
  const int count = static_cast<int>(all->input().runs.size());
  for (int r = 0; r < count && !best.hypothesis().runs.empty(); ++r) {
    std::vector<int> runs = best.hypothesis().runs;
    if (std::find(runs.begin(), runs.end(), r) != runs.end()) continue;
    runs.push_back(r);
    std::sort(runs.begin(), runs.end());
    if (static_cast<int>(runs.size()) == count) runs.clear();
    if (!all->Affords(all->FitWork(all->model(), kIterations))) break;
    const Suspect suspect = {
        best.place, Suppose(best.hypothesis(), runs, best.fit.supposed.p)};
    const std::optional<Explanation> wider = all->Fit(suspect, best.augmented);
    if (wider && all->Gain(best, *wider, {r}).IsBetter(kSignificance, kWorth)) {
      best = *wider;
    }
  }
  return best;
}

Finding Report(const Explanation& best, const std::vector<Explanation>& winners,
               const Competition& all) {
  const CheckInput& input = all.input();
  const DataHypothesis& hypothesis = best.hypothesis();
  const Explanation& rival = all.BestRival(hypothesis);
  Finding finding;
  finding.fault = ToString(hypothesis.fault);
  finding.severity = Severity::kWrong;
  finding.weight =
      std::exp(all.Gain(all.as_given(), best, hypothesis.runs).mean);
  finding.error_left = best.fit.error;
  if (hypothesis.change_model) {
    finding.file = input.model_file;
  } else if (input.runs.size() == 1) {
    finding.file = input.runs.front()->name;
  } else {
    std::vector<std::string> files;
    for (const int r : hypothesis.runs) files.push_back(input.runs[r]->name);
    finding.file = Join(files);
  }
  finding.subject = hypothesis.subject();
  finding.is_effect = hypothesis.is_effect;
  finding.evidence = "held-out error in multiples of the noise: " +
                     ErrorText(all.as_given().fit.error) + " as read, " +
                     ErrorText(best.fit.error) + " " + Says(best);
  if (best.augmented) {
    finding.evidence += " and springs, offsets and armatures free";
  } else if (!rival.name.empty()) {
    finding.evidence +=
        ", " + ErrorText(rival.fit.error) + " with " + rival.name + " instead";
  }
  finding.consequence = hypothesis.consequence;
  finding.remedies = FixTexts(input, Told(best));
  for (const Explanation& other : winners) {
    const bool is_same =
        other.place == best.place && other.hypothesis().runs == hypothesis.runs;
    if (other.augmented == best.augmented && !is_same &&
        all.Gain(other, best, {}).IsTie()) {
      NameAlso(Says(other), FixTexts(input, Told(other)), &finding);
    }
  }
  return finding;
}

// What competed, in one table.
std::vector<ComparedExplanation> Compared(
    const std::vector<Explanation>& faults, const Competition& all) {
  std::vector<ComparedExplanation> table;
  const auto add = [&](const Explanation& explanation, const std::string& what,
                       bool of_data) {
    const double gain = all.Gain(all.as_given(), explanation, {}).mean;
    table.push_back({what, of_data, explanation.verdict, explanation.fit.error,
                     std::exp(-gain)});
  };
  for (const Explanation& rival : all.rivals()) {
    add(rival, rival.name.empty() ? "the model as given" : rival.name, false);
  }
  for (const Explanation& fault : faults) {
    add(fault,
        Says(fault) + (fault.augmented
                           ? ", with springs, offsets and armatures free"
                           : ""),
        true);
  }
  std::stable_sort(table.begin(), table.end(),
                   [](const auto& a, const auto& b) {
                     return a.error_ratio < b.error_ratio;
                   });
  return table;
}

void Test(Competition* all, HypothesisReport* report) {
  if (all->fitter().held_runs().empty()) return;
  all->FitAsGiven();
  if (!all->rough()) {
    report->error = all->as_given().fit.error;
    if (report->error <= kExplained) return;
  }
  all->FitAugmented();
  const std::vector<Suspect> suspects = FirstLooks(all);
  all->FitEffects();
  std::vector<Explanation> faults = FitSuspects(suspects, all);
  report->compared = Compared(faults, *all);
  std::erase_if(faults, [](const Explanation& f) {
    return f.verdict != DataVerdict::kAccepted;
  });
  if (faults.empty()) return;
  const Explanation best = InMoreRuns(Best(faults, *all), all);
  report->findings.push_back(Report(best, faults, *all));
  report->found = Told(best);
}

}  // namespace

HypothesisReport TestHypotheses(const CheckInput& input, double budget) {
  HypothesisReport report;
  if (input.runs.empty()) return report;
  // With a budget an excerpt that leaves work for all its parts.
  int samples = kSamples;
  if (std::isfinite(budget)) {
    const double columns = static_cast<double>(input.free->size()) +
                           3.0 * input.model->nv() +
                           input.model->tangent_size();
    const double affords =
        budget / (kParts * kIterations * (1.0 + kColumnWork * columns));
    samples = static_cast<int>(std::min<double>(kSamples, affords));
    if (samples < kLeastSamples) {
      for (const DataHypothesis& hypothesis : AllHypotheses(input)) {
        AddKind(hypothesis, &report.not_asked);
      }
      return report;
    }
  }
  Competition all(input, budget, samples);
  Test(&all, &report);
  report.not_asked = all.not_asked();
  report.work = all.fitter().work();
  return report;
}

}  // namespace sysid
