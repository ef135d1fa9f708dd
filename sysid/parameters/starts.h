#pragma once

#include <string>
#include <vector>

#include "models/model.h"
#include "sysid/parameters/free_parameter.h"

namespace sysid {

// Where a fit starts of which the model's own values are no start: inertias
// that no body has, and joints that move nothing with inertia.

// Gives every link of which a rotational inertia among `names` is free, and
// CanStart refuses the nominal one, its StartingInertia; a notice for all of
// one kind; every negative mass among them its size; and a mass of zero, where
// the inertia is free too, StartingMass. Links of which an entry is among
// `held` stay as they are.
void StartPossible(const std::vector<std::string>& names,
                   const std::vector<std::string>& held, Model* model,
                   std::vector<std::string>* notices);

// Moves what starts at zero, and is free, to a plausible size where a joint
// would move no inertia otherwise: its rotor, the masses of the links that move
// with it. `given[i]` are starts that a user gave, which stay. The model at all
// starts is returned, a notice says what was moved.
Model StartRegular(const Model& model, const std::vector<bool>& given,
                   std::vector<FreeParameter>* free,
                   std::vector<std::string>* notices);

// Gives every link without inertia that leaves a joint nothing to move, at the
// starts of what is free, its StartingInertia (and StartingMass); a notice
// names them. `assumed` are the values, as --fix takes them. Returns the model
// at the starts.
Model AssumeInertia(const std::vector<FreeParameter>& free, Model* model,
                    std::vector<std::string>* assumed,
                    std::vector<std::string>* notices);

}  // namespace sysid
