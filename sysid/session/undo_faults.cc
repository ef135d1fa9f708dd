#include "sysid/session/undo_faults.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "models/error.h"
#include "sysid/checks/remedy.h"
#include "sysid/session/check_session.h"
#include "sysid/session/gather_notices.h"

namespace sysid {
namespace {

// More are wrong in no recording that a fault can still be found in.
constexpr int kMostFaults = 3;

// The request with the fix of a finding; none where that is no flag that says
// how recordings are read.
std::optional<FitRequest> WithFix(const FitRequest& request,
                                  const Finding& finding) {
  // What halves the error explains three quarters of its square, as an effect
  // must, (7.14); what the numbers show needs no model.
  constexpr double kExplains = 2.0;
  const bool explains =
      std::isnan(finding.error_left) || finding.weight > kExplains;
  if (finding.severity != Severity::kWrong || !explains || finding.is_effect ||
      finding.remedies.empty()) {
    return std::nullopt;
  }
  const std::string& fix = finding.remedies.front();
  FitRequest fixed = request;
  // Each repeats what the flag says already.
  if (fix.starts_with("--columns ")) {
    fixed.columns = ParseColumnMap(FlagValue(fix), "--columns");
  } else if (fix.starts_with("--shift ")) {
    fixed.shift = ParseShifts(FlagValue(fix), "--shift");
  } else {
    return std::nullopt;
  }
  return fixed;
}

// The session with the first fault undone that can be.
std::optional<Session> Undone(FitRequest* request, const Catalogue& catalogue,
                              const Session& session) {
  for (const Finding& finding : session.findings) {
    try {
      std::optional<FitRequest> fixed = WithFix(*request, finding);
      if (!fixed) continue;
      Session next = OpenSession(*fixed, catalogue);
      next.undone = session.undone;
      const std::string& fix = finding.remedies.front();
      next.undone.push_back({finding.fault, PlaceOf(finding),
                             fix.substr(2, fix.find(' ') - 2), FlagValue(fix),
                             fix, finding.weight});
      std::vector<std::string> notices = session.notices;
      AddNewNotices(next.notices, &notices);
      notices.push_back("the recordings are read without " + finding.fault +
                        " from here on: " + fix);
      next.notices = std::move(notices);
      *request = std::move(*fixed);
      return next;
    } catch (const InputError&) {
      // What is read so is nothing to go on with.
    }
  }
  return std::nullopt;
}

}  // namespace

void UndoFaults(FitRequest request, const Catalogue& catalogue,
                Session* session) {
  if (session->check != CheckLevel::kAll) return;
  const EstimationOptions as_asked = session->options;
  std::vector<Finding> undone;
  for (int fault = 0;; ++fault) {
    std::vector<std::string> notices = std::move(session->notices);
    session->notices.clear();
    CheckSession(session);
    AddNewNotices(session->notices, &notices);
    session->notices = std::move(notices);
    if (fault == kMostFaults || !request.runs.empty() ||
        !request.holdout_runs.empty()) {
      break;
    }
    std::optional<Session> next = Undone(&request, catalogue, *session);
    if (!next) break;
    undone.push_back(*std::find_if(
        session->findings.begin(), session->findings.end(),
        [&](const Finding& finding) {
          return finding.fault == next->undone.back().hypothesis &&
                 PlaceOf(finding) == next->undone.back().where;
        }));
    next->options.stop = as_asked.stop;
    next->options.progress = as_asked.progress;
    next->options.keep_best = as_asked.keep_best;
    *session = std::move(*next);
  }
  session->findings.insert(session->findings.begin(), undone.begin(),
                           undone.end());
}

}  // namespace sysid
