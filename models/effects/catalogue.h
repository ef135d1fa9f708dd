#pragma once

#include <memory>
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sysid {

// The effects of a model, in the order in which they were added, and their
// parameters as one list. Copies share the (const) effects.
class EffectSet {
 public:
  // Throws InputError where the same effect is there already.
  void Add(std::shared_ptr<const Effect> effect);

  int size() const { return static_cast<int>(effects_.size()); }
  const Effect& effect(int i) const { return *effects_[i]; }
  const std::shared_ptr<const Effect>& shared(int i) const {
    return effects_[i];
  }
  // Where effect i's parameters begin in MechanismParameters::effects.
  int offset(int i) const { return offsets_[i]; }
  // Where its inputs begin among those of all effects, and how many these are.
  int first_input(int i) const { return first_inputs_[i]; }
  int input_count() const { return input_count_; }
  // The same of its states.
  int first_state(int i) const { return first_states_[i]; }
  int state_count() const { return static_cast<int>(states_.size()); }
  const std::vector<EffectState>& states() const { return states_; }
  const std::vector<EffectParameter>& parameters() const { return parameters_; }
  bool Contains(const std::string& name) const;
  std::vector<std::string> names() const;  // "coulomb_friction@joint1"

 private:
  std::vector<std::shared_ptr<const Effect>> effects_;
  std::vector<int> offsets_, first_inputs_, first_states_;
  int input_count_ = 0;
  std::vector<EffectState> states_;
  std::vector<EffectParameter> parameters_;
};

// What an effect E may leave out.
template <class E>
bool AppliesTo(JointType type) {
  if constexpr (requires { E::Applies(type); }) return E::Applies(type);
  return true;
}
template <class E>
constexpr bool IsTyped() {
  if constexpr (requires { E::kTyped; }) return E::kTyped;
  return false;
}

// Whether it may be on a joint's motor ("joint1.motor") as well: a sensor's.
template <class E>
constexpr bool IsOnMotorToo() {
  return requires { E::kOnMotorToo; };
}

// Every effect that the toolkit can plant, fit and screen. The shipped ones are
// listed in shipped_effects.h, a line each; a program may add its own.
class Catalogue {
 public:
  Catalogue();  // the shipped effects

  template <class E>
  void Add() {
    entries_.push_back(
        {E::kName, E::kTarget, AppliesTo<E>,
         [](const Mechanism& mechanism, const std::string& target) {
           return std::shared_ptr<const Effect>(new E(mechanism, target));
         },
         IsTyped<E>(), IsOnMotorToo<E>()});
  }

  // "coulomb_friction@joint1" -> the effect. `place` says in errors where the
  // name was read ("--add"). Effects on links take those without mass, too (a
  // payload). Throws InputError for a name without '@', an
  // unknown effect or target (with the nearest known), a target of the wrong
  // kind or a joint on which the effect has no meaning.
  std::shared_ptr<const Effect> Make(const std::string& name,
                                     const Mechanism& mechanism,
                                     const std::string& place) const;

  std::vector<std::string> kinds() const;
  // Every effect on every target where it has a meaning, but for laws that a
  // user types.
  std::vector<std::string> Names(const Mechanism& mechanism) const;
  // Beside those, what a sensor at the motor of a joint may have.
  std::vector<std::string> NamesOnMotor(const Mechanism& mechanism,
                                        int joint) const;
  // Those of Names that a diagnosis tries without being told, on any recording:
  // they read no inputs.
  std::vector<std::string> Candidates(const Mechanism& mechanism) const;

 private:
  struct Entry {
    std::string kind;
    TargetKind target;
    bool (*applies)(JointType);
    std::shared_ptr<const Effect> (*make)(const Mechanism&, const std::string&);
    // The name goes on behind the target, ": " and a law; `make` takes both.
    bool typed;
    bool on_motor_too;
  };
  std::vector<std::string> Targets(const Entry& entry,
                                   const Mechanism& mechanism) const;

  std::vector<Entry> entries_;
};

}  // namespace sysid
