#pragma once

#include <string>
#include <vector>

#include "sysid/exports/write_mjcf.h"

namespace sysid {

// SDFormat 1.9 (Gazebo, Drake) of the model at its nominal values: one <model>,
// whose root link is fixed to the world. Each link has the frame of the joint
// that carries it, as in URDF: its pose is relative to its parent link, the
// joint's is the identity, and axes are in it.
//
// <dynamics> has damping, friction, spring_stiffness and spring_reference;
// rotors are drake:rotor_inertia with drake:gear_ratio 1; joints that follow
// others are <mimic> and drake:mimic.
ExportText WriteSdf(const Model& model, const ExportData& data,
                    const std::vector<std::string>& comments);

}  // namespace sysid
