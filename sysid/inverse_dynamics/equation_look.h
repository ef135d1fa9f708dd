#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "sysid/estimation/shooting_problem.h"
#include "sysid/linearization/screening.h"

namespace sysid {

// What is missing, by the equations of motion alone (docs/inverse_dynamics.md):
// nothing is rolled out, and each candidate is one or a few columns of
//
//   r = u - ID(q, qd, qdd) = -J d + what is left,                      (11.2)
//
// J the derivatives of r by the parameters of the candidates, off, and by those
// that are free. Effects are tried in the order of what they add, for each of
// their parameters, to the likelihood
//
//   L = -1/2 sum_v n_v ln(|r_v + J_v d|^2 / n_v),                     (11.14)
//
// n_v the equations of joint v, each joint with the standard deviation that is
// left of it. The equation of a joint without a measured effort is that of its
// acceleration, (11.10). One with a gain g of its effort is divided by 1 + g,
// and linear in
//
//   1 / (1 + g) = (1 - d_g / (1 + g_0)) / (1 + g_0):                  (11.17)
//
// what else acts on that joint alone is then d / (1 + g_0) of the measured
// effort, and d (1 + g) / (1 + g_0) of the true one. An effect is added where
// stretches that were not fitted are then predicted better (cross-validation
// over 20 stretches) by more standard errors of the difference than chance
// makes of the best of so many, and goes again where it is not missed by one.

// A joint of whose effort, by the equations of motion with the effects that
// they show, what is left follows the motion of another joint.
struct FollowedMotion {
  std::string joint, of;
  double share = 0.0;  // of the mean square that is left
};

struct EquationLook {
  // In the order in which they were found, as they are expected.
  std::vector<ScreenedEffect> effects;
  std::vector<FollowedMotion> followed;
  int tests = 0;  // candidates that were looked at
};

// From the problem's model at its start (StartByInverseDynamics); `known`
// parameters stay. Nothing where a run does not measure all joints, or where
// there are no efforts.
EquationLook LookByEquations(
    const ShootingProblem& problem,
    const std::vector<std::shared_ptr<const Effect>>& candidates,
    const std::set<std::string>& known);

}  // namespace sysid
