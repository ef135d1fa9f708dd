#pragma once

#include <optional>
#include <vector>

#include "models/parameters.h"

namespace sysid {

// A parameter that a fit moves: from where, within what, and what is believed
// of it beforehand. Values in the parameter's unit; initial within the bounds.
struct FreeParameter {
  Parameter parameter;
  double initial = 0.0;
  double lower = 0.0, upper = 0.0;  // +-infinity where none
  struct Prior {
    double mean;
    double std;  // > 0
  };
  std::optional<Prior> prior;
};

}  // namespace sysid
