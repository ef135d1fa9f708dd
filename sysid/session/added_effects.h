#pragma once

#include <map>
#include <optional>
#include <string>

#include "sysid/diagnosis/diagnose.h"
#include "sysid/session/session.h"

namespace sysid {

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

}  // namespace sysid
