#pragma once

#include <string>

#include "sysid/checks/check.h"
#include "sysid/session/session.h"

namespace sysid {

// The session as the checks see it; points into it.
CheckInput InputOf(const Session& session);

// Runs every check on a session's model, runs and held-out runs, and keeps what
// they find; each is a notice too. Returns the error of the quick fit
// (run_checks.h).
double CheckSession(Session* session);

// For reports: "  checked: nothing wrong with 2 runs", or how much was found;
// nothing where nobody checked.
std::string CheckedLine(const Session& session);

}  // namespace sysid
