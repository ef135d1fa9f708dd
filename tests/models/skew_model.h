#pragma once

#include <vector>

#include "models/parameters.h"
#include "tests/support/all_joints.h"
#include "tests/support/random_mechanism.h"

namespace sysid {

// Off-axis bodies, so that no entry is zero by chance.
inline Mechanism SkewJoints() {
  Mechanism mechanism = AllJoints();
  Random random(1);
  for (size_t i = 1; i < mechanism.links.size(); ++i) {
    if (mechanism.nominal.links[i].mass == 0) continue;
    mechanism.nominal.links[i] = RandomInertial(&random);
  }
  return mechanism;
}

inline Model SkewModel() {
  const Mechanism mechanism = SkewJoints();
  Model model(mechanism);
  const Catalogue catalogue;
  for (const char* name : {"viscous_damping@hinge", "coulomb_friction@slide",
                           "effort_bias@hinge"}) {
    model.AddEffect(catalogue.Make(name, mechanism, "test"));
  }
  return model;
}

// Every number in one row, to see what else moved.
inline Eigen::VectorXd AllNumbers(const MechanismParameters<double>& values) {
  std::vector<double> all;
  for (const Inertial<double>& link : values.links) {
    all.push_back(link.mass);
    all.insert(all.end(), link.com.begin(), link.com.end());
    all.insert(all.end(), link.inertia.data(), link.inertia.data() + 9);
  }
  for (const Eigen::Vector3d& p : values.joint_p) {
    all.insert(all.end(), p.begin(), p.end());
  }
  all.push_back(values.gravity);
  all.insert(all.end(), values.effects.begin(), values.effects.end());
  return Eigen::Map<Eigen::VectorXd>(all.data(), all.size());
}

}  // namespace sysid
