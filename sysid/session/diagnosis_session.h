#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sysid/diagnosis/diagnose.h"
#include "sysid/session/session.h"

namespace sysid {

// What a diagnosis of a session starts from. Where the session has no held-out
// runs, the last quarter of every run is held out, with a notice. Throws
// InputError for runs that are too short or too still to decide anything, with
// what they lack.
DiagnosisProblem OpenDiagnosis(const Session& session,
                               std::vector<std::string>* notices);

// Thins the runs of a problem that have many samples; by how much. The noise is
// that of all samples: of fewer it is harder to tell.
int ThinForSearch(DiagnosisProblem* problem);

// The candidates by name ("coulomb_friction@joint1", or a kind for all its
// targets) or pattern of either; where `names` is empty all of the catalogue's,
// those of a drive only where an effort was measured. Throws InputError at
// `place`.
std::vector<std::shared_ptr<const Effect>> ChooseCandidates(
    const Catalogue& catalogue, const Session& session,
    const std::vector<std::string>& names, const std::string& place);

// The model that a diagnosis ended with, fitted as sysid_fit does: one
// trajectory a run, whole runs where parts of them were held out.
struct FinalFit {
  Session session;  // with the effects, what is free, and the starting values
  std::shared_ptr<const ShootingProblem> problem;
  Fit fit;
  std::optional<Holdout> holdout;  // where there were held-out runs
};
FinalFit FitFinal(const Session& session, const DiagnosisProblem& problem,
                  const Diagnosis& diagnosis);

}  // namespace sysid
