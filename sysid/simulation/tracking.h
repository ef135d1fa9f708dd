#pragma once

#include <string>
#include <vector>

#include "models/model.h"
#include "sysid/simulation/driven_motion.h"
#include "sysid/simulation/reference.h"
#include "sysid/simulation/simulate.h"

namespace sysid {

// A position controller on every joint, as industrial drives have it:
//   tau = kp (q_ref - q) + kd (qd_ref - qd),                            (6)
// computed at the samples and held between them, limited to the URDF's effort
// limit. q is what the joint's sensor says (its offset included, its noise
// not), qd is true.
struct Gains {
  double kp = 0.0;  // N m/rad or N/m
  double kd = 0.0;  // N m s/rad or N s/m
};

// "200,20": all joints; "joint_1=200:20,joint_[2-6]=50:5": joint by joint, by
// names or patterns (patterns.h). By body, balls have none. Throws InputError
// at `place`, also for a joint without gains.
std::vector<Gains> ParseGains(const std::string& text, const Model& model,
                              const std::string& place);

// Gains that suit the joints' inertia at x0: critical damping, and within what
// a loop of this period, s, can do on the reference's way. As ParseGains reads
// them.
std::string SuggestGains(const Model& model, const JointReference& reference,
                         const Eigen::VectorXd& x0, double period);

// The drive; both must outlive it.
DriveLaw Track(const Model& model, const JointReference& reference,
               const std::vector<Gains>& gains);

// What (6) does between samples, to first order about rest: the largest modulus
// of the eigenvalues of
//   [q ]       [q ]   [T^2/2]
//   [qd] <- Phi[qd] - [  T  ] M^-1 (Kp q + Kd qd),  Phi = [1 T; 0 1]    (7)
// over the configurations on the reference's way. More than 1 is unstable.
double LoopGrowth(const Model& model, const JointReference& reference,
                  const Eigen::VectorXd& x0, const std::vector<Gains>& gains,
                  double period);

// The lowest of the rates `rate` 2, 4, 8, ... (Hz) at which the loop is stable;
// 0 where none up to 1000 times that is.
double StableRate(const Model& model, const JointReference& reference,
                  const Eigen::VectorXd& x0, const std::vector<Gains>& gains,
                  double rate);
bool IsStable(double growth);

// The run of the loop, from x0. Adds a notice where (7) grows by itself and the
// joints follow all the same (limits and friction bound it), and those of
// LimitNotices. Throws InputError where it grows and the joints do not follow;
// `suggested` says what to do then.
Run SimulateTracking(const Model& model, const Eigen::VectorXd& x0,
                     const SimulationOptions& options,
                     const JointReference& reference,
                     const std::vector<Gains>& gains,
                     const std::string& suggested,
                     std::vector<std::string>* notices);

// Efforts that a run's file gives, held from each of its rows until the next;
// behind the last as there. Its first row is time 0. `efforts` must outlive it.
DriveLaw Replay(const Run& efforts);

// What a driven run should not have, a line each: joints at their effort limit,
// joints beyond their position limits.
std::vector<std::string> LimitNotices(const Model& model, const Run& run);

}  // namespace sysid
