#include "sysid/api/diagnose.h"

#include <algorithm>
#include <utility>

#include "sysid/diagnosis/first_sets.h"
#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/clock.h"
#include "sysid/estimation/time_limit.h"
#include "sysid/session/check_session.h"
#include "sysid/session/gather_notices.h"
#include "sysid/session/session_options.h"
#include "sysid/session/shared_runs.h"
#include "sysid/session/undo_faults.h"

namespace sysid {
namespace {

// Of the time for all work: the rest is for the last fit and the experiment.
constexpr double kShareOfSearch = 0.75;
// That the checks of the data take at most before it.
constexpr double kShareOfChecks = 0.25;
// Of a diagnosis that may add effects: what takes longer nobody waits for.
constexpr double kLongestAuto = 300.0;  // s

// The last fit, as far as it came; none where that is nowhere.
std::optional<FinalFit> FitFinalUnlessStopped(DiagnoseResult* result) {
  std::optional<FinalFit> final;
  try {
    final = FitFinal(result->session, result->problem, result->diagnosis);
    if (final->fit.converged ||
        !result->session.options.stop.stop_requested()) {
      return final;
    }
  } catch (const Cancelled&) {
  }
  result->diagnosis.interrupted = "fitting whole runs, the last step";
  return final;
}

std::optional<NextExperiment> ChooseExperimentUnlessStopped(
    const Catalogue& catalogue, DiagnoseResult* result) {
  try {
    return ChooseExperiment(catalogue, result->session, result->problem,
                            result->diagnosis);
  } catch (const Cancelled&) {
    result->diagnosis.interrupted = "choosing the next experiment";
    return std::nullopt;
  }
}

// Says who stopped what was being done, and that not all was judged. What the
// search judged stands where only what follows it ran out of time.
void SayStopped(const DiagnoseRequest& request, bool search_ended,
                Diagnosis* diagnosis) {
  if (diagnosis->interrupted.empty()) return;
  const bool asked = request.callbacks.stop.stop_requested();
  diagnosis->stopped_by = asked ? StoppedBy::kUser : StoppedBy::kTime;
  const std::string how = asked ? "interrupted" : OutOfTime(*request.time);
  diagnosis->doubts.insert(
      diagnosis->doubts.begin(),
      how + " while " + diagnosis->interrupted +
          (search_ended ? "" : ": the search is not complete"));
  if (search_ended && !asked) diagnosis->interrupted.clear();
}

// Whether something is left to explain: what an effect explains is no fault of
// the data.
FitOutcome WhatIsLeft(const Diagnosis& diagnosis) {
  FitOutcome outcome = OutcomeOf(diagnosis.base.fit, *diagnosis.base.problem);
  outcome.error = std::min(outcome.error, diagnosis.last().train_error());
  for (const CandidateEffect& candidate : diagnosis.candidates) {
    if (!candidate.confirmed || !candidate.confirmed->accepted) continue;
    outcome.error = std::min(outcome.error, candidate.confirmed->train);
  }
  return outcome;
}

// Checks the data before anything is concluded from it, within a part of the
// time; whether it is read otherwise then.
bool UndoFaultsFor(const DiagnoseRequest& request, const Catalogue& catalogue,
                   double duration, Session* session) {
  const std::stop_token stop = session->options.stop;
  const TimeLimit checks(stop, kShareOfChecks * duration);
  session->options.stop = checks.stop();
  UndoFaults(request, catalogue, session);
  session->options.stop = stop;
  return !session->undone.empty();
}

}  // namespace

DiagnoseResult Diagnose(DiagnoseRequest request, const Catalogue& catalogue) {
  const double start_s = Now();
  if (request.add_found && !request.time) request.time = kLongestAuto;
  const double duration = kShareOfWork * DurationOf(request);
  const TimeLimit limit(request.callbacks.stop, duration);
  const TimeLimit search(limit.stop(), kShareOfSearch * duration);
  request.may_free_nothing = true;
  request.assumes_inertia = true;
  DiagnoseResult result(OpenSession(request, catalogue));
  Session* const session = &result.session;
  session->options.keep_best = true;
  session->options.stop = limit.stop();
  session->options.progress = request.callbacks.progress;
  std::vector<std::shared_ptr<const Effect>> candidates;
  const auto open = [&] {
    candidates = ChooseCandidates(catalogue, *session, request.candidates,
                                  "--candidates");
    std::vector<std::string> notices;
    result.problem = OpenDiagnosis(*session, &notices);
    AddNewNotices(notices, &session->notices);
    result.problem.options.stop = search.stop();
  };
  open();
  const Processes& all =
      request.started_with != nullptr ? *request.started_with : Alone();
  CheckSessionNumbers(session);
  DoAlike(all, [&] {
    if (request.callbacks.ready) request.callbacks.ready(*session);
  });
  result.notices_when_ready = session->notices.size();
  if (all.rank() > 0) {
    result.is_elsewhere = true;
    return result;
  }
  DiagnosisOptions options;
  options.add = request.add_found;
  if (request.add_found) {
    EquationLook look = LookAtEquations(result.problem, candidates);
    // Of an arm they judge the efforts too.
    if (!look.is_arm && UndoFaultsFor(request, catalogue, duration, session)) {
      open();
      look = LookAtEquations(result.problem, candidates);
    }
    options.look = std::make_shared<const EquationLook>(std::move(look));
  }
  request.runs.clear();
  request.holdout_runs.clear();
  options.keep_evaluated = true;
  options.judges_until = limit.stop();
  result.diagnosis = Diagnose(result.problem, candidates, options);
  result.diagnosis.narrowed = !request.candidates.empty();
  Diagnosis* const diagnosis = &result.diagnosis;
  const bool search_ended = diagnosis->interrupted.empty();
  // Out of time, what the search had found is fitted all the same.
  if ((request.add_found || request.fit_whole_runs) &&
      !request.callbacks.stop.stop_requested()) {
    result.final = FitFinalUnlessStopped(&result);
  }
  if (diagnosis->interrupted.empty()) {
    result.experiment = ChooseExperimentUnlessStopped(catalogue, &result);
  }
  SayStopped(request, search_ended, diagnosis);
  if (!request.add_found || result.diagnosis.by_equations) {
    CheckSessionData(session, WhatIsLeft(result.diagnosis));
  }
  if (result.final) {
    result.final->session.findings = session->findings;
    // All that passed, the search and the checks too.
    result.final->fit.wall_time_s = Now() - start_s;
    result.final->fit.cpu_time_s = CpuSeconds();
    if (request.started_with != nullptr)
      result.final->fit.processes = all.size();
  }
  result.next = ChooseNext(*session, result.diagnosis);
  return result;
}

}  // namespace sysid
