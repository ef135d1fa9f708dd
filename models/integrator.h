#pragma once

#include <string>
#include <vector>

#include "models/dynamics.h"

namespace sysid {

// Steps of the rollout; the efforts are held over a step.
enum class Integrator {
  // qd += h qdd(q, qd); q = q [+] h qd. First order; the paper's (Heiden et
  // al.), for comparison with it.
  kSemiImplicitEuler,
  // Runge and Kutta's fourth-order step on the group (Munthe-Kaas 1999).
  kRungeKutta4,
};

std::string ToString(Integrator integrator);
int Order(Integrator integrator);
// By the names of docs/interface.md; throws InputError at `place` for another.
Integrator ParseIntegrator(const std::string& name, const std::string& place);

// Scratch of one thread for steps; the workspace holds the parameters.
template <typename T>
class Stepper {
 public:
  Stepper(Integrator integrator, Workspace<T>* workspace);

  // x after h seconds under the efforts tau (nv numbers).
  // False where the dynamics fail (ForwardDynamics).
  [[nodiscard]] bool Step(double h, const T* tau, T* x);

  // The same with a companion to each of its lines (StepTangent):
  //   Accelerated(q, qd, qdd): the dynamics at the start or at a stage;
  //   Moved(h, u): q moved by Exp(u), in a step of Euler's;
  //   MovedStage(stage, h, u, qd): q moved from the start of the step to the
  //   next stage, whose qd it is, or after the last stage to the end.
  template <class Companion>
  [[nodiscard]] bool StepWith(double h, const T* tau, T* x,
                              Companion* companion);

 private:
  template <class Companion>
  bool StepEuler(double h, const T* tau, T* x, Companion* companion);
  template <class Companion>
  bool StepRungeKutta4(double h, const T* tau, T* x, Companion* companion);

  Integrator integrator_;
  Workspace<T>* ws_;
  std::vector<T> stage_x_, u_, v_, rate_, sum_u_, sum_v_, qdd_;
};

}  // namespace sysid
