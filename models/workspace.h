#pragma once

#include <vector>

#include "models/model.h"

namespace sysid {

// What the dry friction of a hinge or slide does (docs/dry_friction.md).
enum class DryMode : signed char {
  kSmoothed,  // its law smoothed: wherever nothing has decided
  kForward,   // it slips, qd > 0 or about to be
  kBackward,  // it slips, qd < 0 or about to be
  kRests,     // it holds the joint: qdd = 0
};

// Scratch of the dynamics for one thread and one rollout: what is computed from
// the parameters once (SetParameters), and what each evaluation overwrites. No
// evaluation allocates.
//
// Everything is in world axes. The spatial quantities of body i refer to its
// own origin, which is its joint's: moving them from a body to its parent is a
// cross product with r, never a rotation (docs/theory.md section 2).
template <typename T>
struct BodyData {
  // Constants of a rollout, in body axes.
  T mass;
  Vector3<T> h_B;     // mass times centre of mass, kg m
  Matrix3<T> I_B;     // rotational inertia about the body's origin, kg m^2
  Vector3<T> p_PB;    // the joint's origin in the parent body's frame, m
  T armature;         // added to the diagonal of the joint-space inertia
  bool has_armature;  // by an effect, whatever its value
  DryMode dry = DryMode::kSmoothed;

  // Kinematics.
  Matrix3<T> R_WB;
  Vector3<T> p_WB;      // m
  Vector3<T> r;         // from the parent's origin to this one's, world axes
  Vector3<T> axis;      // of a hinge or slide, world axes
  Vector3<T> w;         // angular velocity
  Vector3<T> v;         // velocity of the origin
  Vector3<T> c_w, c_v;  // accelerations that are there with qdd = 0
  Vector3<T> alpha, a;  // angular acceleration, acceleration of the origin

  // Articulated inertia [I H; H^T M] and bias force [n; f], about the origin.
  Matrix3<T> I, H, M;
  Vector3<T> n, f;
  Vector3<T> U_n, U_f;    // I^A S of a hinge or slide
  T D_inverse;            // 1 / D of (2.10), armature included; 0 at rest
  T u;                    // of (2.10); at rest then what its friction holds
  Matrix3<T> D3_inverse;  // the same of a spherical joint
  Matrix3<T> DH;          // its D^-1 H
  Vector3<T> u3;

  // The body's own inertia I and h of (2.7), kept for the tangent where T is
  // double.
  Matrix3<T> I_W;
  Vector3<T> h_W;
};

template <typename T>
class Workspace {
 public:
  // Starts at the model's nominal values. The model must outlive it.
  explicit Workspace(const Model& model);

  // Folds the parameters into the constants of each body: once a rollout.
  void SetParameters(const MechanismParameters<T>& parameters);

  // Turns true positions into measured ones (nq numbers), by the effects. The
  // rates, nv numbers each, are read where sensors_read_rates.
  void ModifyMeasurement(const T* qd, const T* qdd, T* q) const {
    Modify(measurement_effects, qd, qdd, q);
  }
  // The same of the motors.
  void ModifyMotorMeasurement(const T* qd, const T* qdd, T* q) const {
    Modify(motor_sensor_effects, qd, qdd, q);
  }

  const Model& model() const { return *model_; }
  const MechanismParameters<T>& parameters() const { return parameters_; }

  std::vector<BodyData<T>> bodies;
  Vector3<T> gravity;            // world axes, effects included
  std::vector<Vector3<T>> p_BL;  // per link: its origin in its body's frame
  std::vector<T> tau;            // efforts of all joints, the followers' last

  // One effect bound to this scalar and to its place in the model.
  struct Bound {
    const EffectHooks<T>* hooks;
    const T* p;
    int body;         // of the target joint or link, -1 for base
    int second_body;  // of a pair of joints, else -1
    int link;
    bool dry;                  // kDryFrictionHook
    bool beside;               // kBesideDryHook
    bool more;                 // ReadsMore()
    int first_held;            // of its inputs, in what is held
    int inputs;                // how many
    const EffectInput* names;  // of the inputs
    int first_z;               // of its states, in z; -1: it has none
    int states;                // how many
    bool moves;                // kMoveStateHook
  };
  std::vector<Bound> effort_effects, link_force_effects, input_effects,
      delay_effects, measurement_effects, motor_sensor_effects;
  // What the drives give beside the efforts, what limits it, lags of efforts,
  // gravity that inputs move, all that read inputs, pairs, all with states, and
  // those whose motor is not where its joint is.
  std::vector<Bound> drive_effects, limit_effects, lag_effects, gravity_effects,
      readers, pair_effects, state_effects, motor_effects;
  bool sensors_read_rates = false;
  // What was held in the last evaluation, and what the drives gave, where
  // effects change that: else empty, the efforts themselves.
  const T* held = nullptr;
  std::vector<T> drive;
  std::vector<T> nothing;  // held where nothing acts, z at null: zeros
  // z of the evaluations to come, of whoever evaluates at a whole state; null:
  // zeros. It must outlive them.
  const T* z = nullptr;
  Vector3<T> still_gravity;  // without gravity_effects
  // Efforts of all joints beside what is held and what effects give, of whoever
  // evaluates with them; null: none.
  const T* beside = nullptr;
  // Movers, hinges and slides, that dry friction may hold: their own or that of
  // their followers.
  std::vector<int> dry_bodies;

  // Where there are followers: coordinates of all joints, (2.25), and what the
  // equations of motion become in those of the state, (2.28).
  std::vector<T> y, yd, ydd, y_tau, force;
  MatrixX<T> M_y, M, factor;
  // (2.35): K of each pair, nv numbers; where ABA accelerates pairs.
  std::vector<std::vector<T>> pair_K;

 private:
  void BindEffects();
  void Modify(const std::vector<Bound>& sensors, const T* qd, const T* qdd,
              T* q) const {
    for (const Bound& effect : sensors) {
      const Body& body = model_->bodies()[effect.body];
      const JointRates<T> rates =
          sensors_read_rates
              ? JointRates<T>{qd + body.v_index, qdd + body.v_index}
              : JointRates<T>{nullptr, nullptr};
      effect.hooks->ModifyMeasurement(rates, effect.p, q + body.q_index);
    }
  }

  const Model* model_;
  MechanismParameters<T> parameters_;
};

}  // namespace sysid
