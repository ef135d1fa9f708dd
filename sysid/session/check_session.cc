#include "sysid/session/check_session.h"

#include <algorithm>
#include <limits>
#include <set>

#include "models/error.h"
#include "sysid/checks/remedy.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/hypotheses/check_data.h"
#include "sysid/hypotheses/constants.h"
#include "sysid/hypotheses/data_hypothesis.h"
#include "sysid/hypotheses/work.h"
#include "sysid/session/shared_runs.h"

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
  if (session.options.processes != nullptr) input.run_names = session.run_names;
  const size_t all = std::max(input.runs.size(), input.run_names.size());
  return all == 1 && !input.runs.empty() ? OfOneRun(input, *input.runs.front())
                                         : input;
}

namespace {

void Note(const std::vector<Finding>& findings, Session* session) {
  for (const Finding& finding : Gathered(findings)) {
    session->notices.push_back(BriefText(finding));
  }
}

// Each once, in the order of asking.
std::string Names(const std::vector<std::string>& faults) {
  std::vector<std::string> names;
  for (const std::string& fault : faults) {
    if (std::find(names.begin(), names.end(), fault) == names.end()) {
      names.push_back(fault);
    }
  }
  return Join(names);
}

}  // namespace

void CheckSessionNumbers(Session* session) {
  if (session->check == CheckLevel::kNone) return;
  session->findings = FindingsOfAll(ProcessesOf(session->options),
                                    CheckNumbers(InputOf(*session)));
  session->checked = true;
  // What a fit then finds means nothing: it does not search for long.
  constexpr int kFewIterations = 50;
  const bool undriven = std::any_of(
      session->findings.begin(), session->findings.end(),
      [](const Finding& finding) { return finding.fault == kMissingEfforts; });
  if (undriven) {
    session->options.max_iterations =
        std::min(session->options.max_iterations, kFewIterations);
  }
  Note(session->findings, session);
}

FitOutcome OutcomeOf(const Fit& fit, const ShootingProblem& problem) {
  FitOutcome outcome;
  outcome.error = fit.train.total.normalized_rms;
  outcome.converged = fit.converged;
  outcome.work = hypotheses::EstimationWork(fit, problem);
  return outcome;
}

size_t CheckSessionData(Session* session, const FitOutcome& outcome) {
  const size_t before = session->notices.size();
  // Nor where the fit was interrupted: it is to end.
  if (session->check != CheckLevel::kAll ||
      session->options.stop.stop_requested() ||
      (outcome.converged && outcome.error <= kExplained)) {
    return before;
  }
  const std::vector<Finding> numbers = session->findings;
  CheckResult result;
  try {
    result = CheckData(InputOf(*session), numbers,
                       hypotheses::kBudget * outcome.work);
  } catch (const Cancelled&) {
    session->notices.push_back(
        "stopped while the data was checked; sysid_check does it");
    return before;
  }
  session->findings = result.findings;
  std::vector<Finding> fresh;
  for (const Finding& finding : result.findings) {
    if (!IsIn(numbers, finding)) fresh.push_back(finding);
  }
  Note(fresh, session);
  session->not_checked = result.not_asked.size();
  if (!result.not_asked.empty()) {
    session->notices.push_back(
        "not tested, as checks take a quarter of the fit's time at most: " +
        Names(result.not_asked) + "; sysid_check tests all");
  }
  return before;
}

CheckResult CheckSession(Session* session) {
  const CheckInput input = InputOf(*session);
  const std::vector<Finding> numbers = CheckNumbers(input);
  CheckResult result;
  try {
    result = CheckData(input, numbers, std::numeric_limits<double>::infinity());
  } catch (const Cancelled&) {
    result.findings = numbers;
    std::set<DataFault> kinds;
    for (const DataHypothesis& hypothesis : AllHypotheses(input)) {
      kinds.insert(hypothesis.fault);
    }
    session->not_checked = kinds.size();
    session->notices.push_back("out of time: the numbers alone were checked");
  }
  session->findings = result.findings;
  session->checked = true;
  Note(session->findings, session);
  return result;
}

std::string CheckedLine(const Session& session) {
  if (!session.checked) return "";
  const size_t runs = session.run_names.size();
  const std::string count =
      std::to_string(runs) + (runs == 1 ? " run" : " runs");
  const size_t found = session.findings.size();
  std::string text = "  checked: ";
  if (!session.undone.empty()) {
    std::vector<std::string> undone;
    for (const UndoneFault& fault : session.undone) {
      undone.push_back(fault.hypothesis + " (" + fault.where + ") with " +
                       fault.text);
    }
    text += "undone: " + Join(undone, "; ");
    if (found > undone.size()) {
      text += "; " + std::to_string(found - undone.size()) + " more";
    }
  } else if (found == 0) {
    text += "nothing wrong with " + count;
  } else {
    text += std::to_string(found) + (found == 1 ? " finding" : " findings") +
            " in " + count + ", first " + session.findings.front().fault;
  }
  if (session.not_checked > 0) {
    text += "; " + std::to_string(session.not_checked) +
            (session.not_checked == 1 ? " kind" : " kinds") +
            " of fault not tested";
  }
  return text + "\n";
}

}  // namespace sysid
