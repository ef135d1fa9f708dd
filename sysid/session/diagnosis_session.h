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

// The candidates by name ("coulomb_friction@joint1", or a kind for all its
// targets) or pattern of either; where `names` is empty all of the catalogue's,
// those of a drive only where an effort was measured. Throws InputError at
// `place`.
std::vector<std::shared_ptr<const Effect>> ChooseCandidates(
    const Catalogue& catalogue, const Session& session,
    const std::vector<std::string>& names, const std::string& place);

// What effects do to a fit that a user adds to a model by name: the errors
// before and after, of segments each from its own initial state (0: no held-out
// runs); predicted of one effect only.
struct AddedEffects : DiagnosisStep {
  // Where the effects' parameters ended, by name; whole numbers too.
  std::map<std::string, double> found;
};

// Fits the model of a session without the effects that --add put into it, and
// with them; with more than kMostEffectsBySegments only evaluates both, at the
// values of the equations of motion. Nothing where there are none, or where
// they have whole numbers that the user gave.
std::optional<AddedEffects> TryAddedEffects(const Catalogue& catalogue,
                                            const Session& session);

// The session whose effects start where that ended, unless a start was given,
// with whole numbers as found.
Session StartedFrom(const AddedEffects& added, Session session);

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
