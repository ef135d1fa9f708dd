#pragma once

#include <string>
#include <vector>

#include "sysid/session/session.h"

namespace sysid {

// Decides by flags, then specification, which effects there are, what is free
// and what is held; `session` has the model as its file has it, and gets all of
// that. Throws InputError at the flag or the line of the specification that is
// wrong: parameters and effects that there are not, values and bounds that
// cannot be, nothing free where something must be; at the model's file where
// that leaves a joint without inertia. A notice for each effect that takes the
// place of another, and for what of an effect the motion does not depend on.
void ChooseFree(const FitRequest& request, const FitSpecification& spec,
                const Catalogue& catalogue, Session* session);

// Throws InputError at `place` where a parameter of the model cannot have the
// value: outside its physical bounds, or no whole number where it must be one.
void CheckValue(const Model& model, const Parameter& parameter, double value,
                const std::string& place);

// Gives parameters of the model the values that are there, all at once; what
// makes them no possible body, empty where they are one. Throws InputError at
// the place of a name that there is not, or of a value that it cannot have.
std::string SetValues(const std::vector<NamedValue>& values, Model* model);

// Throws InputError at `place` where a joint of the model moves no inertia.
void CheckJoints(const Model& model, const std::string& place);

}  // namespace sysid
