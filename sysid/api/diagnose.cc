#include "sysid/api/diagnose.h"

#include <algorithm>
#include <utility>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/clock.h"
#include "sysid/session/check_session.h"
#include "sysid/session/shared_runs.h"

namespace sysid {
namespace {

// The last fit, as far as it came; none where that is nowhere.
std::optional<FinalFit> FitFinalUnlessInterrupted(DiagnoseResult* result) {
  std::optional<FinalFit> final;
  try {
    final = FitFinal(result->session, result->problem, result->diagnosis);
    if (final->fit.converged ||
        !result->session.options.stop.stop_requested()) {
      return final;
    }
  } catch (const Cancelled&) {
  }
  Diagnosis* const diagnosis = &result->diagnosis;
  diagnosis->interrupted = "fitting whole runs, the last step";
  diagnosis->doubts.push_back("interrupted while " + diagnosis->interrupted);
  return final;
}

std::optional<NextExperiment> ChooseExperimentUnlessInterrupted(
    const Catalogue& catalogue, DiagnoseResult* result) {
  try {
    return ChooseExperiment(catalogue, result->session, result->problem,
                            result->diagnosis);
  } catch (const Cancelled&) {
    result->diagnosis.interrupted = "choosing the next experiment";
    return std::nullopt;
  }
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

}  // namespace

DiagnoseResult Diagnose(DiagnoseRequest request, const Catalogue& catalogue) {
  const double start_s = Now();
  request.may_free_nothing = true;
  request.assumes_inertia = true;
  DiagnoseResult result(OpenSession(request, catalogue));
  request.runs.clear();
  request.holdout_runs.clear();
  Session* const session = &result.session;
  const auto candidates =
      ChooseCandidates(catalogue, *session, request.candidates, "--candidates");
  result.problem = OpenDiagnosis(*session, &session->notices);
  const Processes& all =
      request.started_with != nullptr ? *request.started_with : Alone();
  session->options.keep_best = true;
  session->options.stop = result.problem.options.stop = request.callbacks.stop;
  session->options.progress = result.problem.options.progress =
      request.callbacks.progress;
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
  options.keep_evaluated = true;
  result.diagnosis = Diagnose(result.problem, candidates, options);
  result.diagnosis.narrowed = !request.candidates.empty();
  if ((request.add_found || request.fit_whole_runs) &&
      result.diagnosis.interrupted.empty()) {
    result.final = FitFinalUnlessInterrupted(&result);
  }
  if (result.diagnosis.interrupted.empty()) {
    result.experiment = ChooseExperimentUnlessInterrupted(catalogue, &result);
  }
  CheckSessionData(session, WhatIsLeft(result.diagnosis));
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
