#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "models/effects/catalogue.h"
#include "tests/support/all_joints.h"
#include "tests/support/test_name.h"

// An effect reads what it declares and nothing else: derivatives are those by
// its declared arguments (docs/decisions/0018-held-inputs.md).

namespace sysid {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsSubsetOf;

constexpr int kInputs = 8, kStates = 4;

// Everything that an effect could get hold of, by name.
struct World {
  std::vector<double> q, qd, effort, inputs, rates, states;

  explicit World(const Mechanism& mechanism) {
    // No two alike, none at rest; the ball's quaternion stays one.
    for (int i = 0; i < mechanism.nq; ++i) q.push_back(0.4 + 0.17 * i);
    for (const Joint& joint : mechanism.joints) {
      if (joint.type != JointType::kSpherical) continue;
      const double quaternion[] = {0.1, -0.5, 0.1, 0.8544003745317531};
      std::copy(quaternion, quaternion + 4, q.begin() + joint.q_index);
    }
    for (int i = 0; i < mechanism.nv; ++i) qd.push_back(0.9 - 0.31 * i);
    for (int i = 0; i < mechanism.nv; ++i) effort.push_back(2.0 + 0.3 * i);
    for (int i = 0; i < kInputs; ++i) inputs.push_back(0.7 + 0.13 * i);
    for (int i = 0; i < kStates; ++i) states.push_back(0.6 - 0.07 * i);
    for (int i = 0; i < 2 * mechanism.nv; ++i) rates.push_back(1.1 - 0.2 * i);
  }

  std::map<std::string, double*> Slots(const Mechanism& mechanism) {
    std::map<std::string, double*> slots;
    for (const Joint& joint : mechanism.joints) {
      const std::string& name = joint.name;
      for (int k = 0; k < ConfigurationSize(joint.type); ++k) {
        slots[name + ".q" + std::to_string(k)] = &q[joint.q_index + k];
      }
      for (int k = 0; k < VelocitySize(joint.type); ++k) {
        const std::string number = std::to_string(k);
        const int v = joint.v_index + k;
        slots[name + ".qd" + number] = &qd[v];
        slots[name + ".effort" + number] = &effort[v];
        slots[name + ".rate" + number] = &rates[v];
        slots[name + ".change" + number] = &rates[mechanism.nv + v];
      }
    }
    for (int k = 0; k < kInputs; ++k) {
      slots["input" + std::to_string(k)] = &inputs[k];
    }
    for (int k = 0; k < kStates; ++k) {
      slots["state" + std::to_string(k)] = &states[k];
    }
    return slots;
  }
};

// Parameters with which every part of a law acts.
std::vector<double> Acting(const Effect& effect) {
  std::vector<double> p;
  int i = 0;
  for (const EffectParameter& own : effect.parameters()) {
    double value = own.null_value + (0.6 + 0.1 * i++) * own.typical_scale;
    if (own.whole) value = own.grid.back();
    if (own.start) value = *own.start;  // off at null and near it
    p.push_back(std::min(std::max(value, own.lower), own.upper));
  }
  return p;
}

// What the hooks of the effect's mask answer. `resting`: the dry friction
// alone, which has only a speed that is passed to it.
std::vector<double> Answers(const Mechanism& mechanism, const Effect& effect,
                            const World& world, bool resting) {
  const EffectHooks<double>& h = effect.HooksFor(ScalarTag<double>());
  const std::vector<double> p = Acting(effect);
  const unsigned hooks = effect.hooks();
  std::vector<double> out;
  if (hooks & kGravityHook) {
    Eigen::Vector3d gravity(0.1, 0.2, -9.81);
    h.ModifyGravity(world.inputs.data(), p.data(), &gravity);
    out.insert(out.end(), gravity.data(), gravity.data() + 3);
  }
  if (effect.joint() < 0) return out;
  const Joint& joint = mechanism.joints[effect.joint()];
  const int nv = VelocitySize(joint.type);
  const JointState<double> state{joint.type,
                                 nv,
                                 world.q.data() + joint.q_index,
                                 world.qd.data() + joint.v_index,
                                 world.effort.data() + joint.v_index,
                                 world.inputs.data(),
                                 world.q.data(),
                                 world.qd.data(),
                                 world.states.data()};
  if (hooks & kDryFrictionHook) {
    out.push_back(h.DryFriction(state, p.data(), 0.7));
  }
  if (resting) return out;
  std::vector<double> tau(nv, 1.0);
  if (hooks & kEffortHook) h.AddEffort(state, p.data(), tau.data());
  if (hooks & kBesideDryHook) h.AddBesideDry(state, p.data(), tau.data());
  // Beyond the limit's corner, where its law still moves with the speed.
  if (hooks & kLimitHook) {
    tau[0] = 1e6;
    h.LimitDrive(state, p.data(), tau.data());
  }
  out.insert(out.end(), tau.begin(), tau.end());
  if (hooks & kStateRateHook) {
    double rates[kStates] = {};
    h.StateRate(state, p.data(), rates);
    out.insert(out.end(), rates, rates + kStates);
  }
  if (hooks & kMoveStateHook) {
    // It has the way of the joint alone; z itself comes in by the pointer.
    const double start = 0.5;
    const JointState<double> from{joint.type, nv, &start, nullptr};
    const JointState<double> to{joint.type, nv, state.q, nullptr};
    std::vector<double> moved = world.states;
    h.MoveState(from, to, p.data(), moved.data());
    out.insert(out.end(), moved.begin(),
               moved.begin() + static_cast<int>(effect.states().size()));
  }
  if (hooks & kMeasurementHook) {
    std::vector<double> measured(
        world.q.begin() + joint.q_index,
        world.q.begin() + joint.q_index + ConfigurationSize(joint.type));
    h.ModifyMeasurement({world.rates.data() + joint.v_index,
                         world.rates.data() + mechanism.nv + joint.v_index},
                        p.data(), measured.data());
    out.insert(out.end(), measured.begin(), measured.end());
  }
  return out;
}

bool Same(const std::vector<double>& a, const std::vector<double>& b) {
  for (size_t i = 0; i < a.size(); ++i) {
    if (!(a[i] == b[i])) return false;
  }
  return true;
}

// Names of what the answers depend on: what changes them when it is another
// number, or none.
std::vector<std::string> Reads(const Mechanism& mechanism, const Effect& effect,
                               bool resting = false) {
  const World given(mechanism);
  const std::vector<double> as_given =
      Answers(mechanism, effect, given, resting);
  World world = given;
  std::vector<std::string> read;
  for (const auto& [name, slot] : world.Slots(mechanism)) {
    const double value = *slot;
    for (const double other : {-value, 3.0 * value + 1.0,
                               std::numeric_limits<double>::quiet_NaN()}) {
      *slot = other;
      if (!Same(as_given, Answers(mechanism, effect, world, resting))) {
        read.push_back(name);
        break;
      }
    }
    *slot = value;
  }
  return read;
}

// What it may read of its own joint without a word, and what it declares.
std::vector<std::string> Declared(const Mechanism& mechanism,
                                  const Effect& effect) {
  std::vector<std::string> names;
  const auto add = [&](const Joint& joint, const std::string& what, int n) {
    for (int k = 0; k < n; ++k) {
      names.push_back(joint.name + what + std::to_string(k));
    }
  };
  for (size_t k = 0; k < effect.inputs().size(); ++k) {
    names.push_back("input" + std::to_string(k));
  }
  for (size_t k = 0; k < effect.states().size(); ++k) {
    names.push_back("state" + std::to_string(k));
  }
  if (effect.joint() < 0) return names;
  std::vector<int> joints = effect.other_joints();
  joints.push_back(effect.joint());
  for (const int j : joints) {
    const Joint& joint = mechanism.joints[j];
    add(joint, ".q", ConfigurationSize(joint.type));
    add(joint, ".qd", VelocitySize(joint.type));
  }
  const Joint& own = mechanism.joints[effect.joint()];
  if (effect.hooks() & kReadsEffort) add(own, ".effort", 1);
  if (effect.hooks() & kRatesHook) {
    add(own, ".rate", VelocitySize(own.type));
    add(own, ".change", VelocitySize(own.type));
  }
  return names;
}

// Of the declared ones those that are the effort, inputs and other joints.
std::vector<std::string> DeclaredBeside(const Mechanism& mechanism,
                                        const Effect& effect) {
  std::vector<std::string> names;
  const std::string own =
      effect.joint() < 0 ? "" : mechanism.joints[effect.joint()].name + ".q";
  for (const std::string& name : Declared(mechanism, effect)) {
    if (own.empty() || !name.starts_with(own)) names.push_back(name);
  }
  return names;
}

class EffectReads : public ::testing::TestWithParam<std::string> {
 protected:
  const Mechanism mechanism_ = AllJoints();
  const std::shared_ptr<const Effect> effect_ =
      Catalogue().Make(GetParam(), mechanism_, "test");
};

TEST_P(EffectReads, NothingThatItDoesNotDeclare) {
  EXPECT_THAT(Reads(mechanism_, *effect_),
              IsSubsetOf(Declared(mechanism_, *effect_)));
}

TEST_P(EffectReads, EachInputAndTheEffortThatItDeclares) {
  const std::vector<std::string> read = Reads(mechanism_, *effect_);
  for (const std::string& name : DeclaredBeside(mechanism_, *effect_)) {
    // Of another joint one of its two, of its own sensor's rates too.
    if (name.find(".q") != std::string::npos ||
        name.find(".rate") != std::string::npos ||
        name.find(".change") != std::string::npos) {
      continue;
    }
    EXPECT_THAT(read, Contains(name));
  }
  for (const int j : effect_->other_joints()) {
    const std::string& other = mechanism_.joints[j].name;
    EXPECT_THAT(read, testing::AnyOf(Contains(other + ".q0"),
                                     Contains(other + ".qd0")));
  }
  if (effect_->hooks() & kRatesHook) {
    EXPECT_THAT(read,
                Contains(mechanism_.joints[effect_->joint()].name + ".rate0"));
  }
}

// A step asks for the level of a joint that rests.
TEST_P(EffectReads, NoMotionInTheLevelOfItsDryFriction) {
  for (const std::string& name : Reads(mechanism_, *effect_, true)) {
    EXPECT_THAT(name, testing::Not(testing::HasSubstr(".q")));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Catalogue, EffectReads, ::testing::ValuesIn([] {
      std::vector<std::string> names = Catalogue().Names(AllJoints());
      for (const char* formula :
           {"-k*q^3", "-b*tau*tanh(slide.qd/v)", "a*oil*wheel.q", "f*t"}) {
        names.push_back(std::string("custom@hinge: ") + formula);
      }
      return names;
    }()),
    [](const ::testing::TestParamInfo<std::string>& info) {
      return TestName(info.param);
    });

// --- That such a law would be found -----------------------------------------

// Reads one thing too many, by its template argument.
enum class Steals {
  kEffort,
  kInput,
  kOtherJoint,
  kRates,
  kRestingSpeed,
  kState,
};

template <Steals what>
class Thief : public EffectOf<Thief<what>> {
 public:
  static constexpr TargetKind kTarget = TargetKind::kJoint;

  Thief(const Mechanism& mechanism, const std::string& joint)
      : EffectOf<Thief>("thief",
                        kEffortHook | kMeasurementHook | kDryFrictionHook,
                        mechanism, joint) {}

  template <typename T>
  void AddEffort(const JointState<T>& joint, const T*, T* tau) const {
    if (what == Steals::kEffort) tau[0] += joint.effort[0];
    if (what == Steals::kInput) tau[0] += joint.inputs[1];
    if (what == Steals::kState) tau[0] += joint.z[0];
    // A comparison swallows what is no number, but not another one.
    if (what == Steals::kOtherJoint && joint.all_qd[0] > 0.0) tau[0] += 1.0;
  }
  template <typename T>
  void ModifyMeasurement(const JointRates<T>& rates, const T*, T* q) const {
    if (what == Steals::kRates) q[0] += rates.qdd[0];
  }
  template <typename T>
  T DryFriction(const JointState<T>& joint, const T*, const T&) const {
    return what == Steals::kRestingSpeed ? joint.qd[0] : T(1.0);
  }
};

template <Steals what>
std::vector<std::string> Stolen(bool resting = false) {
  const Mechanism mechanism = AllJoints();
  return Reads(mechanism, Thief<what>(mechanism, "hinge"), resting);
}

TEST(EffectReadsWithoutAWord, IsFound) {
  EXPECT_THAT(Stolen<Steals::kEffort>(), Contains("hinge.effort0"));
  EXPECT_THAT(Stolen<Steals::kInput>(), Contains("input1"));
  EXPECT_THAT(Stolen<Steals::kOtherJoint>(), Contains("slide.qd0"));
  EXPECT_THAT(Stolen<Steals::kRates>(), Contains("hinge.change0"));
  EXPECT_THAT(Stolen<Steals::kState>(), Contains("state0"));
  EXPECT_THAT(Stolen<Steals::kRestingSpeed>(true), ElementsAre("hinge.qd0"));
}

}  // namespace
}  // namespace sysid
