#include "sysid/checks/physics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "sysid/checks/as_read.h"
#include "sysid/checks/find_idle_effort.h"
#include "sysid/checks/find_knob.h"
#include "sysid/checks/find_reading.h"
#include "sysid/checks/find_skew.h"
#include "sysid/checks/remedy.h"

namespace sysid {
namespace {

// An angle whose "noise" is a good part of a turn is no smooth motion as it was
// read (degrees that wrap at every sample): any model is within such a noise.
bool HasRoughAngle(const AsRead& as_read) {
  constexpr double kRough = 0.2;  // rad
  const RunData& data = *as_read.fit().problem->runs().front();
  const Mechanism& mechanism = as_read.input().model->mechanism();
  for (size_t c = 0; c < data.sigma.size(); ++c) {
    const Channel& channel = data.run.channels[c];
    if (channel.kind == ChannelKind::kPosition &&
        IsRotation1(mechanism.joints[channel.target].type) &&
        data.sigma[c] > kRough) {
      return true;
    }
  }
  return false;
}

bool Misses(const AsRead& as_read) {
  return as_read.fit().error > kExplained || HasRoughAngle(as_read);
}

// One run of several by itself: a fault that it has alone is none that the same
// reading of all of them mends.
struct SingleRun {
  SingleRun(const CheckInput& all, const Run& run, double part)
      : input(OfOneRun(all, run)), as_read(input, part) {}
  SingleRun(const SingleRun&) = delete;
  SingleRun& operator=(const SingleRun&) = delete;

  CheckInput input;
  AsRead as_read;
};

// Those that the model misses by far more than another, if it can be asked of
// them: what is wrong with all of them was asked before.
class RunsThatStandOut {
 public:
  explicit RunsThatStandOut(const CheckInput& input) {
    constexpr double kLeastPart = 0.3;
    constexpr size_t kMost = 4;
    if (input.runs.size() < 2) return;
    for (const Run* run : input.runs) {
      auto single = std::make_unique<SingleRun>(
          input, *run, std::max(kLeastPart, 1.0 / input.runs.size()));
      if (single->as_read.empty()) continue;
      least_ = std::min(least_, single->as_read.fit().error);
      runs_.push_back(std::move(single));
    }
    std::erase_if(runs_, [&](const auto& single) {
      return !Misses(single->as_read) ||
             !StandsOut(single->as_read.fit().error);
    });
    std::stable_sort(runs_.begin(), runs_.end(),
                     [](const auto& a, const auto& b) {
                       return a->as_read.fit().error > b->as_read.fit().error;
                     });
    if (runs_.size() > kMost) runs_.resize(kMost);
  }

  // In each of them, the worst first. What leaves a run standing out, or misses
  // more of it than `most` (of what all runs may have), is not what is wrong
  // with it.
  bool Find(bool (*find)(AsRead*, std::vector<Finding>*), double most,
            std::vector<Finding>* findings) const {
    std::vector<Finding> found;
    for (const auto& single : runs_) find(&single->as_read, &found);
    std::erase_if(found, [&](const Finding& finding) {
      return StandsOut(finding.error_left) || finding.error_left > most;
    });
    findings->insert(findings->end(), found.begin(), found.end());
    return !found.empty();
  }

 private:
  bool StandsOut(double error) const {
    constexpr double kFar = 1.3;
    return error > std::max(kExplained, kFar * least_);
  }

  std::vector<std::unique_ptr<SingleRun>> runs_;
  double least_ = INFINITY;  // error of any
};

// Of a motion that cannot be followed at all, where no reading mends it.
Finding Diverges(const CheckInput& input) {
  Finding finding;
  finding.fault = "diverges";
  finding.severity = Severity::kWrong;
  finding.error_left = INFINITY;
  if (input.runs.size() == 1) finding.file = input.runs.front()->name;
  finding.evidence =
      "from the recorded states the model's motion grows without bound, even "
      "over a few samples";
  finding.consequence =
      "nothing can be fitted; some effort, mass or damping is wrong by orders "
      "of magnitude (efforts in N mm, masses in grams?), in the run or in " +
      input.model_file;
  return finding;
}

}  // namespace

double CheckPhysics(const CheckInput& input, std::vector<Finding>* findings) {
  AsRead as_read(input);
  if (as_read.empty()) return std::numeric_limits<double>::quiet_NaN();
  const bool is_rough = HasRoughAngle(as_read);
  const double error =
      is_rough ? std::numeric_limits<double>::quiet_NaN() : as_read.fit().error;
  if (!Misses(as_read)) return error;
  if (FindReading(&as_read, findings)) return error;
  // Another clock makes up for efforts that are another's, as masses do, and so
  // does less of them; any other number of all runs explains more than what one
  // of them has alone.
  std::vector<Finding> knobs;
  if (!is_rough && FindKnob(&as_read, &knobs) &&
      knobs[0].fault != "clock_scale" && knobs[0].fault != "effort_scale") {
    findings->push_back(knobs[0]);
    return error;
  }
  const RunsThatStandOut singles(input);
  const double most = knobs.empty() ? INFINITY : knobs[0].error_left;
  if (singles.Find(FindReading, most, findings) || is_rough) return error;
  if (singles.Find(FindKnob, most, findings)) return error;
  if (!as_read.CouldBeModel()) {
    if (FindIdleEffort(as_read, findings)) return error;
    if (knobs.empty() && FindSkew(as_read, findings)) return error;
  }
  findings->insert(findings->end(), knobs.begin(), knobs.end());
  if (knobs.empty() && std::isinf(error)) findings->push_back(Diverges(input));
  return error;
}

}  // namespace sysid
