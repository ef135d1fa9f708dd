#pragma once

#include <string>

#include "models/mechanism.h"

namespace sysid {

// A URDF file as a Mechanism: topology and nominal values, SI. The root link's
// frame is the world's. Joints are in the order of the file, but parents before
// children; fixed joints stay joints (Model merges what moves as one). Inertias
// are turned into the link's axes by the rpy of their origin.
//
// Joint types: revolute, continuous, prismatic, fixed, and spherical (as
// Bullet's importer reads it: a quaternion, without an axis). <dynamics damping
// friction> and <limit> are kept in Joint; a <limit> may lack any of its four
// numbers, and revolute joints may lack the <limit>, as there are no stops in
// the dynamics. Mimic joints follow the joint that they name; of one that is
// fixed, they are held still. Visual and collision elements and the extensions
// of others (<gazebo>, <transmission>) are kept as text (Mechanism::source).
//
// A file that is a tree with a joint that moves loads: masses and inertias that
// no body has, or none at all, are taken as they stand (physical.h and
// SingularJoints in dynamics.h judge them), axes are normalised, and negative
// damping and friction are kept but make no effect.
//
// Throws InputError that lists every fault, each with line and column: not XML,
// no <robot>, names missing, used twice or with control characters, unknown or
// missing links of a joint, more than one root, loops, joint types that are
// missing, unknown or not supported (planar, floating), mimics of joints that
// there are not or of each other, numbers that are unreadable as a whole or not
// finite (a limit may be infinite), axes that are zero, misspelt elements and
// attributes, no moving joint, more than 1000 joints, a file of more than 64
// MiB.
Mechanism LoadUrdf(const std::string& path);

// The same from text; messages call the file `path`.
Mechanism LoadUrdfText(const std::string& text, const std::string& path);

}  // namespace sysid
