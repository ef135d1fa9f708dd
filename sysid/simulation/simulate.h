#pragma once

#include <cstdint>

#include "models/integrator.h"
#include "models/model.h"
#include "residuals/run.h"

namespace sysid {

// What drives the joints of one degree of freedom of a simulation.
enum class Excitation {
  kNone,
  kMultisine,  // five sines between 0.1 and 2 Hz, random phases
};

struct SimulationOptions {
  double duration = 10.0;  // s
  double rate = 100.0;     // Hz
  // Standard deviation of what is measured: rad (about each axis of a spherical
  // joint), or m.
  double noise = 0.0;
  std::uint64_t seed = 1;
  Excitation excitation = Excitation::kNone;
  // Rms effort of the multisine as a part of the weight's largest moment about
  // the joint (a slide: of the weight of what it carries).
  double excitation_level = 0.3;
  Integrator integrator = Integrator::kRungeKutta4;
  // Longest step, s; 0: divided until halving it changes less than 1e-9 (rad,
  // m) over the whole run, or 1e-3 of the noise, whichever is larger.
  double step = 0.0;
};

// A start at random: joint angles and slides uniform within +-`amplitude` (rad,
// m) of neutral, spherical joints tilted by up to it about a horizontal axis;
// at rest. Returns x = (q, qd).
Eigen::VectorXd RandomState(const Model& model, double amplitude,
                            std::uint64_t seed);

// The state at the first sample of a run: measured positions; velocities where
// measured, else zero; neutral where a joint is not measured.
Eigen::VectorXd FirstState(const Model& model, const Run& run);

// Rolls the model out from x0 and measures the position of every joint, with
// its effects. The noise is drawn from the seed, channel by channel.
// Throws InputError where the dynamics fail.
Run Simulate(const Model& model, const Eigen::VectorXd& x0,
             const SimulationOptions& options);

}  // namespace sysid
