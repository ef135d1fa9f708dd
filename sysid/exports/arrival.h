#pragma once

#include <string>
#include <vector>

#include "models/model.h"

namespace sysid {

// What becomes of a fitted model in the formats of simulators: which parameter
// arrives where, and what a format cannot say.

enum class ExportFormat { kUrdf, kMjcf, kSdf };
std::string ToString(ExportFormat format);  // "MJCF"

enum class Arrival {
  kArrived,  // the same law, the same number
  kPartly,   // a law near it, or a part of it: the remark says which
  kLost,
};

// One parameter in one format.
struct ArrivalRow {
  std::string name, effect, unit;  // "joint1.friction"; the effect may be none
  double value = 0.0;              // SI
  Arrival arrival = Arrival::kLost;
  std::string where;   // "joint 'joint1' frictionloss"; none of what is lost
  std::string remark;  // what is lost, and what to do; what is to be known
};

// What a format makes of the parameters of an effect, by its kind
// ("coulomb_friction"): of that whose name ends in `suffix`, else (none) of all
// others. {J} in texts is the target.
struct ArrivalRule {
  const char* kind;
  const char* suffix;
  Arrival arrival;
  const char* where;
  const char* remark;
};

// The rule of a shipped effect; null of one that the table lacks, which is
// lost.
const ArrivalRule* FindArrivalRule(ExportFormat format, const std::string& kind,
                                   const std::string& parameter);

// A row for each parameter of an effect in the model, then one for each other
// parameter of `fitted` (names of docs/interface.md section 3).
std::vector<ArrivalRow> ArrivalRows(const Model& model, ExportFormat format,
                                    const std::vector<std::string>& fitted);

}  // namespace sysid
