#pragma once

#include "models/math/types.h"
#include "models/mechanism.h"

// What an effect (effect.h) sees of a model, and the hooks by which it acts.

namespace sysid {

// The joint as an effect on it sees it. For a spherical joint qd is the
// relative angular velocity in the child's axes, 3 numbers; else one number.
// What follows them is there only for effects that declare that they read it,
// all of them on hinges and slides.
template <typename T>
struct JointState {
  JointType type;
  int nv;       // 1 or 3
  const T* q;   // 1 number, or the quaternion x, y, z, w
  const T* qd;  // nv numbers
  // kReadsEffort: what the joint's drive gives, 1 number.
  const T* effort = nullptr;
  // ReadsInput(): means over the step, in the order in which they are declared.
  const T* inputs = nullptr;
  // ReadsJoint(): q and qd of all joints, by Joint::q_index and v_index.
  const T* all_q = nullptr;
  const T* all_qd = nullptr;
  // AddState(): the effect's own state, in the order in which it is declared.
  const T* z = nullptr;
};

// How a joint or its motor moves, as its sensor sees it.
template <typename T>
struct JointRates {
  const T* qd;
  const T* qdd;
};

// A link as an effect on it sees it; world axes.
template <typename T>
struct LinkState {
  Vector3<T> v_com;  // velocity of the centre of mass, m/s
  Matrix3<T> R_WL;   // link to world
  Vector3<T> w;      // angular velocity, rad/s
};

// The hooks for one scalar; all do nothing unless the effect says otherwise. p
// points at the effect's own parameters, in the order of Effect::parameters().
template <typename T>
class EffectHooks {
 public:
  virtual ~EffectHooks() = default;
  // Generalised force on the target joint, added to tau (nv numbers), N m or N.
  virtual void AddEffort(const JointState<T>&, const T* /*p*/,
                         T* /*tau*/) const {}
  // The level, at least 0, of the dry friction of a hinge or slide at a speed:
  // what slows it while it slips, and up to which (speed 0) it is held at rest.
  // Even in the speed, which a step may carry a little past 0; of the joint the
  // effort and the inputs alone may be read. AddEffort of such an effect is its
  // whole law smoothed, for what has no modes: ball joints, inverse dynamics,
  // Euler's step (docs/dry_friction.md).
  virtual T DryFriction(const JointState<T>&, const T* /*p*/,
                        const T& /*speed*/) const {
    return T(0.0);
  }
  // What such an effect gives beside its dry friction, in any mode.
  virtual void AddBesideDry(const JointState<T>&, const T* /*p*/,
                            T* /*tau*/) const {}
  // Limits what the target joint's drive gives (1 number).
  virtual void LimitDrive(const JointState<T>&, const T* /*p*/,
                          T* /*effort*/) const {}
  // Added to the diagonal of the joint-space inertia of the target joint.
  virtual void AddJointInertia(const T* /*p*/, T* /*inertia*/) const {}
  // Of a pair of joints: what turns with both, z = q_1 + ratio q_2, has this
  // inertia, and feels this generalised force.
  virtual T Ratio(const T* /*p*/) const { return T(0.0); }
  virtual T PairInertia(const T* /*p*/) const { return T(0.0); }
  virtual T PairEffort(const T& /*z_rate*/, const T* /*p*/) const {
    return T(0.0);
  }
  // Changes the acceleration of gravity, world axes, m/s^2. `inputs` as in
  // JointState.
  virtual void ModifyGravity(const T* /*inputs*/, const T* /*p*/,
                             Vector3<T>* /*gravity*/) const {}
  // Force on the target link at its centre of mass, world axes, N.
  virtual void AddLinkForce(const LinkState<T>&, const T* /*p*/,
                            Vector3<T>* /*force*/) const {}
  // Turns the measured effort of the target joint (nv numbers) into the true.
  virtual void ModifyInput(const T* /*p*/, T* /*tau*/) const {}
  // Adds to the time, s, by which all measured efforts act later.
  virtual void AddInputDelay(const T* /*p*/, T* /*delay*/) const {}
  // Adds to the time constant, s, by which the measured effort of the target
  // joint is low-passed before it acts.
  virtual void AddInputLag(const T* /*p*/, T* /*lag*/) const {}
  // Adds to the time, s, by which the effect's own inputs act later.
  virtual void AddOwnDelay(const T* /*p*/, T* /*delay*/) const {}
  // Of an effect with a state of its own: its rate, per second;
  virtual void StateRate(const JointState<T>&, const T* /*p*/,
                         T* /*rate*/) const {}
  // or, where its law is stiff and the joint's way alone moves it, what it is
  // at `to`, exactly (it comes as that at `from`);
  virtual void MoveState(const JointState<T>& /*from*/,
                         const JointState<T>& /*to*/, const T* /*p*/,
                         T* /*z*/) const {}
  // and what is believed of it where a motion starts: zero unless it says.
  virtual void StartState(const JointState<T>&, const T* /*p*/,
                          T* /*z*/) const {}
  // Of a drive that is not rigidly on its joint: turns q, qd and qdd of the
  // joint into those of its motor, on the joint's side of the gear. z and its
  // rates are the effect's own.
  virtual void ToMotor(const T* /*z*/, const T* /*z_rate*/, const T* /*p*/,
                       T* /*q*/, T* /*qd*/, T* /*qdd*/) const {}
  // Turns the true position of the target joint, or of its motor, into the
  // measured one. The rates are there with kRatesHook.
  virtual void ModifyMeasurement(const JointRates<T>&, const T* /*p*/,
                                 T* /*q*/) const {}
};

// Which hooks an effect uses: the inner loop visits no other.
enum HookMask : unsigned {
  kEffortHook = 1u << 0,
  kJointInertiaHook = 1u << 1,
  kGravityHook = 1u << 2,
  kLinkForceHook = 1u << 3,
  kInputHook = 1u << 4,
  kMeasurementHook = 1u << 5,
  kInputDelayHook = 1u << 6,
  kDryFrictionHook = 1u << 7,
  kBesideDryHook = 1u << 8,
  kDriveHook = 1u << 9,  // AddEffort is what the drive gives
  kLimitHook = 1u << 10,
  kInputLagHook = 1u << 11,
  kOwnDelayHook = 1u << 12,
  kRatesHook = 1u << 13,    // ModifyMeasurement reads rates
  kReadsEffort = 1u << 14,  // not a hook: of JointState
  kPairHook = 1u << 15,
  kStateRateHook = 1u << 16,
  kMoveStateHook = 1u << 17,
  kMotorHook = 1u << 18,
};

// Those that change with the parameters what acts on the joints in a step
// (residuals/acting_inputs.h).
inline constexpr unsigned kActingHooks =
    kInputHook | kInputDelayHook | kInputLagHook | kOwnDelayHook;

}  // namespace sysid
