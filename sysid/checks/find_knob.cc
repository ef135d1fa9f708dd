#include "sysid/checks/find_knob.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sysid/checks/knobs.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

// Others this near to the best are named with it. More than for readings: where
// two columns are out of step, either may be late, and what tells them apart is
// a third, whose own delay is the machine's (docs/checks.md).
constexpr double kNearlyEqual = 1.25;

// To the decimal place in which its standard error begins; a multiple of the
// grain stays.
double Rounded(double value, double std_error, double grain) {
  constexpr double kTiny = 1e-9;
  // Of no grain the remainder is no number.
  const bool is_whole = std::abs(std::remainder(value, grain)) <= kTiny * grain;
  if (is_whole || !(std_error > 0.0)) return value;
  const double place = std::pow(10.0, std::floor(std::log10(std_error)));
  return place * std::round(value / place);
}

struct Candidate {
  const Knob* knob;
  double start;  // of short segments
  std::optional<double>
      long_start;  // of whole windows, where they promise more
  double promise;  // error over that as it was read, before it is refined
  TurnedKnob brief, turned;  // of short segments, of whole windows

  // Whether short segments show it at all.
  bool ShowsShort(const QuickFit& given) const {
    constexpr double kHardly = 1.03;
    return brief.fit.error * kHardly < given.error;
  }
};

// Where each knob begins: by the linearisation, or where a glance at the
// family's own starts (a delay of many samples, a zero that drifted by a turn)
// shows more. Those that promise most first.
std::vector<Candidate> Candidates(const AsRead& as_read,
                                  const std::vector<Knob>& knobs) {
  // Of what a long fit misses: a slow motion shows little in short segments.
  constexpr double kPromises = 0.9;
  const auto scores_of = [&](const QuickFit& fit) {
    return ScoreKnobs(as_read.lean(), fit, as_read.excerpt(), knobs);
  };
  const std::vector<KnobScore> scores = scores_of(as_read.short_fit());
  const std::vector<KnobScore> long_scores = scores_of(as_read.fit());
  const double glance = as_read.Glance(as_read.lean(), {}).error;
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < knobs.size(); ++i) {
    const Knob& knob = knobs[i];
    const auto begin = [&](const KnobScore& score) -> std::optional<double> {
      if (!score.known || !(std::abs(score.value) >= knob.least)) return {};
      return std::clamp(score.value, -knob.most, knob.most);
    };
    Candidate candidate{&knob, 0.0, {}, INFINITY, {}, {}};
    std::vector<double> starts = knob.starts;
    if (const auto start = begin(scores[i])) {
      candidate.start = *start;
      candidate.promise = scores[i].error / as_read.short_fit().error;
      starts.insert(starts.begin(), candidate.start);
    }
    double least = INFINITY;
    for (const double start : starts) {
      const QuickFit fit = as_read.Glance(
          as_read.lean(), [&](Run* run) { knob.change(start, run); });
      const double ratio = fit.error / glance;
      if (!(ratio < least)) continue;
      least = ratio;
      candidate.start = start;
    }
    candidate.promise = std::min(candidate.promise, least);
    const double ratio = long_scores[i].error / as_read.fit().error;
    if (long_scores[i].known && ratio < kPromises) {
      candidate.long_start = begin(long_scores[i]);
      if (candidate.long_start) {
        candidate.promise = std::min(candidate.promise, ratio);
      }
    }
    if (candidate.promise < 1.0) candidates.push_back(candidate);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.promise < b.promise;
                   });
  constexpr size_t kMost = 5;
  if (candidates.size() > kMost) candidates.resize(kMost);
  return candidates;
}

bool IsSignificant(const TurnedKnob& turned) {
  return std::abs(turned.value) >= kSignificance * turned.std_error;
}

// What is named.
double ValueOf(const Candidate& candidate) {
  return Rounded(candidate.turned.value, candidate.turned.std_error,
                 candidate.knob->grain);
}

std::string TextOf(const Candidate& candidate) {
  return candidate.knob->says(ValueOf(candidate),
                              kInterval * candidate.turned.std_error);
}

// Whether it lowers the error as it was read, that of `given`, by its factor
// and nearly everywhere; known well, and not where it was held.
bool Improves(const Knob& knob, const TurnedKnob& turned, const QuickFit& given,
              double error) {
  const double size = std::abs(turned.value);
  return turned.fit.error * knob.gain < error &&
         PartImproved(turned.fit, given, 1.0) >= kWindows &&
         size >= knob.least && size < knob.most && IsSignificant(turned);
}

// Of whole windows.
bool IsFinding(const Candidate& candidate, AsRead* as_read) {
  const Knob& knob = *candidate.knob;
  const TurnedKnob& turned = candidate.turned;
  if (!Improves(knob, turned, as_read->fit(), as_read->missed())) return false;
  // Of a chaotic motion whole windows say any number to many digits.
  if (candidate.ShowsShort(as_read->short_fit()) &&
      !IsSignificant(candidate.brief)) {
    return false;
  }
  return knob.of_model
             ? turned.fit.error <= *knob.of_model * as_read->Anything()
             : as_read->IsBeyondModel(
                   turned.fit.error,
                   [&](Run* run) { knob.change(turned.value, run); }, 1.0);
}

// Turned on short segments, where that explains them: a chaotic motion does not
// always find its way through whole windows even so.
bool IsShortFinding(const Candidate& candidate, AsRead* as_read) {
  const Knob& knob = *candidate.knob;
  const double error = candidate.turned.fit.error;
  const QuickFit& given = as_read->short_fit();
  return error <= kExplained &&
         Improves(knob, candidate.turned, given, given.error) &&
         error <= (knob.of_model ? *knob.of_model : 1.0 / kBeyondModel) *
                      as_read->AnythingShort();
}

void SortByError(std::vector<Candidate>* candidates) {
  std::stable_sort(candidates->begin(), candidates->end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.turned.fit.error < b.turned.fit.error;
                   });
}

// Of the first of the candidates, by their errors; `given`: that as it was
// read.
Finding Report(const CheckInput& input,
               const std::vector<Candidate>& candidates,
               const std::string& where, double given) {
  const Candidate& best = candidates.front();
  const Knob& knob = *best.knob;
  const double error = best.turned.fit.error;
  Finding finding;
  finding.fault = knob.fault;
  finding.severity = Severity::kWrong;
  finding.weight = given / error;
  finding.error_left = error;
  if (input.runs.size() == 1) finding.file = input.runs.front()->name;
  finding.subject = knob.subject;
  finding.evidence = "as it was read the model misses the data" + where +
                     " by " + TimesText(given) + ", " + TextOf(best) + " by " +
                     TimesText(error);
  finding.consequence = knob.consequence;
  finding.remedies = knob.remedies(ValueOf(best));
  for (size_t i = 1; i < candidates.size(); ++i) {
    const Candidate& other = candidates[i];
    if (other.turned.fit.error > kNearlyEqual * error) break;
    if (!IsSignificant(other.turned) || other.knob->fault != knob.fault) {
      continue;
    }
    NameAlso(TextOf(other), other.knob->remedies(ValueOf(other)), &finding);
  }
  return finding;
}

}  // namespace

bool FindKnob(AsRead* as_read, std::vector<Finding>* findings) {
  const CheckInput& input = as_read->input();
  std::vector<Knob> knobs;
  for (const KnobFamily family : kKnobFamilies) family(input, &knobs);
  if (as_read->CouldBeModel()) {
    std::erase_if(knobs,
                  [](const Knob& knob) { return !knob.of_model.has_value(); });
  }
  const LooseModel& lean = as_read->lean();
  const Excerpt& excerpt = as_read->excerpt();
  const EstimationOptions& options = as_read->options();
  const QuickFit &brief = as_read->short_fit(), &fit = as_read->fit();
  std::vector<Candidate> candidates = Candidates(*as_read, knobs);
  if (candidates.empty()) return false;
  for (Candidate& candidate : candidates) {
    const Knob& knob = *candidate.knob;
    const auto turn_long = [&](double value, QuickFit at) {
      candidate.turned =
          ToGrain(lean, excerpt, options, knob,
                  TurnLong(lean, excerpt, options, knob, value, std::move(at)));
    };
    candidate.brief = TurnShort(lean, excerpt, options, knob, candidate.start,
                                kShortIterations, fit);
    if (candidate.ShowsShort(brief)) {
      turn_long(candidate.brief.value, FitLong(candidate.brief.fit));
    } else if (candidate.long_start) {
      const double value = *candidate.long_start;
      const auto windows =
          excerpt.Windows([&](Run* run) { knob.change(value, run); });
      turn_long(value, FitOn(lean, windows, options, fit));
    }
  }
  SortByError(&candidates);
  if (IsFinding(candidates.front(), as_read)) {
    findings->push_back(Report(input, candidates, "", as_read->missed()));
    return true;
  }
  for (Candidate& candidate : candidates) candidate.turned = candidate.brief;
  SortByError(&candidates);
  Candidate& front = candidates.front();
  front.turned =
      ToGrain(lean, excerpt, options, *front.knob, std::move(front.turned));
  if (!IsShortFinding(front, as_read)) return false;
  findings->push_back(Report(input, candidates,
                             " over " + ShortNumber(kShortSegment) + " s",
                             brief.error));
  return true;
}

}  // namespace sysid
