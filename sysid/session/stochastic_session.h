#pragma once

#include "sysid/session/session.h"
#include "sysid/stochastic/stochastic_fit.h"

namespace sysid {

// What Adam and the mixture need of a session.

// Notes starts that Adam and the mixture move away from their bounds.
void NoteMovedStarts(Session* session);

// Throws InputError where this machine has no memory for such a mixture.
void CheckMixtureSize(const Session& session, const MixtureOptions& options);

}  // namespace sysid
