#include "sysid/hypotheses/check_data.h"

#include <algorithm>
#include <utility>

#include "sysid/hypotheses/data_hypothesis.h"
#include "sysid/hypotheses/test_hypotheses.h"

namespace sysid {
namespace {

bool Has(const std::vector<Finding>& findings, const std::string& fault) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& f) { return f.fault == fault; });
}

// The input with even times in the runs whose stamps were found to be wrong:
// their errors look like all sorts of things.
class Mended {
 public:
  Mended(const CheckInput& input, const std::vector<Finding>& findings)
      : input_(input) {
    runs_.reserve(input.runs.size());  // input_ points into it
    for (const Run*& run : input_.runs) {
      const bool is_jittered =
          std::any_of(findings.begin(), findings.end(), [&](const Finding& f) {
            return f.fault == kTimeJitter && f.file == run->name;
          });
      if (!is_jittered) continue;
      runs_.push_back(*run);
      std::vector<double>& t = runs_.back().t;
      const double begin = t.front();
      const double period = (t.back() - begin) / (t.size() - 1);
      for (size_t k = 0; k < t.size(); ++k) t[k] = begin + k * period;
      run = &runs_.back();
    }
  }
  Mended(const Mended&) = delete;
  Mended& operator=(const Mended&) = delete;

  const CheckInput& input() const { return input_; }

 private:
  CheckInput input_;
  std::vector<Run> runs_;
};

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

CheckResult CheckData(const CheckInput& input, std::vector<Finding> numbers,
                      double budget) {
  CheckResult result;
  const bool is_wrong =
      std::any_of(numbers.begin(), numbers.end(), [](const Finding& finding) {
        return finding.severity == Severity::kWrong;
      });
  // Numbers that are wrong by themselves come first: hypotheses would explain
  // them too.
  if (!is_wrong && !input.runs.empty()) {
    const Mended mended(input, numbers);
    HypothesisReport report = TestHypotheses(mended.input(), budget);
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
