#pragma once

#include "models/model.h"
#include "models/urdf/load_urdf.h"

namespace sysid {

// Two links that swing in the vertical plane between stops.
inline constexpr char kArmWithLimits[] = R"(<robot name="arm">
<link name="base"/>
<joint name="shoulder" type="revolute"><parent link="base"/>
<child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-1.2" upper="1.0" effort="15" velocity="4"/></joint>
<link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="2"/>
<inertia ixx="0.03" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.002"/>
</inertial></link>
<joint name="elbow" type="revolute"><origin xyz="0 0 -0.4"/>
<parent link="upper"/><child link="fore"/><axis xyz="0 1 0"/>
<limit lower="0.1" upper="2.2" effort="8" velocity="6"/></joint>
<link name="fore"><inertial><origin xyz="0 0 -0.15"/><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.001"/>
</inertial></link></robot>)";

inline Model ArmWithLimits() {
  return MakeModel(LoadUrdfText(kArmWithLimits, "arm.urdf"), Catalogue());
}

}  // namespace sysid
