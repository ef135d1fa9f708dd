#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "models/effects/hooks.h"
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

// Behind a joint's name: its motor, whose sensor (column J.motor_q) is another
// than the joint's own.
inline constexpr char kOfMotor[] = ".motor";

// A parameter of an effect, in SI units.
struct EffectParameter {
  std::string name;            // "joint1.friction"
  std::string unit;            // "N m", "-" where it has none
  double null_value = 0.0;     // where it starts; the effect is off there
  double typical_scale = 1.0;  // a plausible size, for scaling and searching
  // Where a fit starts instead of at null: a law that is off there shows
  // nothing of itself.
  std::optional<double> start;
  double lower = 0.0;  // physical bounds; +-infinity where none
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

// A number of an effect's own state z, which is part of the model's state
// beside q and qd: its internal state.
struct EffectState {
  std::string name;            // "joint1.presliding"
  std::string unit;            // "-" where it has none
  double typical_scale = 1.0;  // how far it is from zero
};

// What an effect reads that is recorded beside efforts and measurements: a
// column of the run by its name (docs/interface.md section 2), or "t".
struct EffectInput {
  std::string name;  // "joint1.cmd"
  std::string unit;
};

class Effect {
 public:
  virtual ~Effect() = default;

  const std::string& kind() const { return kind_; }      // "coulomb_friction"
  const std::string& target() const { return target_; }  // "joint1"
  std::string name() const { return kind_ + "@" + target_ + rest_; }
  unsigned hooks() const { return hooks_; }
  int joint() const { return joint_; }  // target's index, -1 if not a joint
  // Whether the target is the joint's motor: "joint1.motor".
  bool on_motor() const { return on_motor_; }
  int second_joint() const { return second_joint_; }  // of a pair, else -1
  int link() const { return link_; }  // target's index, -1 if not a link
  const std::vector<EffectParameter>& parameters() const { return parameters_; }
  const std::vector<EffectInput>& inputs() const { return inputs_; }
  const std::vector<EffectState>& states() const { return states_; }
  // Joints, hinges or slides, that it reads beside its own.
  const std::vector<int>& other_joints() const { return other_joints_; }
  // Whether JointState has more for it than q and qd.
  bool ReadsMore() const {
    return (hooks_ & (kReadsEffort | kDriveHook | kLimitHook)) != 0 ||
           !inputs_.empty() || !other_joints_.empty() || !states_.empty();
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
  // Whether checks of the data try it, too: the common ones. (Not with a
  // kOnlyNamed of the derived class.)
  virtual bool IsCandidate() const = 0;
  // Whether it is only tried where an effect whose parameters it shares is in
  // the model. (A kExtends of the derived class.)
  virtual bool Extends() const = 0;
  // Whether a user typed its law, and so the names of its parameters, which say
  // nothing about those of other effects. (A kTyped of the derived class.)
  virtual bool IsTyped() const = 0;

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
  // Of a hinge or slide, with the hook that says how it moves. The unit as in
  // AddParameter.
  void AddState(const std::string& name, const std::string& unit,
                double typical_scale);
  void SetStart(int i, double value) { parameters_[i].start = value; }
  // What the name has behind the target.
  void SetRestOfName(const std::string& rest) { rest_ = rest; }

  bool IsPrismatic() const { return prismatic_; }

 private:
  std::string UnitOf(const std::string& unit) const;

  std::string kind_;
  std::string target_;
  std::string rest_;
  unsigned hooks_;
  int joint_ = -1, second_joint_ = -1;
  bool on_motor_ = false;
  int link_ = -1;
  bool prismatic_ = false;
  std::vector<EffectParameter> parameters_;
  std::vector<EffectInput> inputs_;
  std::vector<EffectState> states_;
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
  void StateRate(const JointState<T>&, const T*, T*) const {}
  template <typename T>
  void MoveState(const JointState<T>&, const JointState<T>&, const T*,
                 T*) const {}
  template <typename T>
  void StartState(const JointState<T>&, const T*, T*) const {}
  template <typename T>
  void ToMotor(const T*, const T*, const T*, T*, T*, T*) const {}
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
  bool IsTyped() const override {
    return requires { Derived::kTyped; };
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
    void StateRate(const JointState<T>& joint, const T* p,
                   T* rate) const override {
      effect_.template StateRate<T>(joint, p, rate);
    }
    void MoveState(const JointState<T>& from, const JointState<T>& to,
                   const T* p, T* z) const override {
      effect_.template MoveState<T>(from, to, p, z);
    }
    void StartState(const JointState<T>& joint, const T* p,
                    T* z) const override {
      effect_.template StartState<T>(joint, p, z);
    }
    void ToMotor(const T* z, const T* z_rate, const T* p, T* q, T* qd,
                 T* qdd) const override {
      effect_.template ToMotor<T>(z, z_rate, p, q, qd, qdd);
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
