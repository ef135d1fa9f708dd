#pragma once

#include <vector>

#include "models/dynamics_tangent.h"
#include "models/stepper.h"

namespace sysid {

// Eight columns of a rollout: how the state moves (nv lanes each; dq of a
// spherical joint is a rotation vector in the child's axes, dqd the change of
// the numbers qd), and with it the internal states of effects and what is held.
struct StateColumns {
  StateColumns(const Model& model, const ParameterColumns& parameters);

  ParameterColumns theta;
  std::vector<Lanes> dq, dqd, dz;
  std::vector<Lanes> dheld;  // of the step to come
  bool held_moves = false;   // else dheld is not read

  // Scratch of a step.
  std::vector<Lanes> stage_q, stage_qd, qdd, du, rate, sum_u, sum_v;
  std::vector<Lanes> stage_z, z_rate, sum_z;
  std::vector<Lanes> beside;
};

// Steps as Stepper takes them, and with the state any number of its columns:
// the derivative of each equation of the step, (3.3) to (3.5) or (3.8), with
// the numbers computed once for all columns.
class StepTangent {
 public:
  StepTangent(Integrator integrator, Workspace<double>* workspace);

  // x and its columns after h seconds with what is held.
  // False where the dynamics fail.
  [[nodiscard]] bool Step(double h, const double* held, double* x,
                          const std::vector<StateColumns*>& columns);

 private:
  // Of the move of a spherical joint by Exp(u) since the start of the step, and
  // of its rate k = J_r(u)^-1 qd.
  struct Move {
    Eigen::Matrix3d turn;  // Exp(u)^T
    Eigen::Matrix3d J;     // J_r(u)
    Eigen::Matrix3d k_qd;  // dk/dqd
    Eigen::Matrix3d k_u;   // dk/du
  };

  // An internal state that the joint's way moves (Effect's MoveState), and how
  // that moves with its arguments: the joint's position at the start, the way
  // from there, the state itself, the parameters.
  struct Way {
    const EffectHooks<Jet8>* hooks;
    JointType type;
    int q_index, v, first_z, states;
    int first;  // of its parameters
    int parameters;
    std::vector<double> last, start;  // q and z, at the last evaluation
    std::vector<Jet8> arguments;
    std::vector<Eigen::VectorXd> by;  // one an argument
  };

  // Of the stepper (Stepper::StepWith).
  friend class Stepper<double>;
  void Accelerated(const double* q, const double* qd, const double* qdd);
  void Moved(double h, const double* u);
  void MovedStage(int stage, double h, const double* u, const double* qd);
  void MovedBraked(int stage, double h, const double* u, const double* qd);
  bool Moves(int v) const;
  void Jumped(int v, const double* ratio, bool rests);

  // qdd and z_rate of the evaluation, at the start of the step or at a stage.
  void Evaluate(bool start, bool beside, StateColumns* c);
  void StageColumns(int stage, double ahead, double weight, StateColumns* c);
  void BrakedColumns(int stage, double h, StateColumns* c);
  // The state moves by what has been summed.
  void End(StateColumns* c) const;
  // dk of (3.5), of the stage's columns.
  void StageRate(StateColumns* c) const;
  void SetMoves(const double* u);
  void SetWays(bool from_last, const double* u);
  // Internal states after the way u: `rate` is what rates add.
  void MoveStates(const StateColumns& c, const std::vector<Lanes>& rate,
                  double h, const std::vector<Lanes>& du,
                  std::vector<Lanes>* out) const;
  void SetRates(const double* u, const double* qd);
  void Advance(const std::vector<Lanes>& dq, const std::vector<Lanes>& du,
               std::vector<Lanes>* out) const;

  Workspace<double>* ws_;
  Stepper<double> stepper_;
  DynamicsTangent dynamics_;
  std::vector<Move> moves_;  // by body
  std::vector<Way> ways_;
  const std::vector<StateColumns*>* columns_ = nullptr;  // of the step
};

}  // namespace sysid
