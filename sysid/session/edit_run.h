#pragma once

#include <string>
#include <vector>

#include "residuals/run.h"
#include "sysid/session/session.h"

namespace sysid {

// A run that was read as the session's shifts and ignored spans make it, the
// turns of sensors that wrap counted on. Throws InputError as ApplyEdits and
// DropUnmeasured do.
void EditRun(const Session& session, Run* run,
             std::vector<std::string>* notices);

}  // namespace sysid
