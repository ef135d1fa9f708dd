#pragma once

#include <string>
#include <utility>
#include <vector>

#include "models/model.h"

namespace sysid {

// An effect that is in the recorded mechanism and not in the model: its name
// ("coulomb_friction@joint1") and the values of its parameters by their names.
struct PlantedEffect {
  std::string name;
  std::vector<std::pair<std::string, double>> values;

  std::string kind() const;
  std::string target() const;
  // The value of the first parameter whose name ends in ".<ending>" (or is it);
  // CHECKs that there is one.
  double Get(const std::string& ending) const;
};

// The effect with one number for its size: its first parameter, or what the
// nominal value is wrong by (mass: as a part of it; com: m; inertia: kg m^2
// about every axis); of a limit its inverse; of the coupling of two joints the
// friction. Its other parameters are chosen to be plausible.
PlantedEffect PlantEffect(const Model& truth, const std::string& name,
                          double magnitude);

// Sizes between which a plausible effect lies, and one to begin at.
struct MagnitudeRange {
  double start, most;
};
MagnitudeRange RangeOf(const std::string& kind);

// The true model with the effects in it, as sysid_simulate has them.
Model WithEffects(const Model& truth,
                  const std::vector<PlantedEffect>& planted);

}  // namespace sysid
