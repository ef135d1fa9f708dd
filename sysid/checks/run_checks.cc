#include "sysid/checks/run_checks.h"

#include <algorithm>
#include <string_view>

#include "sysid/checks/physics.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {

std::vector<Finding> RunChecks(const CheckInput& input) {
  std::vector<Finding> findings;
  if (input.runs.empty()) return findings;
  for (const NumbersCheck check : kNumbersChecks) check(input, &findings);
  const auto is_wrong = [](const Finding& finding) {
    return finding.severity == Severity::kWrong;
  };
  // Numbers that are wrong by themselves come first: physics would look for
  // what explains them too.
  if (std::none_of(findings.begin(), findings.end(), is_wrong)) {
    const size_t before = findings.size();
    const bool explained = CheckPhysics(input, &findings);
    // What only looked suspicious of the model is settled by the motion.
    const bool found = findings.size() > before;
    std::erase_if(findings, [&](const Finding& finding) {
      return finding.severity == Severity::kNote && (explained || found);
    });
  }
  Sort(&findings);
  return findings;
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
