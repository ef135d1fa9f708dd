#include "sysid/checks/run_checks.h"

#include <algorithm>
#include <string_view>

#include "sysid/checks/physics.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

bool IsSlow(const std::vector<Finding>& findings) {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& f) {
    return f.fault == "slow_sampling";
  });
}

// The input with even times in the runs whose stamps were found to be wrong:
// their errors look like all sorts of things.
class Mended {
 public:
  Mended(const CheckInput& input, const std::vector<Finding>& findings)
      : input_(input) {
    runs_.reserve(input.runs.size());  // input_ points into it
    for (const Run*& run : input_.runs) {
      if (!IsJittered(*run, findings)) continue;
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
  static bool IsJittered(const Run& run, const std::vector<Finding>& findings) {
    return std::any_of(findings.begin(), findings.end(), [&](const Finding& f) {
      return f.fault == "time_jitter" && f.file == run.name;
    });
  }

  CheckInput input_;
  std::vector<Run> runs_;
};

// Of what the physics found, from `before` on. Between samples so far apart
// nobody knows the efforts, and physics blames whatever it can; only in
// degrees, which is plain then, samples that seem far apart are not.
void DropGuesses(size_t before, std::vector<Finding>* findings) {
  constexpr double kPlain = 5.0;  // by how much the error falls at least
  const auto is_degrees = [](const Finding& f) {
    return f.fault == "degrees" && f.weight > kPlain;
  };
  const auto found = findings->begin() + before;
  if (std::any_of(found, findings->end(), is_degrees)) {
    std::erase_if(*findings,
                  [](const Finding& f) { return f.fault == "slow_sampling"; });
  } else {
    findings->erase(found, findings->end());
  }
}

}  // namespace

CheckResult RunChecks(const CheckInput& input) {
  CheckResult result;
  std::vector<Finding>& findings = result.findings;
  if (input.runs.empty()) return result;
  for (const NumbersCheck check : kNumbersChecks) check(input, &findings);
  const auto is_wrong = [](const Finding& finding) {
    return finding.severity == Severity::kWrong;
  };
  // Numbers that are wrong by themselves come first: physics would look for
  // what explains them too.
  if (std::none_of(findings.begin(), findings.end(), is_wrong)) {
    const size_t before = findings.size();
    const Mended mended(input, findings);
    result.error = CheckPhysics(mended.input(), &findings);
    const bool explained = result.error <= kExplained;
    // What only looked suspicious of the model is settled by the motion.
    const bool found = findings.size() > before;
    if (IsSlow(findings)) DropGuesses(before, &findings);
    std::erase_if(findings, [&](const Finding& finding) {
      return finding.severity == Severity::kNote && (explained || found);
    });
  }
  Sort(&findings);
  return result;
}

Finding Unreadable(const std::string& file, const InputError& error) {
  // What the reader's refusals are called here, by their words.
  struct Name {
    std::string_view words, fault;
  };
  static constexpr Name kNames[] = {
      {"time repeats", "time_repeats"},
      {"time goes back", "time_goes_back"},
      {"looks like degrees", "degrees"},
      {"is the time in milliseconds", "milliseconds"},
      {"nothing was sampled from", "gap"},
      {"samples: too few", "few_samples"},
      {"ever changes", "still"},
      {" has norm ", "quaternion_norm"},
  };
  Finding finding;
  finding.fault = "unreadable";
  for (const Name& name : kNames) {
    if (std::string_view(error.what()).find(name.words) !=
        std::string_view::npos) {
      finding.fault = name.fault;
    }
  }
  finding.severity = Severity::kUnreadable;
  finding.file = file;
  finding.evidence = error.what();
  // what() is "<place>: <what>\n  hint: <hint>".
  const size_t hint = finding.evidence.find("\n  hint: ");
  if (hint != std::string::npos) finding.evidence.resize(hint);
  if (finding.evidence.rfind(error.place() + ": ", 0) == 0) {
    finding.evidence.erase(0, error.place().size() + 2);
  }
  finding.file = error.place();
  finding.consequence = "no program reads it so";
  if (!error.hint().empty()) finding.remedies = {error.hint()};
  return finding;
}

}  // namespace sysid
