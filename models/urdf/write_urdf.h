#pragma once

#include <string>
#include <vector>

#include "models/model.h"

namespace sysid {

// A URDF of the model at its nominal values, which LoadUrdf reads back to the
// same numbers (R_PJ, which a URDF holds as roll, pitch and yaw, to 1e-15).
//
// viscous_damping and coulomb_friction become <dynamics damping friction>.
// What a URDF cannot say, the other effects and a gravity other than 9.81, is
// left as comments for the reader, one per parameter:
//
//   <!-- sysid: effort_bias@joint1 joint1.effort_bias=-3.2 N -->
//
// LoadUrdf does not read them back. Spherical joints are type="spherical".
// Visual and collision elements, materials and the extensions of others are not
// kept: the Mechanism never had them. `comments` come first, one per line.
std::string WriteUrdf(const Model& model,
                      const std::vector<std::string>& comments = {});

}  // namespace sysid
