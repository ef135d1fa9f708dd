#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "models/mechanism.h"

struct mjModel_;
struct mjData_;

namespace sysid {

// MuJoCo's model of MJCF text; CHECKs the text. mj_deleteModel frees it.
mjModel_* LoadMjcf(const std::string& text);

// Debian's MuJoCo as an engine that is not ours: the mechanism's accelerations
// and more, in our conventions and our numbering. MuJoCo agrees with us about
// the axes of a ball joint's velocity (the child's), and keeps quaternions as
// w, x, y, z.
class MujocoModel {
 public:
  MujocoModel(const Mechanism& mechanism, const std::vector<double>& armature);
  ~MujocoModel();

  // Runs mj_forward.
  void Forward(const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
               const Eigen::VectorXd& tau);

  // After Forward:
  Eigen::VectorXd Acceleration() const;  // qdd
  Eigen::VectorXd Bias() const;          // Coriolis, centrifugal, gravity
  Eigen::MatrixXd MassMatrix() const;
  Eigen::Vector3d LinkPosition(int link) const;

 private:
  Eigen::VectorXd FromMujoco(const double* v) const;

  const Mechanism mechanism_;
  mjModel_* model_ = nullptr;
  mjData_* data_ = nullptr;
  std::vector<int> q_address_, v_address_;  // per joint of ours, in MuJoCo's
  std::vector<int> dof_;                    // per velocity of ours
  std::vector<int> body_;                   // per link
};

}  // namespace sysid
