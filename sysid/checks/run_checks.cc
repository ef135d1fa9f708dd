#include "sysid/checks/shipped_checks.h"
#include "sysid/io/unreadable_run.h"

namespace sysid {

std::vector<Finding> CheckNumbers(const CheckInput& input) {
  std::vector<Finding> findings;
  if (input.runs.empty()) return findings;
  for (const NumbersCheck check : kNumbersChecks) check(input, &findings);
  Sort(&findings);
  return findings;
}

Finding Unreadable(const InputError& error) {
  Finding finding;
  const auto* run = dynamic_cast<const UnreadableRun*>(&error);
  finding.fault = run != nullptr ? run->fault() : "unreadable";
  finding.severity = Severity::kUnreadable;
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
