#pragma once

#include <string>
#include <vector>

#include "models/workspace.h"

namespace sysid {

// Rigid-body dynamics of a Model in world axes, after Featherstone, "Rigid Body
// Dynamics Algorithms", 2008, written with classical accelerations of body
// origins (docs/theory.md section 2 derives the equations that the code cites).
// T is a scalar of models/scalars.h. Pointers are to nq (q) and nv (qd, qdd,
// tau) numbers. `held` is what acts from outside, Model::held_size() numbers:
// the efforts of the drives, to which the effects of the model add theirs, and
// the inputs that effects read. It must outlive the next call. Joints that
// follow others have no numbers of their own: all this is in the coordinates of
// the state, (2.28).

// qdd by the articulated-body algorithm (ABA), of a model with followers by
// (2.28). False where a joint-space inertia is not positive (SingularJoints
// names the joint) or a number is not finite.
template <typename T>
[[nodiscard]] bool ForwardDynamics(Workspace<T>* ws, const T* q, const T* qd,
                                   const T* held, T* qdd);

// tau by the recursive Newton-Euler algorithm (RNEA): the effort of the drives
// that gives qdd, so ForwardDynamics(InverseDynamics(qdd)) = qdd. What effects
// read of `held` is as it stands there; null: zeros.
template <typename T>
void InverseDynamics(Workspace<T>* ws, const T* q, const T* qd, const T* qdd,
                     const T* held, T* tau);
template <typename T>
void InverseDynamics(Workspace<T>* ws, const T* q, const T* qd, const T* qdd,
                     T* tau) {
  InverseDynamics<T>(ws, q, qd, qdd, nullptr, tau);
}

// The joint-space inertia M(q), nv x nv, by the composite-rigid-body algorithm
// (CRBA); the armature of effects is on its diagonal.
template <typename T>
void MassMatrix(Workspace<T>* ws, const T* q, MatrixX<T>* M);

// Sets R_WB and p_WB of every body.
template <typename T>
void ForwardKinematics(Workspace<T>* ws, const T* q);

// Position of a link's origin in the world, after ForwardKinematics.
template <typename T>
Vector3<T> LinkPosition(const Workspace<T>& ws, int link);

// Kinetic and potential energy, J (potential: 0 with every body at the world's
// origin).
double KineticEnergy(Workspace<double>* ws, const double* q, const double* qd);
double PotentialEnergy(Workspace<double>* ws, const double* q);

// A joint about whose axis nothing that it carries has inertia, so that its
// acceleration is undefined, or has less than none (which takes values that no
// body has). Only where there is none of them is M(q) positive definite.
struct SingularJoint {
  int joint;
  std::string text;  // "joint 'elbow': link 'hand' and what it carries ..."
};

// Empty where the model can move, judged at one configuration without
// alignment. The tips come first; where one is singular, the others are judged
// as if it were held still.
std::vector<SingularJoint> SingularJoints(const Model& model);

// Their texts.
std::vector<std::string> TextsOf(const std::vector<SingularJoint>& joints);

}  // namespace sysid
