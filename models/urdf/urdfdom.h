#pragma once

#include <urdf_model/model.h>
#include <urdf_world/types.h>

#include <string>

#include "models/urdf/urdf_outline.h"

namespace sysid {

// The outline as urdfdom understands it: URDF text with checked numbers and
// nothing that the dynamics do not use. Spherical joints, unknown to urdfdom,
// are called floating there; revolute and prismatic joints get the limits that
// urdfdom insists on.
std::string TextForUrdfdom(const UrdfOutline& outline);

// urdfdom's model of it, with urdfdom's own messages off the console; throws
// InputError with these where it refuses.
urdf::ModelInterfaceSharedPtr ParseWithUrdfdom(const std::string& text,
                                               const std::string& path);

}  // namespace sysid
