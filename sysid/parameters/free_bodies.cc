#include "sysid/parameters/free_bodies.h"

#include <algorithm>
#include <limits>

namespace sysid {

std::vector<FreeParameter> FreeBodies(const Model& model,
                                      const std::vector<int>& links) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<FreeParameter> bodies;
  for (const Parameter& parameter : AllParameters(model)) {
    const bool is_inertia = parameter.kind == ParameterKind::kInertia;
    if ((!is_inertia && parameter.kind != ParameterKind::kMass &&
         parameter.kind != ParameterKind::kCom) ||
        std::find(links.begin(), links.end(), parameter.index) == links.end()) {
      continue;
    }
    // An inertia is kept possible, (4.1), and has no bounds of its own.
    bodies.push_back({parameter, parameter.nominal,
                      is_inertia ? -kNone : parameter.lower,
                      is_inertia ? kNone : parameter.upper, std::nullopt});
  }
  return bodies;
}

}  // namespace sysid
