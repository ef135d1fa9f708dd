#include "sysid/checks/find_knob.h"

#include <algorithm>
#include <cmath>

#include "sysid/checks/knobs.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

constexpr double kSignificance = 4.0;  // standard errors
constexpr double kInterval = 1.96;     // standard errors of 95 %
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
  double start;
  double promise;  // error over that as it was read, before it is refined
  TurnedKnob turned;

  bool IsSignificant() const {
    return std::abs(turned.value) >= kSignificance * turned.std_error;
  }
  // What is named.
  double Value() const {
    return Rounded(turned.value, turned.std_error, knob->grain);
  }
  std::string Text() const {
    return knob->says(Value(), kInterval * turned.std_error);
  }
};

// Where each knob begins: by the linearisation, or where a glance at the
// family's own starts (a delay of many samples, a zero that drifted by a turn)
// shows more. Those that promise most first.
std::vector<Candidate> Candidates(const AsRead& as_read,
                                  const std::vector<Knob>& knobs) {
  const QuickFit& given = as_read.short_fit();
  const std::vector<KnobScore> scores =
      ScoreKnobs(as_read.lean(), given, as_read.excerpt(), knobs);
  const double glance = as_read.Glance(as_read.lean(), {}).error;
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < knobs.size(); ++i) {
    const Knob& knob = knobs[i];
    Candidate candidate{&knob, 0.0, INFINITY, {}};
    std::vector<double> starts = knob.starts;
    if (scores[i].known && std::abs(scores[i].value) >= knob.least) {
      candidate.start = std::clamp(scores[i].value, -knob.most, knob.most);
      candidate.promise = scores[i].error / given.error;
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

bool IsFinding(const Candidate& candidate, AsRead* as_read) {
  const Knob& knob = *candidate.knob;
  const TurnedKnob& turned = candidate.turned;
  const double size = std::abs(turned.value);
  return turned.error * knob.gain < as_read->missed() &&
         turned.windows >= kWindows && size >= knob.least &&
         size < knob.most &&  // there it was held
         candidate.IsSignificant() &&
         (knob.of_model
              ? turned.error <= *knob.of_model * as_read->Anything()
              : as_read->IsBeyondModel(
                    turned.error,
                    [&](Run* run) { knob.change(turned.value, run); }, 1.0));
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
  std::vector<Candidate> candidates = Candidates(*as_read, knobs);
  if (candidates.empty()) return false;
  for (Candidate& candidate : candidates) {
    candidate.turned =
        TurnKnob(as_read->lean(), as_read->short_fit(), as_read->fit(),
                 as_read->excerpt(), as_read->options(), *candidate.knob,
                 candidate.start);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.turned.error < b.turned.error;
                   });
  const Candidate& best = candidates.front();
  if (!IsFinding(best, as_read)) return false;
  const Knob& knob = *best.knob;
  const TurnedKnob& turned = best.turned;
  Finding finding;
  finding.fault = knob.fault;
  finding.severity = Severity::kWrong;
  finding.weight = as_read->fit().error / turned.error;
  finding.error_left = turned.error;
  if (input.runs.size() == 1) finding.file = input.runs.front()->name;
  finding.subject = knob.subject;
  finding.evidence = "as it was read the model misses the data by " +
                     TimesText(as_read->fit().error) + ", " + best.Text() +
                     " by " + TimesText(turned.error);
  finding.consequence = knob.consequence;
  finding.remedies = knob.remedies(best.Value());
  for (size_t i = 1; i < candidates.size(); ++i) {
    const Candidate& other = candidates[i];
    if (other.turned.error > kNearlyEqual * turned.error) break;
    if (!other.IsSignificant() || other.knob->fault != knob.fault) continue;
    finding.evidence += (finding.remedies.size() == 1
                             ? "; the data hardly tells it from reading it "
                             : ", or ") +
                        other.Text();
    for (const std::string& remedy : other.knob->remedies(other.Value())) {
      finding.remedies.push_back(remedy);
    }
  }
  findings->push_back(finding);
  return true;
}

}  // namespace sysid
