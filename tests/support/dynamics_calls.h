#pragma once

#include <gtest/gtest.h>

#include <string>

#include "models/dynamics.h"
#include "models/stepper.h"

namespace sysid {

// The dynamics with Eigen's vectors for arguments, as tests like to write them,
// and parts of mechanisms in a line.

inline Eigen::VectorXd Forward(Workspace<double>* ws, const Eigen::VectorXd& q,
                               const Eigen::VectorXd& qd,
                               const Eigen::VectorXd& tau) {
  Eigen::VectorXd qdd(tau.size());
  EXPECT_TRUE(
      ForwardDynamics<double>(ws, q.data(), qd.data(), tau.data(), qdd.data()));
  return qdd;
}

inline Eigen::VectorXd Inverse(Workspace<double>* ws, const Eigen::VectorXd& q,
                               const Eigen::VectorXd& qd,
                               const Eigen::VectorXd& qdd) {
  Eigen::VectorXd tau(qdd.size());
  InverseDynamics<double>(ws, q.data(), qd.data(), qdd.data(), tau.data());
  return tau;
}

inline Eigen::MatrixXd Inertia(Workspace<double>* ws,
                               const Eigen::VectorXd& q) {
  Eigen::MatrixXd M;
  MassMatrix<double>(ws, q.data(), &M);
  return M;
}

// x after `steps` steps of h, what is held constant.
inline Eigen::VectorXd Roll(const Model& model, Integrator integrator,
                            Eigen::VectorXd x, const Eigen::VectorXd& held,
                            double h, int steps) {
  Workspace<double> ws(model);
  Stepper<double> stepper(integrator, &ws);
  for (int i = 0; i < steps; ++i) {
    EXPECT_TRUE(stepper.Step(h, held.data(), x.data()));
  }
  return x;
}

inline Inertial<double> Body(double mass, const Eigen::Vector3d& com,
                             const Eigen::Vector3d& moments) {
  Inertial<double> body;
  body.mass = mass;
  body.com = com;
  body.inertia = moments.asDiagonal();
  return body;
}

inline Joint MakeJoint(const std::string& name, JointType type, int parent,
                       const Eigen::Vector3d& axis) {
  Joint joint;
  joint.name = name;
  joint.type = type;
  joint.parent_link = parent;
  joint.axis = axis;
  return joint;
}

}  // namespace sysid
