#include "tests/acceptance/checks/planted_fault.h"

#include <algorithm>

#include "models/error.h"
#include "sysid/checks/run_checks.h"
#include "sysid/session/check_runs.h"
#include "sysid/session/check_session.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {

const std::vector<Fault>& Faults() {
  static const std::vector<Fault>& faults = *new std::vector<Fault>([] {
    std::vector<Fault> all;
    for (const FaultKind kind : kFaultKinds) {
      for (Fault& fault : kind()) all.push_back(std::move(fault));
    }
    return all;
  }());
  return faults;
}

std::vector<Finding> CheckCase(const Session& session) {
  std::vector<Finding> findings;
  try {
    CheckTimes(session.runs, session.columns, session.model.mechanism());
    CheckMotion(session.runs);
  } catch (const InputError& error) {
    return {Unreadable(session.runs.front().name, error)};
  }
  return RunChecks(InputOf(session)).findings;
}

bool IsNamed(const Fault& fault, const std::vector<Finding>& findings) {
  if (findings.empty()) return false;
  const std::string& first = findings.front().fault;
  return first == fault.name ||
         std::find(fault.as_good.begin(), fault.as_good.end(), first) !=
             fault.as_good.end();
}

}  // namespace sysid
