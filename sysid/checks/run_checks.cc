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
  finding.evidence = error.detail();
  finding.file = error.place();
  finding.consequence = "no program reads it so";
  if (!error.hint().empty()) finding.remedies = {error.hint()};
  return finding;
}

}  // namespace sysid
