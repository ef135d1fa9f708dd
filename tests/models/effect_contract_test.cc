#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>

#include "models/dynamics.h"
#include "models/effects/catalogue.h"
#include "models/effects/coulomb_friction.h"
#include "models/math/rotation.h"
#include "models/parameters.h"
#include "tests/support/all_joints.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"
#include "tests/support/test_name.h"

namespace sysid {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// What docs/effects.md promises of every effect, for each on every target.

// Parameters by kind: docs/interface.md section 5, "J." or "L." left out, and
// section 3 for what is wrong in the nominal values.
std::vector<std::string> TableNames() {
  std::vector<std::string> names;
  for (const char i : std::string("0123456")) {
    for (const char j : std::string("0123456")) {
      names.push_back(std::string("table_") + i + "_" + j);
    }
  }
  for (const char* range : {"below", "above", "speed"}) {
    names.push_back(std::string("table_") + range);
  }
  return names;
}

const std::map<std::string, std::vector<std::string>>& ContractTable() {
  static const auto& table =
      *new std::map<std::string, std::vector<std::string>>{
          {"viscous_damping", {"damping"}},
          {"coulomb_friction", {"friction"}},
          {"stribeck_friction",
           {"friction", "static_friction", "stribeck_velocity"}},
          {"quadratic_drag", {"quadratic_drag"}},
          {"spring", {"stiffness", "spring_reference"}},
          {"armature", {"armature"}},
          {"effort_bias", {"effort_bias"}},
          {"effort_gain", {"effort_gain"}},
          {"effort_delay", {"effort_delay"}},
          {"cogging", {"cogging_sin", "cogging_cos", "cogging_order"}},
          {"gravity_tilt", {"gravity_tilt_x", "gravity_tilt_y"}},
          {"sensor_offset", {"sensor_offset"}},
          {"aerodynamic_drag", {"drag"}},
          {"mass", {"mass"}},
          {"com", {"com_x", "com_y", "com_z"}},
          {"inertia", {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}},
          {"position_drive", {"kp", "kd", "drive_delay"}},
          {"base_motion", {"base_motion_gain"}},
          {"load_friction", {"load_friction"}},
          {"load_stribeck_friction",
           {"load_friction", "static_load_friction", "load_stribeck_velocity"}},
          {"gear_efficiency", {"loss_driving", "loss_driven"}},
          {"asymmetric_friction",
           {"friction", "damping", "friction_asymmetry", "damping_asymmetry"}},
          {"cubic_damping", {"cubic_damping"}},
          {"thermal_friction", {"friction", "damping", "thermal_rate"}},
          {"actuator_lag", {"actuator_lag"}},
          {"effort_limit", {"effort_limit", "inverse_no_load_speed"}},
          {"sensor_gain", {"sensor_gain"}},
          {"sensor_delay", {"sensor_delay"}},
          {"transmission_error",
           {"transmission_sin", "transmission_cos", "transmission_order"}},
          {"custom", {"k", "b", "v"}},
          {"gear_coupling",
           {"coupling_armature", "coupling_damping", "coupling_friction",
            "coupling_sign"}},
          {"presliding_friction", {"presliding_friction", "presliding_length"}},
          {"joint_elasticity",
           {"drive_stiffness", "drive_damping", "motor_inertia"}},
          {"backlash",
           {"drive_stiffness", "drive_damping", "motor_inertia", "backlash"}},
          {"force_table", TableNames()},
      };
  return table;
}

// How what an effect remembers moves; it may where the effect is off.
constexpr unsigned kStateHooks = kStateRateHook | kMoveStateHook;

// Off at a stiffness or a limit that nothing reaches, and found by secants.
bool IsOffFarAway(const Effect& effect) {
  return effect.kind() == "effort_limit" ||
         effect.kind() == "joint_elasticity" || effect.kind() == "backlash";
}

// What each hook of the effect answers at generic values, in one row.
template <typename T>
std::vector<T> Answers(const Mechanism& mechanism, const Effect& effect,
                       unsigned hooks, const std::vector<T>& p) {
  const EffectHooks<T>& h = effect.HooksFor(ScalarTag<T>());
  Random random(1);
  const RandomState x(mechanism, &random);
  std::vector<T> q(x.q.data(), x.q.data() + x.q.size());
  std::vector<T> qd;
  // None near rest: friction would show nothing.
  for (const double rate : x.qd) {
    qd.emplace_back(rate + std::copysign(0.5, rate));
  }
  std::vector<T> out;
  const std::vector<T> inputs(8, T(0.7));
  if (effect.joint() >= 0) {
    const Joint& joint = mechanism.joints[effect.joint()];
    const T effort(2.0);
    const T z[2] = {T(0.3), T(-0.2)};
    const JointState<T> state{joint.type,
                              VelocitySize(joint.type),
                              q.data() + joint.q_index,
                              qd.data() + joint.v_index,
                              &effort,
                              inputs.data(),
                              q.data(),
                              qd.data(),
                              z};
    if (hooks & kEffortHook) {
      std::vector<T> tau(state.nv, T(1.0));
      h.AddEffort(state, p.data(), tau.data());
      out.insert(out.end(), tau.begin(), tau.end());
    }
    if (hooks & kDryFrictionHook) {
      out.push_back(h.DryFriction(state, p.data(), T(0.7)));
    }
    if (hooks & kBesideDryHook) {
      T tau(1.0);
      h.AddBesideDry(state, p.data(), &tau);
      out.push_back(tau);
    }
    if (hooks & kLimitHook) {
      T given(5.0);
      h.LimitDrive(state, p.data(), &given);
      out.push_back(given);
    }
    if (hooks & kStateRateHook) {
      T rate[2] = {T(1.0), T(2.0)};
      h.StateRate(state, p.data(), rate);
      out.insert(out.end(), rate, rate + 2);
    }
    if (hooks & kMoveStateHook) {
      const T there = q[joint.q_index] + 0.004;
      JointState<T> to = state;
      to.q = &there;
      T moved[2] = {z[0], z[1]};
      h.MoveState(state, to, p.data(), moved);
      out.insert(out.end(), moved, moved + 2);
    }
    if (hooks & kMotorHook) {
      T motor[3] = {T(0.1), T(0.2), T(0.3)};
      h.ToMotor(z, z, p.data(), motor, motor + 1, motor + 2);
      out.insert(out.end(), motor, motor + 3);
    }
    if (hooks & kPairHook) {
      out.push_back(h.PairInertia(p.data()));
      out.push_back(h.PairEffort(T(0.7), p.data()));
    }
    if (hooks & kInputLagHook) {
      T lag(1.0);
      h.AddInputLag(p.data(), &lag);
      out.push_back(lag);
    }
    if (hooks & kJointInertiaHook) {
      T inertia(1.0);
      h.AddJointInertia(p.data(), &inertia);
      out.push_back(inertia);
    }
    if (hooks & kMeasurementHook) {
      std::vector<T> measured(
          q.begin() + joint.q_index,
          q.begin() + joint.q_index + ConfigurationSize(joint.type));
      h.ModifyMeasurement({state.qd, state.qd}, p.data(), measured.data());
      out.insert(out.end(), measured.begin(), measured.end());
    }
    if (hooks & kInputHook) {
      std::vector<T> tau;
      for (int i = 0; i < VelocitySize(joint.type); ++i) {
        tau.push_back(T(i + 1));
      }
      h.ModifyInput(p.data(), tau.data());
      out.insert(out.end(), tau.begin(), tau.end());
    }
  }
  if (hooks & kGravityHook) {
    Vector3<T> gravity(T(0.0), T(0.0), T(-9.81));
    h.ModifyGravity(inputs.data(), p.data(), &gravity);
    out.insert(out.end(), gravity.data(), gravity.data() + 3);
  }
  if (hooks & kLinkForceHook) {
    LinkState<T> state;
    state.v_com = Vector3<T>(T(1.0), T(-2.0), T(0.5));
    state.w = Vector3<T>(T(0.3), T(0.7), T(-1.1));
    state.R_WL = ToMatrix<double>(random.Rotation()).template cast<T>();
    Vector3<T> force(T(1.0), T(1.0), T(1.0));
    h.AddLinkForce(state, p.data(), &force);
    out.insert(out.end(), force.data(), force.data() + 3);
  }
  if (hooks & kInputDelayHook) {
    T delay(1.0);
    h.AddInputDelay(p.data(), &delay);
    out.push_back(delay);
  }
  if (hooks & kOwnDelayHook) {
    T delay(1.0);
    h.AddOwnDelay(p.data(), &delay);
    out.push_back(delay);
  }
  return out;
}

constexpr unsigned kAllHooks =
    kEffortHook | kJointInertiaHook | kGravityHook | kLinkForceHook |
    kInputHook | kInputDelayHook | kMeasurementHook | kDryFrictionHook |
    kBesideDryHook | kLimitHook | kInputLagHook | kOwnDelayHook | kPairHook |
    kStateHooks | kMotorHook;

std::vector<double> NullValues(const Effect& effect) {
  std::vector<double> p;
  for (const EffectParameter& parameter : effect.parameters()) {
    p.push_back(parameter.null_value);
  }
  return p;
}

// The same hooks, asked of an effect that does nothing.
template <TargetKind kind>
class Nothing : public EffectOf<Nothing<kind>> {
 public:
  static constexpr TargetKind kTarget = kind;
  Nothing(const Mechanism& mechanism, const std::string& target)
      : EffectOf<Nothing>("nothing", 0, mechanism, target) {}
};

class EffectContract : public ::testing::TestWithParam<std::string> {
 protected:
  // Nothing, on the same target.
  const Effect& LikeEffect() const {
    if (effect_->joint() >= 0) return on_joint_;
    return effect_->link() >= 0 ? static_cast<const Effect&>(on_link_)
                                : static_cast<const Effect&>(on_base_);
  }

  const Mechanism mechanism_ = AllJoints();
  const Catalogue catalogue_;
  const std::shared_ptr<const Effect> effect_ =
      catalogue_.Make(GetParam(), mechanism_, "test");
  const Nothing<TargetKind::kJoint> on_joint_{mechanism_, effect_->target()};
  const Nothing<TargetKind::kLink> on_link_{mechanism_, effect_->target()};
  const Nothing<TargetKind::kBase> on_base_{mechanism_, effect_->target()};
};

TEST_P(EffectContract, IsNamedAsInTheContract) {
  const std::string& kind = effect_->kind();
  EXPECT_EQ(effect_->name(), GetParam());
  ASSERT_TRUE(ContractTable().contains(kind))
      << kind << " is not in docs/interface.md section 5";
  const bool base = effect_->target() == "base";
  EXPECT_EQ(base, effect_->joint() < 0 && effect_->link() < 0);
  std::vector<std::string> expected;
  for (const std::string& name : ContractTable().at(kind)) {
    // One moment shows of a wheel on a slide.
    if (GetParam() == "inertia@rim") {
      expected = {"rim.inertia_scale"};
      break;
    }
    // A rotation has no number that its reference could be.
    if (name == "spring_reference" && effect_->target() == "ball") continue;
    // A pair of joints: of the first.
    const std::string target =
        effect_->target().substr(0, effect_->target().find(','));
    expected.push_back(base ? name : target + "." + name);
  }
  EXPECT_EQ(effect_->ParameterNames(), expected);
}

TEST_P(EffectContract, CorrectsParametersThatTheMechanismHas) {
  std::vector<std::string> known;
  for (const Parameter& parameter : AllParameters(Model(mechanism_))) {
    known.push_back(parameter.name);
  }
  EXPECT_THAT(known, ::testing::IsSupersetOf(effect_->adjusts_nominal()));
  EXPECT_FALSE(effect_->ParameterNames().empty());
  // One that only corrects has nothing to hook into.
  EXPECT_EQ(effect_->parameters().empty(), effect_->hooks() == 0);
}

TEST_P(EffectContract, HasParametersWithUnitsScalesAndBoundsAroundNull) {
  for (const EffectParameter& parameter : effect_->parameters()) {
    SCOPED_TRACE(parameter.name);
    EXPECT_THAT(parameter.unit, Not(IsEmpty()));
    EXPECT_THAT(parameter.unit, Not(Contains('{')));
    EXPECT_TRUE(std::isfinite(parameter.null_value));
    EXPECT_TRUE(std::isfinite(parameter.typical_scale));
    EXPECT_GT(parameter.typical_scale, 0.0);
    EXPECT_LE(parameter.lower, parameter.null_value);
    EXPECT_GE(parameter.upper, parameter.null_value);
    EXPECT_LT(parameter.lower, parameter.upper);
    EXPECT_TRUE(!parameter.whole || !parameter.grid.empty());
    for (const double value : parameter.grid) {
      EXPECT_LE(parameter.lower, value);
      EXPECT_GE(parameter.upper, value);
      EXPECT_TRUE(!parameter.whole || value == std::round(value));
    }
  }
  EXPECT_THAT(effect_->ShowsIn(), Not(IsEmpty()));
  EXPECT_THAT(effect_->Law(), Not(IsEmpty()));
}

TEST_P(EffectContract, DoesNothingAtAllAtNull) {
  Random random(1);
  const RandomState x(mechanism_, &random);
  Model model(mechanism_);
  Workspace<double> plain(model);
  Model changed(mechanism_);
  changed.AddEffect(effect_);
  Workspace<double> ws(changed);
  VectorXd qdd(mechanism_.nv), plain_qdd(mechanism_.nv);
  VectorXd held = VectorXd::Ones(changed.held_size());
  held.head(mechanism_.nv) = x.tau;
  ASSERT_TRUE(ForwardDynamics<double>(&plain, x.q.data(), x.qd.data(),
                                      x.tau.data(), plain_qdd.data()));
  ASSERT_TRUE(ForwardDynamics<double>(&ws, x.q.data(), x.qd.data(), held.data(),
                                      qdd.data()));
  if (effect_->hooks() & kJointInertiaHook) {
    // Another way through ABA at a spherical joint: equal but for rounding.
    EXPECT_LT((qdd - plain_qdd).norm(), 1e-12 * plain_qdd.norm());
  } else {
    EXPECT_EQ(qdd, plain_qdd);
  }
  // Hook by hook, exactly: what came in goes out.
  const unsigned hooks = effect_->hooks() & ~kStateHooks;
  EXPECT_EQ(Answers<double>(mechanism_, *effect_, hooks, NullValues(*effect_)),
            Answers<double>(mechanism_, LikeEffect(), hooks, {}));
}

// The inner loop asks only those that the mask names: a hook that is written
// but not in the mask would be dead.
TEST_P(EffectContract, ActsOnlyThroughTheHooksOfItsMask) {
  std::vector<double> p = NullValues(*effect_);
  for (size_t i = 0; i < p.size(); ++i) {
    p[i] += effect_->parameters()[i].typical_scale;
  }
  const unsigned others = kAllHooks & ~effect_->hooks();
  EXPECT_EQ(Answers<double>(mechanism_, *effect_, others, p),
            Answers<double>(mechanism_, LikeEffect(), others, {}));
}

TEST_P(EffectContract, HasTheDerivativeOfDifferencesAtNullAndNearIt) {
  const int size = static_cast<int>(effect_->parameters().size());
  constexpr int kWidth = 8;
  for (const double shift : {0.0, 0.9}) {
    std::vector<double> at = NullValues(*effect_);
    for (int i = 0; i < size; ++i) {
      at[i] += shift * effect_->parameters()[i].typical_scale;
    }
    std::vector<Jet8> jets;
    for (int i = 0; i < size; ++i) {
      if (i % kWidth == 0) {
        std::vector<Jet8> seeded(at.begin(), at.end());
        for (int k = i; k < std::min(size, i + kWidth); ++k) {
          seeded[k].v[k - i] = 1.0;
        }
        jets = Answers<Jet8>(mechanism_, *effect_, effect_->hooks(), seeded);
      }
      const double step = 0.1 * effect_->parameters()[i].typical_scale;
      const auto d = RiddersDifference(
          [&](double h) {
            std::vector<double> p = at;
            p[i] += h;
            const std::vector<double> answers =
                Answers<double>(mechanism_, *effect_, effect_->hooks(), p);
            VectorXd out(answers.size());
            for (size_t k = 0; k < answers.size(); ++k) out[k] = answers[k];
            return out;
          },
          step);
      for (size_t k = 0; k < jets.size(); ++k) {
        const double by_jets = jets[k].v[i % kWidth];
        ASSERT_TRUE(std::isfinite(by_jets));
        // Answers of order 10 over steps down to a twentieth of `step`, and
        // what the tableau makes of their rounding.
        const double rounding = 1000 * 10 * kEpsilon / step;
        EXPECT_NEAR(by_jets, d.value[k], rounding + 1e-9 * std::abs(d.value[k]))
            << effect_->parameters()[i].name << ", answer " << k;
      }
    }
  }
}

// What screening lives on: at null a first parameter that does nothing to first
// order could never be found.
TEST_P(EffectContract, IsVisibleAtNullToFirstOrderInItsFirstParameter) {
  if (effect_->hooks() == 0) return;  // acts through the nominal values
  if (IsOffFarAway(*effect_)) return;
  const std::vector<double> at = NullValues(*effect_);
  std::vector<Jet8> seeded(at.begin(), at.end());
  seeded[0].v[0] = 1.0;
  double largest = 0.0;
  for (const Jet8& answer :
       Answers<Jet8>(mechanism_, *effect_, effect_->hooks(), seeded)) {
    largest = std::max(largest, std::abs(answer.v[0]));
  }
  EXPECT_GT(largest * effect_->parameters()[0].typical_scale, 1e-4);
}

// --- How it is screened

// What the law does at p, less what comes in.
VectorXd Change(const Mechanism& mechanism, const Effect& effect,
                const std::vector<double>& p) {
  const auto at = [&](const std::vector<double>& values) {
    const std::vector<double> answers = Answers<double>(
        mechanism, effect, effect.hooks() & ~(kOwnDelayHook | kStateHooks),
        values);
    return VectorXd(Eigen::Map<const VectorXd>(answers.data(), answers.size()));
  };
  return at(p) - at(NullValues(effect));
}

// The derivative that a probe stands for, by Jets, or by its secant.
VectorXd ProbeDerivative(const Mechanism& mechanism, const Effect& effect,
                         const Probe& probe) {
  if (probe.secant != 0.0) {
    std::vector<double> p = probe.at;
    p[probe.along] += probe.secant;
    return Change(mechanism, effect, p) / probe.secant;
  }
  std::vector<Jet8> seeded(probe.at.begin(), probe.at.end());
  seeded[probe.along].v[0] = 1.0;
  const std::vector<Jet8> answers =
      Answers<Jet8>(mechanism, effect,
                    effect.hooks() & ~(kOwnDelayHook | kStateHooks), seeded);
  VectorXd derivative(answers.size());
  for (size_t k = 0; k < answers.size(); ++k) derivative[k] = answers[k].v[0];
  return derivative;
}

TEST_P(EffectContract, HasProbesOfEveryPointOfItsGridsOnly) {
  size_t points = effect_->parameters().empty() ? 0 : 1;
  for (const EffectParameter& parameter : effect_->parameters()) {
    if (!parameter.grid.empty()) points *= parameter.grid.size();
  }
  // Delays are tried by secants instead.
  if (effect_->kind() == "effort_delay") points = 6;
  if (effect_->kind() == "actuator_lag") points = 5;
  if (effect_->kind() == "effort_limit") points = 31;
  if (effect_->kind() == "joint_elasticity") points = 21;
  if (effect_->kind() == "backlash") points = 42;
  EXPECT_EQ(effect_->ProbeSets().size(), points);
  for (const ProbeSet& probes : effect_->ProbeSets()) {
    EXPECT_THAT(probes, Not(IsEmpty()));
  }
}

TEST_P(EffectContract, IsOffWhereItIsProbed) {
  // A delay of inputs that nothing multiplies does nothing.
  const unsigned hooks = effect_->hooks() & ~(kOwnDelayHook | kStateHooks);
  const auto off = Answers<double>(mechanism_, LikeEffect(), hooks, {});
  for (const ProbeSet& probes : effect_->ProbeSets()) {
    for (const Probe& probe : probes) {
      ASSERT_EQ(probe.at.size(), effect_->parameters().size());
      ASSERT_LT(probe.along, static_cast<int>(probe.at.size()));
      EXPECT_EQ(Answers<double>(mechanism_, *effect_, hooks, probe.at), off);
      const EffectParameter& along = effect_->parameters()[probe.along];
      EXPECT_TRUE(along.grid.empty()) << along.name << " is searched";
      EXPECT_LE(probe.at[probe.along] + probe.secant, along.upper);
    }
  }
}

// What is added to the values of no weights is what the weights say.
TEST_P(EffectContract, ComesOfSecantsFromNull) {
  for (const ProbeSet& probes : effect_->ProbeSets()) {
    const std::vector<double> none(probes.size(), 0.0);
    for (size_t i = 0; i < probes.size(); ++i) {
      const Probe& probe = probes[i];
      if (probe.secant == 0.0) continue;
      const int along = probe.along;
      EXPECT_EQ(effect_->FromProbes(probes, none)[along], probe.at[along]);
      std::vector<double> whole = none;
      whole[i] = probe.secant;
      EXPECT_EQ(effect_->FromProbes(probes, whole)[along],
                probe.at[along] + probe.secant);
    }
  }
}

TEST_P(EffectContract, HasTheDerivativeOfDifferencesWhereItIsProbed) {
  if (IsOffFarAway(*effect_)) return;
  for (const ProbeSet& probes : effect_->ProbeSets()) {
    for (const Probe& probe : probes) {
      const double scale = effect_->parameters()[probe.along].typical_scale;
      const auto difference = RiddersDifference(
          [&](double h) {
            std::vector<double> p = probe.at;
            p[probe.along] += h;
            return Change(mechanism_, *effect_, p);
          },
          0.1 * scale);
      const VectorXd derivative = ProbeDerivative(mechanism_, *effect_, probe);
      ASSERT_TRUE(derivative.allFinite());
      EXPECT_LT((derivative - difference.value).norm(),
                1e-9 * derivative.norm() + 1e5 * kEpsilon / scale);
    }
  }
}

// What a screening relies on: weights of the probes that explain a recording
// are the parameters with which a fit of the effect starts.
TEST_P(EffectContract, IsTheSumOfItsProbesWhereTheirWeightsAreSmall) {
  // A spring is that sum however large they are.
  const double size = effect_->kind() == "spring" ? 1.0 : 1e-4;
  if (IsOffFarAway(*effect_)) return;
  for (const ProbeSet& probes : effect_->ProbeSets()) {
    std::vector<double> weights;
    VectorXd expected;
    for (size_t i = 0; i < probes.size(); ++i) {
      const double scale = effect_->parameters()[probes[i].along].typical_scale;
      weights.push_back(size * scale * (i % 2 == 0 ? 1.0 : -0.3));
      const VectorXd part =
          weights[i] * ProbeDerivative(mechanism_, *effect_, probes[i]);
      expected = i == 0 ? part : VectorXd(expected + part);
    }
    const std::vector<double> p = effect_->FromProbes(probes, weights);
    ASSERT_EQ(p.size(), effect_->parameters().size());
    const double second_order = size < 1.0 ? 10.0 * size : 0.0;
    EXPECT_LT((Change(mechanism_, *effect_, p) - expected).norm(),
              second_order * expected.norm() + 100 * kEpsilon);
  }
}

// The value of an answer must not depend on the scalar it was computed with.
TEST_P(EffectContract, AnswersTheSameForEveryScalar) {
  std::vector<double> p = NullValues(*effect_);
  for (size_t i = 0; i < p.size(); ++i) {
    p[i] += effect_->parameters()[i].typical_scale;
  }
  const auto plain = Answers<double>(mechanism_, *effect_, effect_->hooks(), p);
  const auto check = [&]<typename T>(T) {
    const std::vector<T> parameters(p.begin(), p.end());
    const auto answers =
        Answers<T>(mechanism_, *effect_, effect_->hooks(), parameters);
    ASSERT_EQ(answers.size(), plain.size());
    for (size_t i = 0; i < plain.size(); ++i) {
      EXPECT_NEAR(answers[i].a, plain[i], 8 * kEpsilon * std::abs(plain[i]));
    }
  };
  check(Jet8());
  check(Jet16());
  check(Jet24());
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EffectContract, ::testing::ValuesIn([] {
                           std::vector<std::string> names =
                               Catalogue().Names(AllJoints());
                           names.push_back(
                               "custom@hinge: -k*q^3 - b*tau*tanh(slide.qd/v)");
                           return names;
                         }()),
                         [](const ::testing::TestParamInfo<std::string>& info) {
                           return TestName(info.param);
                         });

}  // namespace
}  // namespace sysid
