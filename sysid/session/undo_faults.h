#pragma once

#include "models/effects/catalogue.h"
#include "sysid/session/fit_request.h"
#include "sysid/session/session.h"

namespace sysid {

// Checks the recordings of a session before anything is concluded from them
// (CheckSession), and undoes what is wrong where a flag can: the session is
// opened again as the request with that flag would be, one fault after the
// other. What effects of the catalogue say as well, a delay or a gain of
// an effort, is left to the search. What was undone comes first in the
// findings, is in Session::undone, and is a notice. Recordings in memory are
// read by no flag: what is wrong with them is a finding.
void UndoFaults(FitRequest request, const Catalogue& catalogue,
                Session* session);

}  // namespace sysid
