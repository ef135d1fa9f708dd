#pragma once

#include <memory>
#include <optional>
#include <string>

#include "models/effects/catalogue.h"
#include "sysid/api/callbacks.h"
#include "sysid/estimation/holdout.h"
#include "sysid/session/added_effects.h"
#include "sysid/session/checkpoint.h"
#include "sysid/session/session.h"
#include "sysid/stochastic/solvers.h"

namespace sysid {

// Fits a model's free parameters to recordings: all that sysid_fit does but
// read flags and render. In the simplest case
//
//   IdentifyRequest request;
//   request.model = "pendulum3";
//   request.traj = {"data/runs/pendulum3.csv"};
//   const IdentifyResult result = Identify(request);
//
// Models and recordings may be in memory, too (fit_request.h).
struct IdentifyRequest : FitRequest {
  // How adam and gmm descend.
  AdamFitOptions adam = {};
  MixtureOptions mixture = {};
  // File that keeps the stages of a fit by lm as they end; empty: none does.
  // With `resume` the fit goes on with those that are in it.
  std::string checkpoint = {};
  bool resume = false;
  Callbacks callbacks = {};
};

// What text, JSON, page and files are made of (sysid/report/fit_report.h,
// page_data.h). fit().model is the model with the estimates in it.
struct IdentifyResult {
  // As it was opened, with all notices, and the findings of the checks.
  Session session;
  // How many of the notices there were when Callbacks::ready was called.
  size_t notices_when_ready = 0;
  std::shared_ptr<const ShootingProblem> problem;
  // The fit and, of gmm, the mixture. Whether it converged is Fit::converged.
  Solved solved;
  std::optional<Holdout> holdout;     // where there are runs to predict
  std::optional<AddedEffects> added;  // what those of --add did, where tried
  // Null: none was kept. To be removed (Checkpoint::Remove) once the results
  // are where they should be.
  std::shared_ptr<const Checkpoint> checkpoint;

  const Fit& fit() const { return solved.fit; }
  // A fit that ran out of time is an answer where stages of it ended before.
  bool IsAnswer() const {
    return fit().converged ||
           (fit().stopped_by == StoppedBy::kTime && fit().stages > 0);
  }
};

// Throws InputError for what is wrong with the request or what it names, at the
// flag, file or line; Cancelled where it was stopped before there was a point.
// Never prints. `catalogue` has the effects that there are.
IdentifyResult Identify(IdentifyRequest request,
                        const Catalogue& catalogue = Catalogue());

}  // namespace sysid
