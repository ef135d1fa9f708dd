#include "models/integrator.h"

#include <algorithm>
#include <iterator>

#include "models/error.h"

namespace sysid {

namespace {

// In the order of the enumeration.
struct Entry {
  Integrator integrator;
  const char* name;
  int order;
};
constexpr Entry kIntegrators[] = {
    {Integrator::kSemiImplicitEuler, "semi_implicit_euler", 1},
    {Integrator::kRungeKutta4, "rk4", 4},
    {Integrator::kRosenbrock2, "ros2", 2},
};

constexpr const Entry& EntryOf(Integrator integrator) {
  return kIntegrators[static_cast<int>(integrator)];
}

static_assert(std::all_of(std::begin(kIntegrators), std::end(kIntegrators),
                          [](const Entry& entry) {
                            return EntryOf(entry.integrator).name == entry.name;
                          }));

}  // namespace

std::string ToString(Integrator integrator) { return EntryOf(integrator).name; }

int Order(Integrator integrator) { return EntryOf(integrator).order; }

std::vector<std::string> IntegratorNames() {
  std::vector<std::string> names;
  for (const Entry& entry : kIntegrators) names.push_back(entry.name);
  return names;
}

Integrator ParseIntegrator(const std::string& name, const std::string& place) {
  for (const Entry& entry : kIntegrators) {
    if (name == entry.name) return entry.integrator;
  }
  throw InputError(place, "unknown integrator '" + name + "'",
                   NameHint(name, IntegratorNames()));
}

}  // namespace sysid
