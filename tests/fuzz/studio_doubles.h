#pragma once

#include "sysid/studio/studio_model.h"

namespace sysid {

// A live session whose fits take no time. studio_doubles.cc stands for what the
// studio calls of the estimators and reports (the physics on Jets takes minutes
// to compile and is no reader); the session itself, its folder and its server
// are those that users have.
StudioSetup FuzzStudioSetup(const std::string& folder);

// A model of such a session.
StudioModel FuzzStudioModel(const StudioChange& change, int id);

// The folder of this process for what a session saves; memory, not a disk,
// where there is /dev/shm.
std::string FuzzFolder();

}  // namespace sysid
