#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "models/effects/effect.h"
#include "models/formula/formula.h"

namespace sysid {

// What is wrong with a law that a user typed.
class LawFault : public std::runtime_error {
 public:
  LawFault(const std::string& what, const std::string& hint)
      : std::runtime_error(what), hint_(hint) {}
  const std::string& hint() const { return hint_; }

 private:
  std::string hint_;
};

// A generalised force that a user typed (docs/interface.md section 5):
//   custom@joint1: -k*q^3 - b*abs(qd)*qd
// q, qd are the joint's, tau what its drive gives, t the time; joint2.q,
// joint2.qd another joint's; joint1.cmd, joint1.temperature, base.ax and the
// names of own columns are inputs. Other names are parameters, joint1.k.
//
// Those parameters in which the law is linear, as many as can be together, are
// zero at null, so that it is off; the others (v of c*tanh(qd/v)) are searched
// around one, and positive where they divide, as that v.
// A law that no parameter switches off is refused.
class CustomLaw : public EffectOf<CustomLaw> {
 public:
  static constexpr char kName[] = "custom";
  static constexpr TargetKind kTarget = TargetKind::kJoint;
  static constexpr char kShowsIn[] = "motion in which its terms differ";
  static constexpr bool kOnlyNamed = true;
  static constexpr bool kTyped = true;

  // `target`: "joint1: -k*q^3". Throws LawFault.
  CustomLaw(const Mechanism& mechanism, const std::string& target);

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  std::string Law() const override { return text_; }

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T* p, T* tau) const {
    thread_local std::vector<T> names, scratch;
    const size_t known = sources_.size(), count = formula_.parameters.size();
    if (names.size() < known + count) names.resize(known + count);
    if (static_cast<int>(scratch.size()) < formula_.tree.size()) {
      scratch.resize(formula_.tree.size());
    }
    for (size_t i = 0; i < known; ++i) names[i] = Value(joint, sources_[i]);
    for (size_t i = 0; i < count; ++i) names[known + i] = p[i];
    tau[0] += formula_.tree.Evaluate<T>(names.data(), scratch.data());
  }

 private:
  // Where a known name's value is.
  struct Source {
    enum class Of { kQ, kQd, kEffort, kInput, kOtherQ, kOtherQd } of;
    int index = 0;  // of an input; in all_q or all_qd
  };
  struct Vocabulary;
  struct Parsed;
  static Parsed Parse(const Mechanism& mechanism, const std::string& target);
  CustomLaw(const Mechanism& mechanism, Parsed parsed);

  template <typename T>
  static T Value(const JointState<T>& joint, const Source& source) {
    switch (source.of) {
      case Source::Of::kQ:
        return joint.q[0];
      case Source::Of::kQd:
        return joint.qd[0];
      case Source::Of::kEffort:
        return joint.effort[0];
      case Source::Of::kInput:
        return joint.inputs[source.index];
      case Source::Of::kOtherQ:
        return joint.all_q[source.index];
      default:
        return joint.all_qd[source.index];
    }
  }

  std::string text_;
  Formula formula_;
  std::vector<Source> sources_;  // of the known names that the formula reads
};

}  // namespace sysid
