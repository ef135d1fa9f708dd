#include "models/integrator.h"

#include "models/error.h"
#include "models/integrator-impl.h"

namespace sysid {

std::string ToString(Integrator integrator) {
  return integrator == Integrator::kRungeKutta4 ? "rk4" : "semi_implicit_euler";
}

int Order(Integrator integrator) {
  return integrator == Integrator::kRungeKutta4 ? 4 : 1;
}

Integrator ParseIntegrator(const std::string& name, const std::string& place) {
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kRungeKutta4}) {
    if (name == ToString(integrator)) return integrator;
  }
  throw InputError(place, "unknown integrator '" + name + "'",
                   NameHint(name, {"semi_implicit_euler", "rk4"}));
}

#define SYSID_INSTANTIATE(T) template class Stepper<T>;
SYSID_FOR_EACH_SCALAR(SYSID_INSTANTIATE)
#undef SYSID_INSTANTIATE

}  // namespace sysid
