#pragma once

#include <memory>
#include <string>

#include "models/mechanism.h"

namespace sysid {

// The dynamics of a mechanism by somebody else's library, in our conventions
// and numbering. Each is a module of its own, which LoadEngine opens: two
// MuJoCos, or Pinocchio's Boost and ours, do not fit into one program.
class Engine {
 public:
  virtual ~Engine() = default;
  virtual std::string Version() const = 0;

  // Of nq, nv, nv and nv numbers.
  virtual void ForwardDynamics(const double* q, const double* qd,
                               const double* tau, double* qdd) = 0;
  // What follows only Pinocchio has: of MuJoCo's it is not called.
  virtual void InverseDynamics(const double*, const double*, const double*,
                               double*) {}
  // nv x nv.
  virtual void MassMatrix(const double*, double*) {}
  // Of the efforts, by ten inertial parameters of each moving link: sets the
  // efforts that they give with the mechanism's own.
  virtual void Regressor(const double*, const double*, const double*, double*) {
  }
  // Of the accelerations: nv x nv each, by rows; a rotation vector in the
  // child's axes for a ball joint's q.
  virtual void Derivatives(const double*, const double*, const double*, double*,
                           double*, double*) {}
};

// What a module exports; `mjcf`: the same mechanism by ToMjcf. A module sees
// the headers of sysid::models, not its functions.
using MakeEngineFunction = Engine*(const Mechanism& mechanism,
                                   const std::string& mjcf);

// Of the module at this path; CHECKs that it can be opened.
std::unique_ptr<Engine> LoadEngine(const std::string& path,
                                   const Mechanism& mechanism);

}  // namespace sysid

extern "C" __attribute__((visibility("default"))) sysid::Engine* MakeEngine(
    const sysid::Mechanism& mechanism, const std::string& mjcf);
