#pragma once

#include <set>
#include <string>
#include <vector>

#include "sysid/session/session.h"

namespace sysid {

// What is free, what is held and which effects there are: flags, then
// specification.
struct FreeChoice {
  Model model;  // with the effects, and the values that are fixed
  std::vector<FreeParameter> free;
  std::vector<std::string> fixed;  // names
  // What --add put into the model, and what that freed, by name.
  std::vector<std::string> added;
  std::set<std::string> freed_by_added;

  explicit FreeChoice(const Model& m) : model(m) {}
};

// Throws InputError at the flag or the line of the specification that is wrong:
// parameters and effects that there are not, values and bounds that cannot be,
// nothing free where something must be; at `file`, which the model is of, where
// that leaves a joint without inertia. A notice for each effect that takes the
// place of another, and for what of an effect the motion does not depend on.
FreeChoice ChooseFree(const FitRequest& request, const FitSpecification& spec,
                      const Catalogue& catalogue, const Model& nominal,
                      const std::string& file,
                      std::vector<std::string>* notices);

// Throws InputError at `place` where a parameter of the model cannot have the
// value: outside its physical bounds, or no whole number where it must be one.
void CheckValue(const Model& model, const Parameter& parameter, double value,
                const std::string& place);

}  // namespace sysid
