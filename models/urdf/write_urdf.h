#pragma once

#include <string>
#include <vector>

#include "models/model.h"

namespace sysid {

enum class UrdfContent {
  // The file that the mechanism was read from with the model's numbers in it:
  // visuals, meshes, materials, transmissions, comments and the extensions of
  // others stay. Joints that are held still are what they were. Without a file
  // as kDynamics, but for those joints.
  kWhole,
  // Only what moves, held joints fixed where they are held: the model itself.
  kDynamics,
};

// A URDF of the model at its nominal values, which LoadUrdf reads back to the
// same numbers (R_PJ, which a URDF holds as roll, pitch and yaw, to 1e-15).
// Numbers that are the file's stay as they are written there.
//
// viscous_damping and coulomb_friction become <dynamics damping friction>; an
// armature of a hinge or slide is Drake's drake:rotor_inertia in the joint's
// <transmission> as well, for the drake:gear_ratio that is there (else 1).
// What a URDF cannot say, the other effects and a gravity other than 9.81, is
// left as comments for the reader, one per parameter:
//
//   <!-- sysid: effort_bias@joint1 joint1.effort_bias=-3.2 N -->
//
// LoadUrdf does not read them back. Spherical joints are type="spherical".
// `comments` come first, one each, behind "sysid: "; those of an earlier time
// that the file still holds give way.
std::string WriteUrdf(const Model& model,
                      const std::vector<std::string>& comments = {},
                      UrdfContent content = UrdfContent::kWhole);

}  // namespace sysid
