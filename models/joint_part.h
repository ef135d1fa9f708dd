#pragma once

#include "models/workspace.h"

namespace sysid {

// What of the inverse dynamics (2.15) drives and joints have of their own:
//
//   armature qdd - sum of the efforts of effects,                      (2.31)
//
// nv numbers. What the effort of the drives is beside it are the bodies'
// forces, which no such effect changes, so that derivatives by their
// parameters need no recursion. Of a model without followers.
template <typename T>
void JointPart(Workspace<T>* ws, const T* q, const T* qd, const T* qdd,
               const T* held, T* tau);

// Whether the parameters of `ws` are constants but for those that only
// JointPart and the acting efforts depend on.
template <typename T>
bool OnlyJointPartVaries(const Workspace<T>& ws);

}  // namespace sysid
