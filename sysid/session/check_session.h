#pragma once

#include <string>

#include "sysid/checks/check.h"
#include "sysid/session/session.h"

namespace sysid {

// The session as the checks see it; points into it.
CheckInput InputOf(const Session& session);

// Runs every check on a session's model, runs and held-out runs, and keeps what
// they find.
void CheckSession(Session* session);

// "checked: nothing wrong with 2 runs", or a line for each finding.
std::vector<std::string> CheckedLines(const Session& session);

}  // namespace sysid
