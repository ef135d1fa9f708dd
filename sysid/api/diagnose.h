#pragma once

#include <memory>
#include <optional>

#include "models/effects/catalogue.h"
#include "sysid/api/callbacks.h"
#include "sysid/api/next_step.h"
#include "sysid/diagnosis/diagnose.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/next_experiment.h"
#include "sysid/session/session.h"

namespace sysid {

// Says where a model fails and which effect is missing: all that sysid_diagnose
// does but read flags and render. FitRequest::candidates are the effects to
// consider. Of the solvers it has lm.
struct DiagnoseRequest : FitRequest {
  // Adds the best effect, refits, and looks again, until nothing is missing;
  // for 300 s at most where FitRequest::time does not say how long.
  bool add_found = false;
  // Fits the model that it ends with to whole runs. With `add_found` always.
  bool fit_whole_runs = false;
  // That started the program together: the first of them diagnoses, the others
  // have nothing to do. (FitRequest::processes stays null.)
  std::shared_ptr<const Processes> started_with = nullptr;
  Callbacks callbacks = {};
};

// What text, JSON and page are made of (sysid/report/diagnosis_report.h,
// page_data.h).
struct DiagnoseResult {
  // As it was opened, with all notices, and the findings of the checks.
  Session session;
  // How many of the notices there were when Callbacks::ready was called.
  size_t notices_when_ready = 0;
  DiagnosisProblem problem;
  Diagnosis diagnosis;
  std::optional<FinalFit> final;  // where asked for, and not interrupted before
  // That would decide between rivals, where there are any.
  std::optional<NextExperiment> experiment;
  NextStep next;
  // Whether another process has the result.
  bool is_elsewhere = false;

  explicit DiagnoseResult(const Session& s)
      : session(s), problem(s.model), diagnosis(s.model) {}
};

// Throws InputError for what is wrong with the request or what it names, at the
// flag, file or line, and for runs that are too short or too still to decide
// anything; Cancelled where it was stopped before the model as given was
// judged. Diagnosis::interrupted says where it was stopped later, `usable`
// whether the model could be fitted at all. Never prints.
DiagnoseResult Diagnose(DiagnoseRequest request,
                        const Catalogue& catalogue = Catalogue());

}  // namespace sysid
