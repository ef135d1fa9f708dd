#pragma once

#include <limits>
#include <string>
#include <vector>

#include "models/mechanism.h"
#include "models/scalars.h"

namespace sysid {

// A physical effect that a plain rigid-body model lacks: friction, an offset,
// a delay. It has a name ("coulomb_friction"), a target (a joint, a link or
// "base"), parameters, and hooks into the model. At its null values it does
// nothing at all.
//
// To add one: write a class in a file of its own,
//
//   class CoulombFriction : public EffectOf<CoulombFriction> { ... };
//
// with the hooks it needs as member templates over the scalar, and add its line
// to shipped_effects.h. Nothing else: simulation, fit, screening and the page
// work from this interface. docs/effects.md leads through an example.

// What an effect's target may be.
enum class TargetKind {
  kJoint,
  kLink,
  kBase,
  kJointPair,  // "joint5,joint6": hinges or slides, one carried by the other
};

// A parameter of an effect, in SI units.
struct EffectParameter {
  std::string name;            // "joint1.friction"
  std::string unit;            // "N m", "-" where it has none
  double null_value = 0.0;     // where it starts; the effect is off there
  double typical_scale = 1.0;  // a plausible size, for scaling and searching
  double lower = 0.0;          // physical bounds; +-infinity where none
  double upper = 0.0;
  // Values to try where the law is not linear in it at null (a speed, an
  // order); empty where it is.
  std::vector<double> grid;
  // A whole number: chosen among the grid, never moved by a solver.
  bool whole = false;
};

// How a screening looks at an effect that is off: the derivative of the law by
// parameter `along` with the parameters at `at`, or with a `secant` the law at
// at + secant e_along less that at `at`, over the secant. The law must be off
// at `at`.
struct Probe {
  std::vector<double> at;
  int along = 0;
  double secant = 0.0;
};

// Probes whose sum, weighted, is the law to first order; several of them where
// a parameter is searched.
using ProbeSet = std::vector<Probe>;

// What an effect reads that is recorded beside efforts and measurements: a
// column of the run by its name (docs/interface.md section 2), or "t".
struct EffectInput {
  std::string name;  // "joint1.cmd"
  std::string unit;
};

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
};

// How a joint moves, as its sensor sees it.
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
  // Turns the true position of the target joint into the measured one. The
  // rates are there with kRatesHook.
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
};

// Those that change with the parameters what acts on the joints in a step
// (residuals/acting_inputs.h).
inline constexpr unsigned kActingHooks =
    kInputHook | kInputDelayHook | kInputLagHook | kOwnDelayHook;

class Effect {
 public:
  virtual ~Effect() = default;

  const std::string& kind() const { return kind_; }      // "coulomb_friction"
  const std::string& target() const { return target_; }  // "joint1"
  std::string name() const { return kind_ + "@" + target_ + rest_; }
  unsigned hooks() const { return hooks_; }
  int joint() const { return joint_; }  // target's index, -1 if not a joint
  int second_joint() const { return second_joint_; }  // of a pair, else -1
  int link() const { return link_; }  // target's index, -1 if not a link
  const std::vector<EffectParameter>& parameters() const { return parameters_; }
  const std::vector<EffectInput>& inputs() const { return inputs_; }
  // Joints, hinges or slides, that it reads beside its own.
  const std::vector<int>& other_joints() const { return other_joints_; }
  // Whether JointState has more for it than q and qd.
  bool ReadsMore() const {
    return (hooks_ & (kReadsEffort | kDriveHook | kLimitHook)) != 0 ||
           !inputs_.empty() || !other_joints_.empty();
  }
  // Parameters of the mechanism (docs/interface.md section 3) whose nominal
  // values are what is wrong, by name; fitting the effect frees them.
  const std::vector<std::string>& adjusts_nominal() const {
    return adjusts_nominal_;
  }
  // Names of parameters(), then adjusts_nominal().
  std::vector<std::string> ParameterNames() const;

  // How to screen for the effect: one set for each point of the grids, with the
  // derivatives by all other parameters().
  virtual std::vector<ProbeSet> ProbeSets() const;
  // The parameters() that are, to first order, the probes with these weights
  // (in SI units). Bounds are not looked at.
  virtual std::vector<double> FromProbes(
      const ProbeSet& probes, const std::vector<double>& weights) const;

  // Where the effect takes the place of another and has that one's values
  // (Model::AddEffect): sets the rest so that the law stays what it was.
  virtual void Subsume(std::vector<double>* /*values*/) const {}

  // Why these values of the parameters() are not what the effect means, though
  // within their bounds; empty where they are.
  virtual std::string Implausible(const std::vector<double>& /*values*/) const {
    return "";
  }

  // The motion in which the effect differs from others: completes "is
  // identified by". (A kShowsIn of the derived class.)
  virtual std::string ShowsIn() const = 0;

  // Whether it is a drive's: on a joint without an effort it is none.
  virtual bool NeedsDrive() const = 0;
  // Whether a diagnosis tries it without being told. (Not with a kOnlyNamed of
  // the derived class.)
  virtual bool IsCandidate() const = 0;
  // Whether it is only tried where an effect whose parameters it shares is in
  // the model. (A kExtends of the derived class.)
  virtual bool Extends() const = 0;

  // The hooks for a scalar of the closed list.
  virtual const EffectHooks<double>& HooksFor(ScalarTag<double>) const = 0;
  virtual const EffectHooks<Jet8>& HooksFor(ScalarTag<Jet8>) const = 0;
  virtual const EffectHooks<Jet16>& HooksFor(ScalarTag<Jet16>) const = 0;
  virtual const EffectHooks<Jet24>& HooksFor(ScalarTag<Jet24>) const = 0;

  // The law as the page shows it: "-d qd", SI, a generalised force unless it
  // says otherwise; empty where the effect does not tell. (A kLaw of the
  // derived class.)
  virtual std::string Law() const = 0;

 protected:
  Effect(const std::string& kind, unsigned hooks, TargetKind target_kind,
         const Mechanism& mechanism, const std::string& target);

  static constexpr double kUnbounded = std::numeric_limits<double>::infinity();

  // Called by the constructors of effects. The unit may say "{effort}" and
  // "{position}": N m or N, rad or m, by the target joint's type.
  void AddParameter(const std::string& name, const std::string& unit,
                    double typical_scale, double lower = -kUnbounded,
                    double upper = kUnbounded);
  // One that the law is not linear in; it starts at `start`.
  void AddSearchedParameter(const std::string& name, const std::string& unit,
                            double start, const std::vector<double>& grid,
                            double lower, double upper, bool whole = false);
  // The null value of parameter i where it is not zero.
  void SetNull(int i, double value) { parameters_[i].null_value = value; }
  void AdjustsNominal(const std::string& name) {
    adjusts_nominal_.push_back(name);
  }
  void ReadsInput(const std::string& name, const std::string& unit) {
    inputs_.push_back({name, unit});
  }
  void ReadsJoint(int joint) { other_joints_.push_back(joint); }
  // What the name has behind the target.
  void SetRestOfName(const std::string& rest) { rest_ = rest; }

  bool IsPrismatic() const { return prismatic_; }

 private:
  std::string kind_;
  std::string target_;
  std::string rest_;
  unsigned hooks_;
  int joint_ = -1, second_joint_ = -1;
  int link_ = -1;
  bool prismatic_ = false;
  std::vector<EffectParameter> parameters_;
  std::vector<EffectInput> inputs_;
  std::vector<int> other_joints_;
  std::vector<std::string> adjusts_nominal_;
};

// The same as the dynamics ask for them. A scalar that is not in the closed
// list comes with an overload of its own, found by argument-dependent lookup
// (docs/decisions/0008-tape-scalar.md).
template <typename T>
const EffectHooks<T>& HooksFor(const Effect& effect, ScalarTag<T> scalar) {
  return effect.HooksFor(scalar);
}

// Gives a derived effect its hooks for every scalar from its member templates
// (the names of EffectHooks, with T as first template argument). What it does
// not define does nothing.
template <class Derived>
class EffectOf : public Effect {
 public:
  template <typename T>
  void AddEffort(const JointState<T>&, const T*, T*) const {}
  template <typename T>
  T DryFriction(const JointState<T>&, const T*, const T&) const {
    return T(0.0);
  }
  template <typename T>
  void AddBesideDry(const JointState<T>&, const T*, T*) const {}
  template <typename T>
  void LimitDrive(const JointState<T>&, const T*, T*) const {}
  template <typename T>
  void AddJointInertia(const T*, T*) const {}
  template <typename T>
  T Ratio(const T*) const {
    return T(0.0);
  }
  template <typename T>
  T PairInertia(const T*) const {
    return T(0.0);
  }
  template <typename T>
  T PairEffort(const T&, const T*) const {
    return T(0.0);
  }
  template <typename T>
  void ModifyGravity(const T*, const T*, Vector3<T>*) const {}
  template <typename T>
  void AddLinkForce(const LinkState<T>&, const T*, Vector3<T>*) const {}
  template <typename T>
  void ModifyInput(const T*, T*) const {}
  template <typename T>
  void AddInputDelay(const T*, T*) const {}
  template <typename T>
  void AddInputLag(const T*, T*) const {}
  template <typename T>
  void AddOwnDelay(const T*, T*) const {}
  template <typename T>
  void ModifyMeasurement(const JointRates<T>&, const T*, T*) const {}

  std::string ShowsIn() const override {
    if constexpr (requires { Derived::kShowsIn; }) {
      return Derived::kShowsIn;
    } else {
      return "motion that its law tells from the others'";
    }
  }
  std::string Law() const override {
    if constexpr (requires { Derived::kLaw; }) {
      return Derived::kLaw;
    } else {
      return "";
    }
  }
  bool NeedsDrive() const override {
    constexpr unsigned kOfDrives = kInputHook | kInputDelayHook |
                                   kInputLagHook | kLimitHook | kReadsEffort;
    if constexpr (requires { Derived::kNeedsDrive; }) return true;
    return (hooks() & kOfDrives) != 0;
  }
  bool IsCandidate() const override {
    return !requires { Derived::kOnlyNamed; };
  }
  bool Extends() const override {
    return requires { Derived::kExtends; };
  }

  const EffectHooks<double>& HooksFor(ScalarTag<double>) const final {
    return double_;
  }
  const EffectHooks<Jet8>& HooksFor(ScalarTag<Jet8>) const final {
    return jet8_;
  }
  const EffectHooks<Jet16>& HooksFor(ScalarTag<Jet16>) const final {
    return jet16_;
  }
  const EffectHooks<Jet24>& HooksFor(ScalarTag<Jet24>) const final {
    return jet24_;
  }

  // Forwards the virtual calls of one scalar to the derived class.
  template <typename T>
  class Forward final : public EffectHooks<T> {
   public:
    explicit Forward(const EffectOf& effect)
        : effect_(static_cast<const Derived&>(effect)) {}
    void AddEffort(const JointState<T>& joint, const T* p,
                   T* tau) const override {
      effect_.template AddEffort<T>(joint, p, tau);
    }
    T DryFriction(const JointState<T>& joint, const T* p,
                  const T& speed) const override {
      return effect_.template DryFriction<T>(joint, p, speed);
    }
    void AddBesideDry(const JointState<T>& joint, const T* p,
                      T* tau) const override {
      effect_.template AddBesideDry<T>(joint, p, tau);
    }
    void LimitDrive(const JointState<T>& joint, const T* p,
                    T* effort) const override {
      effect_.template LimitDrive<T>(joint, p, effort);
    }
    void AddJointInertia(const T* p, T* inertia) const override {
      effect_.template AddJointInertia<T>(p, inertia);
    }
    T Ratio(const T* p) const override { return effect_.template Ratio<T>(p); }
    T PairInertia(const T* p) const override {
      return effect_.template PairInertia<T>(p);
    }
    T PairEffort(const T& z_rate, const T* p) const override {
      return effect_.template PairEffort<T>(z_rate, p);
    }
    void ModifyGravity(const T* inputs, const T* p,
                       Vector3<T>* gravity) const override {
      effect_.template ModifyGravity<T>(inputs, p, gravity);
    }
    void AddLinkForce(const LinkState<T>& link, const T* p,
                      Vector3<T>* force) const override {
      effect_.template AddLinkForce<T>(link, p, force);
    }
    void ModifyInput(const T* p, T* tau) const override {
      effect_.template ModifyInput<T>(p, tau);
    }
    void AddInputDelay(const T* p, T* delay) const override {
      effect_.template AddInputDelay<T>(p, delay);
    }
    void AddInputLag(const T* p, T* lag) const override {
      effect_.template AddInputLag<T>(p, lag);
    }
    void AddOwnDelay(const T* p, T* delay) const override {
      effect_.template AddOwnDelay<T>(p, delay);
    }
    void ModifyMeasurement(const JointRates<T>& rates, const T* p,
                           T* q) const override {
      effect_.template ModifyMeasurement<T>(rates, p, q);
    }

   private:
    const Derived& effect_;
  };

 protected:
  EffectOf(const std::string& kind, unsigned hooks, const Mechanism& mechanism,
           const std::string& target)
      : Effect(kind, hooks, Derived::kTarget, mechanism, target) {}
  EffectOf(const EffectOf&) = delete;
  EffectOf& operator=(const EffectOf&) = delete;

 private:
  Forward<double> double_{*this};
  Forward<Jet8> jet8_{*this};
  Forward<Jet16> jet16_{*this};
  Forward<Jet24> jet24_{*this};
};

}  // namespace sysid
