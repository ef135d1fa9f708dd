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

// The input with one of its runs alone.
CheckInput Alone(const CheckInput& input, const Run& run) {
  CheckInput alone = input;
  alone.runs = {&run};
  alone.columns = ColumnsOf(input.columns, run.name, input.model->mechanism());
  alone.scope = RunScope(input, run.name);
  return alone;
}

// One run of several by itself: a fault that it has alone is none that the same
// reading of all of them mends.
struct SingleRun {
  SingleRun(const CheckInput& all, const Run& run, double part)
      : input(Alone(all, run)), as_read(input, part) {}
  SingleRun(const SingleRun&) = delete;
  SingleRun& operator=(const SingleRun&) = delete;

  CheckInput input;
  AsRead as_read;
};
using SingleRuns = std::vector<std::unique_ptr<SingleRun>>;

// Those that the model misses by far more than another, if it can be asked of
// them: what is wrong with all of them was asked before. The worst first.
SingleRuns RunsThatStandOut(const CheckInput& input) {
  constexpr double kLeastPart = 0.3, kFar = 1.3;
  constexpr size_t kMost = 4;
  SingleRuns singles;
  if (input.runs.size() < 2) return singles;
  double least = INFINITY;
  for (const Run* run : input.runs) {
    auto single = std::make_unique<SingleRun>(
        input, *run, std::max(kLeastPart, 1.0 / input.runs.size()));
    if (single->as_read.empty()) continue;
    least = std::min(least, single->as_read.fit().error);
    singles.push_back(std::move(single));
  }
  std::erase_if(singles, [&](const auto& single) {
    return !Misses(single->as_read) ||
           !(single->as_read.fit().error > kFar * least);
  });
  std::stable_sort(singles.begin(), singles.end(),
                   [](const auto& a, const auto& b) {
                     return a->as_read.fit().error > b->as_read.fit().error;
                   });
  if (singles.size() > kMost) singles.resize(kMost);
  return singles;
}

bool FindIn(const SingleRuns& singles,
            bool (*find)(AsRead*, std::vector<Finding>*),
            std::vector<Finding>* findings) {
  bool found = false;
  for (const auto& single : singles) {
    found = find(&single->as_read, findings) || found;
  }
  return found;
}

// Of a motion that cannot be followed at all, where no reading mends it.
Finding Diverges(const CheckInput& input) {
  Finding finding;
  finding.fault = "diverges";
  finding.severity = Severity::kWrong;
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
  const SingleRuns singles = RunsThatStandOut(input);
  if (FindIn(singles, FindReading, findings) || is_rough) return error;
  std::vector<Finding> knobs;
  // Another clock makes up for efforts that are another's, as masses do, and so
  // does less of them; but not those of one run alone.
  const bool is_clear =
      FindKnob(&as_read, &knobs)
          ? knobs[0].fault != "clock_scale" && knobs[0].fault != "effort_scale"
          : FindIn(singles, FindKnob, &knobs);
  const bool idle =
      !is_clear && !as_read.CouldBeModel() && FindIdleEffort(as_read, findings);
  if (!idle) findings->insert(findings->end(), knobs.begin(), knobs.end());
  if (!idle && knobs.empty() && std::isinf(error)) {
    findings->push_back(Diverges(input));
  }
  return error;
}

}  // namespace sysid
