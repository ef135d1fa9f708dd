#pragma once

#include <vector>

#include "models/dynamics.h"
#include "models/integrator.h"

namespace sysid {

// Scratch of one thread for steps; the workspace holds the parameters.
template <typename T>
class Stepper {
 public:
  Stepper(Integrator integrator, Workspace<T>* workspace);

  // x after h seconds with `held`, the efforts and inputs (Model::held_size()).
  // False where the dynamics fail (ForwardDynamics).
  [[nodiscard]] bool Step(double h, const T* held, T* x);

  // The same with a companion to each of its lines (StepTangent):
  //   Accelerated(q, qd, qdd): the dynamics at the start or at a stage;
  //   Moved(h, u): q moved by Exp(u), in a step of Euler's;
  //   MovedStage(stage, h, u, qd): q moved from the start of the step to the
  //   next stage, whose qd it is, or after the last stage to the end;
  //   MovedBraked(stage, h, u, qd): the same of Rosenbrock's two;
  //   Moves(v), Jumped(v, ratio, rests): of dry friction, (5): whether qd_v has
  //   a derivative, and what dqd does where that joint stops.
  // With dry friction a step may be several, and stages that lead to no end are
  // taken back by other ones.
  template <class Companion>
  [[nodiscard]] bool StepWith(double h, const T* held, T* x,
                              Companion* companion);

 private:
  template <class Companion>
  bool StepEuler(double h, const T* held, T* x, Companion* companion);
  // From x to `out`, which may be x; `started`: the dynamics at x are in the
  // workspace and in qdd_.
  template <class Companion>
  bool StepRungeKutta4(double h, const T* held, const T* x, T* out,
                       Companion* companion, bool started = false);
  template <class Companion>
  bool StepRosenbrock2(double h, const T* held, T* x, Companion* companion);
  // brake_ = D of (3.8) at x, and whether there is any.
  bool SetBrake(const T* x);
  // Between these, ForwardDynamics is of M + gamma h D.
  void Brake(double h);
  void Release();
  // Evaluations are at the state x from here on.
  void SeeStates(const T* x) {
    const StateLayout& at = ws_->model().layout();
    if (at.nz() > 0) ws_->z = x + at.z();
  }
  // z of `to`, h seconds after `from` at these rates.
  void MoveStates(double h, const std::vector<T>& rate, const T* from, T* to);

  // Steps with dry friction (dry_step-impl.h).

  // A joint with dry friction along the stages of a step.
  struct DryJoint {
    int body = 0, v = 0;
    double level[4];       // c(0) at the stages
    bool passed = false;   // its event ends the step, or was none
    bool settles = false;  // it rests from the start, but its qd still moves
    double rate = 0.0;     // qd at the start
    double drive[4];       // qdd at the stages; at rest -lambda
  };
  // The margin (4) of a joint passes 0 within a step (of which these are
  // parts): by its interpolant at `guess`, with that slope, and before `until`.
  struct Event {
    int joint = -1;
    double guess = 1.0, slope = -1.0, until = 1.0;
  };
  // The stages of a step as a companion sees them, but for the end.
  template <class Companion>
  struct Watch;

  template <class Companion>
  bool StepDry(double h, const T* held, T* x, Companion* companion);
  template <class Companion>
  bool StepToEvent(bool look, const T* held, T* x, double* left,
                   Companion* companion);
  template <class Companion>
  bool Start(const T* held, T* x, bool* started, Companion* companion);
  template <class Companion>
  bool Stop(int body, const T* held, T* x, Companion* companion);
  template <class Companion>
  void Jump(int body, T* x, Companion* companion);
  void Record(int stage, const T* qd, const T* qdd);
  double SensibleStep(double h) const;
  Event NextEvent(double h) const;
  void Locate(const Event& event, const T* held, const T* x, double* h,
              bool* located);
  bool Margin(const DryJoint& joint, double h, const T* held, const T* x,
              double* margin);

  // A joint's own effort law, as (3.8) differentiates it.
  struct Damper {
    const EffectHooks<Jet8>* hooks;
    int body;
    int first;  // of its parameters
    std::vector<Jet8> p;
  };

  Integrator integrator_;
  Workspace<T>* ws_;
  std::vector<T> stage_x_, u_, v_, rate_, sum_u_, sum_v_, qdd_;
  std::vector<T> start_x_, z_rate_, sum_z_;        // where the state has z
  std::vector<T> end_x_, first_qdd_, before_qdd_;  // with dry friction
  std::vector<DryJoint> dry_;                      // one for each dry body
  std::vector<double> jump_;
  // Of Rosenbrock's: the laws, and by body their derivatives; by joint velocity
  // D and the effort beside; by body its inertia without the brake.
  std::vector<Damper> dampers_;
  std::vector<Eigen::Matrix3d> by_qd_;
  std::vector<double> brake_;
  std::vector<T> beside_, free_armature_;
  std::vector<bool> had_armature_;

  friend class StepTangent;
};

}  // namespace sysid
