#include "sysid/checks/physics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/knobs.h"
#include "sysid/checks/quick_fit.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

constexpr int kSamples = 2000;  // of an excerpt
constexpr double kUnknown = std::numeric_limits<double>::infinity();
constexpr int kGlanceSamples = 400;
// A model within this of the noise misses nothing worth a reading.
constexpr double kFits = 1.5;
// By how much another reading must lower the error. On recordings without a
// fault every other discrete reading raises it (by 1.2 at the least, where a
// swing is so small that its unit hardly shows), and a fault costs a factor of
// 5 and more; a shift of 10 ms costs 1.5 and more, and what is really late by
// some milliseconds in a recording gains 1.15 (docs/checks.md).
constexpr double kReading = 2.0;
// In how many of the windows at least: what is right is so everywhere, and one
// window in which the motion is chaotic decides nothing.
constexpr double kWindows = 0.7;
// And by how much it must be better than anything that the bodies, springs and
// zeros of the model could make of the data as they were read.
constexpr double kBeyondModel = 1.15;
// Readings this near to the best explain the data as well.
constexpr double kEqual = 1.15;
constexpr double kSignificance = 4.0;  // standard errors, of a knob

std::string TimesText(double error) {
  return ShortNumber(error) + " times the noise";
}

// To the decimal place in which its standard error begins.
double Rounded(double value, double std_error) {
  const double place = std::pow(10.0, std::floor(std::log10(std_error)));
  return std_error > 0.0 ? place * std::round(value / place) : value;
}

class Physics {
 public:
  Physics(const CheckInput& input)
      : input_(input),
        excerpt_(input.runs, kSamples),
        glance_(input.runs, kGlanceSamples),
        options_(input.options),
        lean_(WithFriction(*input.model, *input.free, input.runs)) {
    options_.rollout.step = 0.0;
  }

  // The error of the data as they were read, times the noise.
  double Check(std::vector<Finding>* findings);

 private:
  struct Candidate {
    const Reading* reading;
    double glance;  // error over that as it was read, of short segments
    double given;   // the error as it was read, in units of this noise
    QuickFit fit;
  };

  // How far the data misses in units of a reading's noise: a channel in another
  // unit may be no smooth motion at all as it was read, and its noise with it.
  double InUnitsOf(const Reading& reading, const QuickFit& as_read,
                   const QuickFit& given) const;
  LooseModel ModelOf(const Reading& reading) const {
    LooseModel model = lean_;
    if (reading.change_model) reading.change_model(&model.model);
    return model;
  }
  // The full fits of the readings that a glance does not rule out, best first.
  std::vector<Candidate> Readings(const std::vector<Reading>& readings);
  bool HasRoughAngle() const;
  bool FindReading(std::vector<Finding>* findings);
  bool FindKnob(std::vector<Finding>* findings);
  // The error of the data as they were read with a model that may be anything.
  double Anything();

  const CheckInput& input_;
  const Excerpt excerpt_, glance_;
  EstimationOptions options_;
  const LooseModel lean_;
  QuickFit given_;
  std::optional<double> anything_;
};

double Physics::InUnitsOf(const Reading& reading, const QuickFit& as_read,
                          const QuickFit& given) const {
  if (reading.factor == 1.0) return given.error;
  const RunData& theirs = *as_read.problem->runs().front();
  const RunData& ours = *given.problem->runs().front();
  for (size_t c = 0; c < ours.sigma.size(); ++c) {
    const Channel& channel = ours.run.channels[c];
    if (channel.kind != ChannelKind::kPosition ||
        channel.target != reading.target) {
      continue;
    }
    const double larger = ours.sigma[c] * reading.factor / theirs.sigma[c];
    return given.error * std::max(1.0, larger);
  }
  return given.error;
}

double Physics::Anything() {
  if (!anything_) {
    anything_ = FitQuickly(WithEverything(lean_), excerpt_.Windows({}),
                           options_, Effort::kFull, nullptr)
                    .error;
  }
  return *anything_;
}

std::vector<Physics::Candidate> Physics::Readings(
    const std::vector<Reading>& readings) {
  const QuickFit given = FitQuickly(lean_, glance_.Windows({}), options_,
                                    Effort::kGlance, nullptr);
  std::vector<Candidate> candidates;
  for (const Reading& reading : readings) {
    Candidate candidate{&reading, 0.0, 0.0, {}};
    const QuickFit fit =
        FitQuickly(ModelOf(reading), glance_.Windows(reading.change), options_,
                   Effort::kGlance, nullptr);
    candidate.glance = fit.error / InUnitsOf(reading, fit, given);
    if (candidate.glance < 1.0) candidates.push_back(std::move(candidate));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.glance < b.glance;
                   });
  // Short segments forgive much: what is right is among their best.
  constexpr size_t kMost = 6;
  if (candidates.size() > kMost) candidates.resize(kMost);
  for (Candidate& candidate : candidates) {
    const Reading& reading = *candidate.reading;
    candidate.fit =
        FitQuickly(ModelOf(reading), excerpt_.Windows(reading.change), options_,
                   Effort::kFull, nullptr);
    candidate.given = InUnitsOf(reading, candidate.fit, given_);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.fit.error * b.given < b.fit.error * a.given;
                   });
  return candidates;
}

bool Physics::FindReading(std::vector<Finding>* findings) {
  std::vector<Reading> readings;
  for (const ReadingFamily family : kReadingFamilies) {
    family(input_, &readings);
  }
  const std::vector<Candidate> candidates = Readings(readings);
  if (candidates.empty()) return false;
  const double best = candidates.front().fit.error;
  const double given = candidates.front().given;
  if (!(best * kReading < given)) return false;
  const bool of_model =
      static_cast<bool>(candidates.front().reading->change_model);
  if (PartImproved(candidates.front().fit, given_, given / given_.error) <
      kWindows) {
    return false;
  }
  const double anything = Anything() * (given / given_.error);
  if (!of_model && !(best * kBeyondModel < anything)) return false;
  // Of those that do as well, in the order of the list.
  std::vector<const Candidate*> equal;
  for (const Candidate& candidate : candidates) {
    if (candidate.fit.error <= kEqual * best) equal.push_back(&candidate);
  }
  std::stable_sort(equal.begin(), equal.end(),
                   [](const Candidate* a, const Candidate* b) {
                     return a->reading < b->reading;
                   });
  const Reading& first = *equal.front()->reading;
  Finding finding;
  finding.fault = first.fault;
  finding.severity = Severity::kWrong;
  finding.weight = given / best;
  finding.file = first.change_model        ? input_.model_file
                 : input_.runs.size() == 1 ? input_.runs.front()->name
                                           : "";
  finding.subject = first.subject;
  finding.evidence = "as it was read the model misses the data by " +
                     TimesText(given) + ", " + first.says + " by " +
                     TimesText(equal.front()->fit.error);
  for (size_t i = 1; i < equal.size(); ++i) {
    finding.evidence +=
        (i == 1 ? "; the data cannot tell it from reading it " : ", or ") +
        equal[i]->reading->says;
  }
  finding.consequence = first.consequence;
  for (const Candidate* candidate : equal) {
    for (const std::string& remedy : candidate->reading->remedies) {
      finding.remedies.push_back(remedy);
    }
  }
  findings->push_back(finding);
  return true;
}

bool Physics::FindKnob(std::vector<Finding>* findings) {
  std::vector<Knob> knobs;
  for (const KnobFamily family : kKnobFamilies) family(input_, &knobs);
  if (knobs.empty()) return false;
  struct Candidate {
    const Knob* knob;
    double value, std_error, error, windows;
  };
  std::vector<Candidate> candidates;
  const std::vector<KnobScore> scores =
      ScoreKnobs(lean_, given_, excerpt_, knobs);
  for (size_t i = 0; i < knobs.size(); ++i) {
    if (!scores[i].known || std::abs(scores[i].value) < knobs[i].least)
      continue;
    const double value =
        std::clamp(scores[i].value, -knobs[i].most, knobs[i].most);
    candidates.push_back(
        {&knobs[i], value, scores[i].std_error, scores[i].error, 0.0});
  }
  std::stable_sort(
      candidates.begin(), candidates.end(),
      [](const Candidate& a, const Candidate& b) { return a.error < b.error; });
  constexpr size_t kMost = 4;
  if (candidates.size() > kMost) candidates.resize(kMost);
  // Where each ends, with everything else refitted.
  for (Candidate& candidate : candidates) {
    const Knob& knob = *candidate.knob;
    candidate.error = std::numeric_limits<double>::infinity();
    double value = candidate.value;
    for (int step = 0; step < 5; ++step) {
      const QuickFit fit = FitQuickly(
          lean_, excerpt_.Windows([&](Run* run) { knob.change(value, run); }),
          options_, Effort::kFull, &given_);
      if (!(fit.error < candidate.error)) break;
      candidate.error = fit.error;
      candidate.value = value;
      candidate.windows = PartImproved(fit, given_, 1.0);
      Knob beyond = knob;
      beyond.change = [&knob, value](double more, Run* run) {
        knob.change(value + more, run);
      };
      const KnobScore next = ScoreKnobs(lean_, fit, excerpt_, {beyond}).front();
      if (!next.known) break;
      candidate.std_error = next.std_error;
      if (std::abs(next.value) < 0.1 * knob.least) break;
      value = std::clamp(value + next.value, -knob.most, knob.most);
    }
  }
  std::stable_sort(
      candidates.begin(), candidates.end(),
      [](const Candidate& a, const Candidate& b) { return a.error < b.error; });
  if (candidates.empty()) return false;
  const Candidate& best = candidates.front();
  const Knob& knob = *best.knob;
  if (!(best.error * knob.gain < given_.error) || best.windows < kWindows ||
      std::abs(best.value) < knob.least ||
      std::abs(best.value) < kSignificance * best.std_error ||
      (!knob.of_model && !(best.error * kBeyondModel < Anything()))) {
    return false;
  }
  Finding finding;
  finding.fault = knob.fault;
  finding.severity = Severity::kWrong;
  finding.weight = given_.error / best.error;
  if (input_.runs.size() == 1) finding.file = input_.runs.front()->name;
  finding.subject = knob.subject;
  finding.evidence = "as it was read the model misses the data by " +
                     TimesText(given_.error) + ", " +
                     knob.says(Rounded(best.value, best.std_error)) + " (+- " +
                     ShortNumber(1.96 * best.std_error) + " " + knob.unit +
                     ") by " + TimesText(best.error);
  finding.consequence = knob.consequence;
  finding.remedies = knob.remedies(Rounded(best.value, best.std_error));
  for (size_t i = 1; i < candidates.size(); ++i) {
    const Candidate& other = candidates[i];
    if (other.error > kEqual * best.error) break;
    if (std::abs(other.value) < kSignificance * other.std_error ||
        other.knob->fault != knob.fault) {
      continue;
    }
    finding.evidence += (finding.remedies.size() == 1
                             ? "; the data hardly tells it from reading it "
                             : ", or ") +
                        other.knob->says(Rounded(other.value, other.std_error));
    for (const std::string& remedy :
         other.knob->remedies(Rounded(other.value, other.std_error))) {
      finding.remedies.push_back(remedy);
    }
  }
  findings->push_back(finding);
  return true;
}

// An angle whose "noise" is a good part of a turn is no smooth motion as it was
// read (degrees that wrap at every sample): any model is within such a noise.
bool Physics::HasRoughAngle() const {
  constexpr double kRough = 0.2;  // rad
  const RunData& data = *given_.problem->runs().front();
  for (size_t c = 0; c < data.sigma.size(); ++c) {
    const Channel& channel = data.run.channels[c];
    if (channel.kind == ChannelKind::kPosition &&
        IsRotation1(input_.model->mechanism().joints[channel.target].type) &&
        data.sigma[c] > kRough) {
      return true;
    }
  }
  return false;
}

double Physics::Check(std::vector<Finding>* findings) {
  if (excerpt_.empty() || glance_.empty()) return kUnknown;
  given_ =
      FitQuickly(lean_, excerpt_.Windows({}), options_, Effort::kFull, nullptr);
  const bool rough = HasRoughAngle();
  if (given_.error <= kFits && !rough) return given_.error;
  if (FindReading(findings)) return kUnknown;
  if (std::isfinite(given_.error) && !rough) FindKnob(findings);
  return given_.error;
}

}  // namespace

bool CheckPhysics(const CheckInput& input, std::vector<Finding>* findings) {
  return Physics(input).Check(findings) <= kFits;
}

}  // namespace sysid
