#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "models/mechanism.h"

namespace sysid {

// Kinematics by the definition of the frames and nothing else: what the fast
// ones are measured against. At the nominal values.

// q moved by dq: a spherical joint's is a rotation vector in the child's axes.
Eigen::VectorXd Moved(const Mechanism& mechanism, const Eigen::VectorXd& q,
                      const Eigen::VectorXd& dq);

// The frame of every link in the world.
std::vector<Eigen::Isometry3d> LinkPoses(const Mechanism& mechanism,
                                         const Eigen::VectorXd& q);

// The velocity of a link's centre of mass and its angular velocity, world axes,
// by Ridders' differences of the poses.
struct LinkRates {
  Eigen::Vector3d v_com;
  Eigen::Vector3d w;
};
LinkRates RatesByDifferences(const Mechanism& mechanism,
                             const Eigen::VectorXd& q,
                             const Eigen::VectorXd& qd, int link);

}  // namespace sysid
