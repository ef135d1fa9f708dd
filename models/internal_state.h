#pragma once

#include "models/workspace.h"

namespace sysid {

// Internal states of a model's effects: z of its state (StateLayout).
// docs/theory.md section 3 says how a step moves it.

// Sets z of a state x to where it starts: of whom nothing is known but q, qd
// and what is held.
void StartStates(Workspace<double>* ws, const double* held, double* x);

// Sets of z at x what the way of the joints since the state `before` says
// (Effect's MoveState).
void MoveStates(Workspace<double>* ws, const double* before, double* x);

// A state of the model `from` as one of `to`, which has other effects on the
// same mechanism: internal states of one name are kept, the rest starts.
Eigen::VectorXd AdoptState(const Model& from, const double* x, const Model& to);

// Whether they have the same states, so that AdoptState changes nothing.
bool SameStates(const Model& a, const Model& b);

}  // namespace sysid
