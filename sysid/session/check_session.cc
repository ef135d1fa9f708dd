#include "sysid/session/check_session.h"

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
  return input;
}

void CheckSession(Session* session) {
  session->findings = RunChecks(InputOf(*session));
  session->checked = true;
}

std::vector<std::string> CheckedLines(const Session& session) {
  std::vector<std::string> lines;
  if (!session.checked) return lines;
  if (session.findings.empty()) {
    const size_t runs = session.runs.size() + session.holdout.size();
    lines.push_back("checked: nothing wrong with " + std::to_string(runs) +
                    (runs == 1 ? " run" : " runs"));
  }
  for (const Finding& finding : session.findings) {
    lines.push_back(BriefText(finding));
  }
  return lines;
}

}  // namespace sysid
