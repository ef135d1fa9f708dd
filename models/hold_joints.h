#pragma once

#include <map>

#include "models/mechanism.h"

namespace sysid {

// Joints held still. A joint that is held is a fixed one before the model is
// made: what it carries is one body with what carries it, and costs nothing.
// Held at position q,
//
//   R_PC = R_PJ Exp(S q) of a hinge,   p_PC = p_PJ + R_PJ S q of a slide,
//
// while p_PJ stays the parameter that it was. A ball is held at the identity.
// What follows a joint that is held (<mimic>) is held where that puts it.

// The mechanism with joints held at positions (index -> rad or m), and with
// them the mimics that follow them and have no position here.
Mechanism HoldJoints(const Mechanism& mechanism,
                     const std::map<int, double>& positions);

}  // namespace sysid
