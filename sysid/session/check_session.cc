#include "sysid/session/check_session.h"

#include <utility>

#include "sysid/checks/remedy.h"
#include "sysid/checks/run_checks.h"

namespace sysid {
CheckInput InputOf(const Session& session) {
  CheckInput input;
  input.model = &session.model;
  input.model_file = session.model_file;
  input.free = &session.free;
  for (const Run& run : session.runs) input.runs.push_back(&run);
  for (const Run& run : session.holdout) input.runs.push_back(&run);
  input.columns = session.columns;
  input.flag_columns = session.flag_columns;
  input.flag_edits = session.flag_edits;
  input.options = session.options;
  return input.runs.size() == 1 ? OfOneRun(input, *input.runs.front()) : input;
}

double CheckSession(Session* session) {
  CheckResult result = RunChecks(InputOf(*session));
  session->findings = std::move(result.findings);
  session->checked = true;
  for (const Finding& finding : session->findings) {
    session->notices.push_back(BriefText(finding));
  }
  return result.error;
}

std::string CheckedLine(const Session& session) {
  if (!session.checked) return "";
  const size_t runs = session.runs.size() + session.holdout.size();
  const std::string count =
      std::to_string(runs) + (runs == 1 ? " run" : " runs");
  const size_t found = session.findings.size();
  return found == 0
             ? "  checked: nothing wrong with " + count + "\n"
             : "  checked: " + std::to_string(found) +
                   (found == 1 ? " finding" : " findings") + " in " + count +
                   ", first " + session.findings.front().fault + "\n";
}

}  // namespace sysid
