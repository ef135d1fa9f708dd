#pragma once

#include <string>

#include "sysid/checks/check.h"
#include "sysid/estimation/fit.h"
#include "sysid/session/session.h"

namespace sysid {

// The session as the checks see it; points into it.
CheckInput InputOf(const Session& session);

// Runs the checks of the numbers on a session's model, runs and held-out runs,
// unless Session::check says none, and keeps what they find; each is a notice
// too. Where efforts were not measured the fit may take few iterations.
void CheckSessionNumbers(Session* session);

// What a fit of the session left and took: whether hypotheses about the data
// are asked, and for how much work.
struct FitOutcome {
  double error = 0.0;  // normalised
  bool converged = true;
  double work = 0.0;  // EstimationWork
};
FitOutcome OutcomeOf(const Fit& fit, const ShootingProblem& problem);

// With CheckLevel::kAll, where that fit misses the data (kExplained) or did not
// converge, tests
// hypotheses about the data within a part of its work, and adds what they
// explain to what the numbers showed; each is a notice too, and what was not
// asked another. The number of notices from before.
size_t CheckSessionData(Session* session, const FitOutcome& outcome);

// Both, without a fit and without a limit of work.
CheckResult CheckSession(Session* session);

// For reports: "  checked: nothing wrong with 2 runs", or how much was found;
// nothing where nobody checked.
std::string CheckedLine(const Session& session);

}  // namespace sysid
