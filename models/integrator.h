#pragma once

#include <string>
#include <vector>

namespace sysid {

// Steps of the rollout; the efforts are held over a step.
enum class Integrator {
  // qd += h qdd(q, qd); q = q [+] h qd. First order; the paper's (Heiden et
  // al.), for comparison with it.
  kSemiImplicitEuler,
  // Runge and Kutta's fourth-order step on the group (Munthe-Kaas 1999). Joints
  // with dry friction stop, rest and break away within it
  // (docs/dry_friction.md); Euler's step takes their law smoothed.
  kRungeKutta4,
  // A Rosenbrock method of second order, implicit in the damping of the joints'
  // own effects (docs/theory.md (3.8)): no damping is too stiff for its step.
  // Dry friction is smoothed.
  kRosenbrock2,
};

std::string ToString(Integrator integrator);
int Order(Integrator integrator);
std::vector<std::string> IntegratorNames();
// By the names of docs/interface.md; throws InputError at `place` for another.
Integrator ParseIntegrator(const std::string& name, const std::string& place);

}  // namespace sysid
