#pragma once

#include <cstdint>
#include <memory>

#include "models/integrator.h"
#include "models/model.h"
#include "residuals/run.h"
#include "sysid/simulation/driven_motion.h"
#include "sysid/simulation/excitation.h"

namespace sysid {

// What drives the joints of one degree of freedom of a simulation.
enum class Excitation {
  kNone,
  kMultisine,     // open-loop efforts, whatever the limits
  kWithinLimits,  // the same, but joints with limits follow a multisine
};

struct SimulationOptions {
  double duration = 10.0;  // s
  double rate = 100.0;     // Hz
  // Standard deviation of what is measured: rad (about each axis of a spherical
  // joint), or m.
  double noise = 0.0;
  // Whether the motors of hinges and slides have sensors, too.
  bool motor_sensors = false;
  std::uint64_t seed = 1;
  Excitation excitation = Excitation::kNone;
  // As MultisineOptions::effort_level, excursion, lowest, highest.
  double excitation_level = 0.3;
  double excursion = 1.0;
  double lowest_frequency = 0.1, highest_frequency = 2.0;  // Hz
  // What effects read, of its own times (the simulation's are from zero); its
  // ends hold beyond them. May be null where they read nothing.
  std::shared_ptr<const Run> inputs = nullptr;
  Integrator integrator = Integrator::kRungeKutta4;
  // Longest step, s; 0: divided until halving it changes less than 1e-9 (rad,
  // m) over the whole run, or 1e-3 of the noise, whichever is larger.
  double step = 0.0;
};

// A start at random: joint angles and slides uniform within +-`amplitude` (rad,
// m) of neutral, or of what is next to it if that is nearer to a limit, and
// within the limits; spherical joints tilted by up to it about a horizontal
// axis; at rest. Returns x = (q, qd).
Eigen::VectorXd RandomState(const Model& model, double amplitude,
                            std::uint64_t seed);

// At rest at neutral, or where limits exclude that at the nearest that they do
// not.
Eigen::VectorXd NearestToNeutral(const Model& model);

// The state at the first sample of a run: measured positions; velocities where
// measured, else zero; neutral where a joint is not measured.
Eigen::VectorXd FirstState(const Model& model, const Run& run);

// Rolls the model out from x0 and measures the position of every joint, with
// its effects. The noise is drawn from the seed, channel by channel.
// Throws InputError where the dynamics fail.
Run Simulate(const Model& model, const Eigen::VectorXd& x0,
             const SimulationOptions& options);

// The same with the efforts of a drive instead of an excitation.
Run SimulateDriven(const Model& model, const Eigen::VectorXd& x0,
                   const SimulationOptions& options, const DriveLaw& drive);

// How many samples that makes: one at each end too.
int SampleCount(const SimulationOptions& options);

}  // namespace sysid
