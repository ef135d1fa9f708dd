#include "sysid/checks/find_reading.h"

#include <algorithm>
#include <cmath>

#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

// By how much another reading must lower the error. On recordings without a
// fault every other discrete reading raises it, or lowers it by 1.14 at the
// most (the sign of an effort that is nearly zero); a fault costs a factor of
// 1.6 and more (docs/checks.md).
constexpr double kReading = 1.5;
// Readings this near to the best explain the data as well.
constexpr double kEqual = 1.15;

struct Candidate {
  const Reading* reading;
  double glance;  // error over that as it was read, of short segments
  double scale;   // what an error as it was read counts in units of this noise
  QuickFit fit;
};

class ReadingSearch {
 public:
  explicit ReadingSearch(AsRead* as_read) : as_read_(*as_read) {
    for (const ReadingFamily family : kReadingFamilies) {
      family(as_read_.input(), &readings_);
    }
    if (!as_read_.CouldBeModel()) return;
    std::erase_if(readings_, [](const Reading& reading) {
      return !static_cast<bool>(reading.change_model);
    });
  }

  bool Find(std::vector<Finding>* findings);

 private:
  LooseModel ModelOf(const Reading& reading) const {
    LooseModel model = as_read_.lean();
    if (reading.change_model) reading.change_model(&model.model);
    return model;
  }
  // Those that a glance does not rule out, fitted in full, best first.
  std::vector<Candidate> Candidates() const;
  double ErrorAsRead(const Candidate& candidate) const {
    return as_read_.missed() * candidate.scale;
  }

  AsRead& as_read_;
  std::vector<Reading> readings_;
};

// Geometric mean of the noises of all columns: the same for columns that trade
// places.
double MeanNoise(const QuickFit& fit) {
  double sum = 0.0;
  const std::vector<double>& sigma = fit.problem->runs().front()->sigma;
  for (const double s : sigma) sum += std::log(s);
  return std::exp(sum / static_cast<double>(sigma.size()));
}

// What an error of the data as they were read counts in units of a reading's
// noise. A reading that makes columns rougher (one less another that is coarse)
// does not explain the more by it; one in another unit may make a motion of
// what was no smooth motion at all.
double ScaleOf(const Reading& reading, const QuickFit& fit,
               const QuickFit& as_read) {
  if (reading.factor == 1.0) {
    return std::min(1.0, MeanNoise(as_read) / MeanNoise(fit));
  }
  const RunData& theirs = *fit.problem->runs().front();
  const RunData& ours = *as_read.problem->runs().front();
  for (size_t c = 0; c < ours.sigma.size(); ++c) {
    const Channel& channel = ours.run.channels[c];
    if (channel.kind != ChannelKind::kPosition ||
        channel.target != reading.target) {
      continue;
    }
    return std::max(1.0, ours.sigma[c] * reading.factor / theirs.sigma[c]);
  }
  return 1.0;
}

std::vector<Candidate> ReadingSearch::Candidates() const {
  const QuickFit as_read = as_read_.Glance(as_read_.lean(), {});
  std::vector<Candidate> candidates;
  for (const Reading& reading : readings_) {
    const QuickFit fit = as_read_.Glance(ModelOf(reading), reading.change);
    const double glance =
        fit.error / (as_read.error * ScaleOf(reading, fit, as_read));
    // What is wrong with a body shows less in short segments.
    const double most = reading.change_model ? 1.25 : 1.0;
    if (glance < most) candidates.push_back({&reading, glance, 1.0, {}});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.glance < b.glance;
                   });
  // Short segments forgive much: what is right is among their best.
  constexpr size_t kMost = 8;
  if (candidates.size() > kMost) candidates.resize(kMost);
  for (Candidate& candidate : candidates) {
    const Reading& reading = *candidate.reading;
    candidate.fit =
        FitQuickly(ModelOf(reading), as_read_.excerpt().Windows(reading.change),
                   as_read_.options());
    candidate.scale = ScaleOf(reading, candidate.fit, as_read_.fit());
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.fit.error / a.scale < b.fit.error / b.scale;
                   });
  return candidates;
}

bool ReadingSearch::Find(std::vector<Finding>* findings) {
  const std::vector<Candidate> candidates = Candidates();
  if (candidates.empty()) return false;
  const Candidate& front = candidates.front();
  const double best = front.fit.error;
  const double given = ErrorAsRead(front);
  const bool of_model = static_cast<bool>(front.reading->change_model);
  if (!(best * kReading < given) ||
      PartImproved(front.fit, as_read_.fit(), front.scale) < kWindows ||
      !(of_model ||
        as_read_.IsBeyondModel(best, front.reading->change, front.scale))) {
    return false;
  }
  // Of those that do as well, in the order of the list.
  std::vector<const Candidate*> equal;
  for (const Candidate& candidate : candidates) {
    if (candidate.fit.error <= kEqual * best) equal.push_back(&candidate);
  }
  std::stable_sort(equal.begin(), equal.end(),
                   [](const Candidate* a, const Candidate* b) {
                     return a->reading < b->reading;
                   });
  const CheckInput& input = as_read_.input();
  const Reading& first = *equal.front()->reading;
  Finding finding;
  finding.fault = first.fault;
  finding.severity = Severity::kWrong;
  finding.weight = given / best;
  finding.error_left = equal.front()->fit.error;
  finding.file = first.change_model       ? input.model_file
                 : input.runs.size() == 1 ? input.runs.front()->name
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

}  // namespace

bool FindReading(AsRead* as_read, std::vector<Finding>* findings) {
  return ReadingSearch(as_read).Find(findings);
}

}  // namespace sysid
