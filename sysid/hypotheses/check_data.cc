#include "sysid/hypotheses/check_data.h"

#include <algorithm>
#include <utility>

#include "sysid/checks/shipped_checks.h"
#include "sysid/hypotheses/data_hypothesis.h"
#include "sysid/hypotheses/test_hypotheses.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

bool Has(const std::vector<Finding>& findings, const std::string& fault) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& f) { return f.fault == fault; });
}

// Velocities that contradict positions: the numbers do not tell which of them
// is wrong, or whether the clock is; the motion of the positions alone does.
std::vector<Finding> Contradictions(const CheckInput& input) {
  std::vector<Finding> findings;
  // Of the runs of other processes nothing is known here.
  if (input.run_names.size() <= input.runs.size()) {
    CheckVelocities(input, &findings);
  }
  return findings;
}

// Whether the joint's position is measured, too.
bool IsDoubled(const Run& run, const Channel& channel) {
  return channel.kind == ChannelKind::kVelocity &&
         FindChannel(run, ChannelKind::kPosition, channel.target) != nullptr;
}

// The input with even times in the runs whose stamps were found to be wrong
// (their errors look like all sorts of things), and, where some velocity
// contradicts its position, without the velocities.
class Mended {
 public:
  Mended(const CheckInput& input, const std::vector<Finding>& findings,
         bool positions_alone)
      : input_(input) {
    runs_.reserve(input.runs.size());  // input_ points into it
    for (const Run*& run : input_.runs) {
      const bool is_jittered =
          std::any_of(findings.begin(), findings.end(), [&](const Finding& f) {
            return f.fault == kTimeJitter && f.file == run->name;
          });
      if (!is_jittered && !positions_alone) continue;
      Run& mended = runs_.emplace_back(*run);
      run = &mended;
      if (is_jittered) {
        std::vector<double>& t = mended.t;
        const double begin = t.front();
        const double period = (t.back() - begin) / (t.size() - 1);
        for (size_t k = 0; k < t.size(); ++k) t[k] = begin + k * period;
      }
      if (positions_alone) {
        const Run as_read = mended;
        std::erase_if(mended.channels, [&](const Channel& channel) {
          return IsDoubled(as_read, channel);
        });
      }
    }
  }
  Mended(const Mended&) = delete;
  Mended& operator=(const Mended&) = delete;

  const CheckInput& input() const { return input_; }

 private:
  CheckInput input_;
  std::vector<Run> runs_;
};

// Whether velocities agree with positions and a clock as supposed; `positions`
// is the input without velocities.
bool Settles(const Supposition& supposed, const CheckInput& input,
             const CheckInput& positions) {
  const Mechanism& mechanism = input.model->mechanism();
  std::vector<Run> runs;
  for (size_t r = 0; r < input.runs.size(); ++r) {
    Run run = *positions.runs[r];
    Undo(supposed, mechanism, static_cast<int>(r), &run);
    for (const Channel& channel : input.runs[r]->channels) {
      if (IsDoubled(*input.runs[r], channel)) run.channels.push_back(channel);
    }
    runs.push_back(std::move(run));
  }
  CheckInput changed = input;
  for (size_t r = 0; r < runs.size(); ++r) changed.runs[r] = &runs[r];
  return Contradictions(changed).empty();
}

// Between samples that are too far apart nobody knows the efforts, and no
// hypothesis about them can be judged; but where degrees explain the motion the
// samples only seemed to be far apart.
void SettleSlowSampling(std::vector<Finding>* numbers,
                        std::vector<Finding>* found) {
  if (!Has(*numbers, kSlowSampling)) return;
  if (Has(*found, ToString(DataFault::kDegrees))) {
    std::erase_if(*numbers,
                  [](const Finding& f) { return f.fault == kSlowSampling; });
  } else {
    found->clear();
  }
}

}  // namespace

bool IsIn(const std::vector<Finding>& findings, const Finding& finding) {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding& f) {
    return f.fault == finding.fault && f.file == finding.file &&
           f.subject == finding.subject;
  });
}

CheckResult CheckData(const CheckInput& input, std::vector<Finding> numbers,
                      double budget) {
  CheckResult result;
  const std::vector<Finding> contradictions = Contradictions(input);
  const bool is_wrong =
      std::any_of(numbers.begin(), numbers.end(), [&](const Finding& finding) {
        return finding.severity == Severity::kWrong &&
               !IsIn(contradictions, finding);
      });
  // Numbers that are wrong by themselves come first: hypotheses would explain
  // them too.
  if (!is_wrong && !input.runs.empty()) {
    const Mended mended(input, numbers, !contradictions.empty());
    HypothesisReport report = TestHypotheses(mended.input(), budget);
    if (report.found && !contradictions.empty() &&
        Settles(*report.found, input, mended.input())) {
      std::erase_if(numbers, [&](const Finding& finding) {
        return IsIn(contradictions, finding);
      });
    }
    result.error = report.error;
    result.not_asked = std::move(report.not_asked);
    result.compared = std::move(report.compared);
    SettleSlowSampling(&numbers, &report.findings);
    // What only looked suspicious of the model is settled by the motion.
    const bool settled = result.error <= kExplained || !report.findings.empty();
    std::erase_if(numbers, [&](const Finding& finding) {
      return finding.severity == Severity::kNote && settled;
    });
    numbers.insert(numbers.end(), report.findings.begin(),
                   report.findings.end());
  }
  result.findings = std::move(numbers);
  Sort(&result.findings);
  return result;
}

}  // namespace sysid
