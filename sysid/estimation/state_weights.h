#pragma once

#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// What holds the states of segments beside the measurements: how tightly
// segments hang together, and what is believed of a state that no sensor sees.

// Standard deviation of the defect x_end [-] x_next, as a multiple of the noise
// (positions), of the noise over kDefectTime (velocities), and of kDefectPart
// of the typical scale of an internal state.
//
// The rollout is deterministic, so the maximum-likelihood estimate has no
// defects at all; a defect that is free to be large is what lets the solver
// walk through a landscape that single shooting cannot. So a fit starts loose,
// joins the segments, and ends tight.
inline constexpr double kLooseDefect = 10.0;
inline constexpr double kMiddleDefect = 1.0;
inline constexpr double kCloseDefect = 0.1;
inline constexpr double kJoinedDefect = 0.01;
inline constexpr double kDefectTime = 0.1;  // s
// As if a sensor of 1 % saw it, so that it counts as positions do.
inline constexpr double kDefectPart = 0.01;

// The last tightness. K defects of d each shift the end of a run by D = K d at
// a cost of D^2 / (K sigma_d^2); left unshifted the same D costs the N samples
// about N D^2 / sigma^2. What is not model stays below 1 % of that with
// sigma_d = 0.1 sigma / sqrt(N K).
double TightDefect(const ShootingProblem& problem, const Solution& solution);

// Standard deviations of the defect: tangent_size numbers for defect = 1.
std::vector<double> DefectSigma(const ShootingProblem& problem);

// Independent segments have nothing but their own data to say how a body spins
// about its heading, which that does not show: a wrong model would put its
// errors there. The measured rotation knows better, to about this part of
// StateBelief.
inline constexpr double kHeldSpin = 10.0;

// Beliefs about the bodies of which all ten inertial parameters are free: a
// stage may make of each another one of its own size. The data leaves several
// of the ten open, and what it knows badly a step would otherwise throw far
// away, where it is refused. Theta's places and standard deviations where the
// model misses nothing but the noise; the start of the stage is the mean.
struct ThetaBelief {
  std::vector<int> places;
  std::vector<double> sigmas;
};
ThetaBelief BodyBelief(const ShootingProblem& problem);

// Beliefs about the first state of a run (of each segment, where they are
// independent), as wide as keeps them without weight beside a measurement and
// still gives every direction some: what no sensor sees (the spin of a rod
// about itself, by heading vectors; an internal state of an effect) would
// otherwise make the problem singular, and a state that is frozen instead
// biases the parameters. Standard deviations, tangent_size numbers; those of a
// spin are divided by `twist_hold`.
std::vector<double> StateBelief(const ShootingProblem& problem,
                                double twist_hold);

// The same about the first sample of a run, which Run::start may know more of:
// the state (state_size) and how well it is known. `x`: the state as it is,
// where nothing more is known of it.
struct StartBelief {
  std::vector<double> state, sigma;
};
StartBelief BeliefAtStart(const ShootingProblem& problem, int run,
                          double twist_hold, const double* x);

}  // namespace sysid
