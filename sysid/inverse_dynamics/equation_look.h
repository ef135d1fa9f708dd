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
// effort, and d (1 + g) / (1 + g_0) of the true one.
//
// The search begins with what every driven joint has (viscous and Coulomb
// friction, armature, a bias), of which goes what is less than two standard
// errors or not possible: a coupled pair of axes hides the laws of both from
// whoever adds one after the other. An effect is added where stretches of time
// that were not fitted are then predicted better (cross-validation over 20
// stretches, (11.20)) by more standard errors than chance makes of the best of
// so many, and what is left of a joint falls by a twentieth; it goes again
// where it is not missed by one.
//
// Of an arm (more effects than a search by segments takes) the bodies are then
// asked as well: whether the same search, with all ten coordinates of each link
// free about what is believed of them, (11.18), predicts stretches better. What
// bodies can imitate shows there in their own cost: a law counts that lowers it
// by more than ln(candidates) + 2, while all of it is below half a unit for
// each coordinate that the data tells. Efforts that no motion of their joint
// explains (effort_audit.h) tell nothing. Laws with searched parameters, and
// those that read efforts, are candidates of arms alone: elsewhere segments
// show them better.

// An effort that is none of its joint.
struct RejectedEffort {
  std::string joint;
  int v = 0;               // of nv
  double explained = 0.0;  // of its mean square, by the joint's motion
};

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
  // Of more effects than `few`: bodies and efforts were asked too.
  bool is_arm = false;
  std::vector<RejectedEffort> rejected;
  // Of an arm, what is free beside what the problem frees: plain laws that the
  // URDF gives, whose values are often placeholders.
  std::vector<FreeParameter> given_laws;
  // Links whose bodies are not as given: those of the URDF predict worse.
  std::vector<int> bodies;
  int tests = 0;  // candidates that were looked at
};

// What a fit of an arm has beside what its user frees: the given plain laws and
// the bodies free, and the rejected efforts left out. Nothing else than before
// where it is no arm.
void AddWhatArmsHave(const EquationLook& look, const Model& model,
                     std::vector<FreeParameter>* free,
                     EstimationOptions* options);

// From the problem's model at its start (StartByInverseDynamics); `known`
// parameters stay. With more effects than `few` bodies and efforts are asked.
// Nothing where a run does not measure all joints, or where there are no
// efforts.
EquationLook LookByEquations(
    const ShootingProblem& problem,
    const std::vector<std::shared_ptr<const Effect>>& candidates,
    const std::set<std::string>& known, int few);

}  // namespace sysid
