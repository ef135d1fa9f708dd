#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "models/effects/catalogue.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/link_poses.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"
#include "tests/support/test_effects.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::IsEmpty;

// What each hook of effects/effect.h does to the dynamics.

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

TEST(Gravity, PullsDownByTheParametersValue) {
  Random random(3);
  const Model model(RandomMechanism(8, &random));
  Workspace<double> ws(model);
  EXPECT_EQ(ws.gravity, Vector3d(0, 0, -9.81));
  MechanismParameters<double> moon = model.nominal();
  moon.gravity = 1.62;
  const RandomState x(model.mechanism(), &random);
  const VectorXd zero = VectorXd::Zero(model.nv());
  const VectorXd on_earth = Inverse(&ws, x.q, zero, zero);
  ws.SetParameters(moon);
  EXPECT_EQ(ws.gravity, Vector3d(0, 0, -1.62));
  const VectorXd on_moon = Inverse(&ws, x.q, zero, zero);
  EXPECT_LT((on_moon - on_earth * (1.62 / 9.81)).norm(),
            100 * kEpsilon * on_earth.norm());
  const auto slope = RiddersDifference(
      [&](double h) {
        return VectorXd::Constant(
                   1, PotentialEnergy(
                          &ws, Moved(model.mechanism(), x.q, h * x.qd).data()))
            .eval();
      },
      0.1);
  EXPECT_NEAR(on_moon.dot(x.qd), slope.value[0], 1e-10);
}

TEST(EffectHooks, GravityAddsToTheWorldsAcceleration) {
  Random random(4);
  const Mechanism mechanism = RandomMechanism(8, &random);
  const RandomState x(mechanism, &random);
  Model leaning(mechanism);
  leaning.AddEffect(std::make_shared<TestGravity>(mechanism, "base"));
  leaning.SetEffectParameter("test_gravity_x", 1.0);
  leaning.SetEffectParameter("test_gravity_y", -2.0);
  leaning.SetEffectParameter("test_gravity_z", 9.81 - 3.0);
  Workspace<double> ws(leaning);
  EXPECT_LT((ws.gravity - Vector3d(1, -2, -3)).norm(), 4 * kEpsilon);
  // The same as a world without gravity whose root accelerates by (-1, 2, 3):
  // the bias is linear in gravity.
  MechanismParameters<double> weightless = mechanism.nominal;
  weightless.gravity = 0.0;
  const Model free(mechanism);
  Workspace<double> free_ws(free);
  free_ws.SetParameters(weightless);
  const VectorXd zero = VectorXd::Zero(mechanism.nv);
  const VectorXd moving = Inverse(&free_ws, x.q, x.qd, zero);
  const VectorXd weight = Inverse(&ws, x.q, zero, zero);
  const VectorXd both = Inverse(&ws, x.q, x.qd, zero);
  EXPECT_LT((moving + weight - both).norm(), 100 * kEpsilon * both.norm());
}

TEST(EffectHooks, JointInertiaAddsToTheDiagonalOfTheMassMatrix) {
  Random random(5);
  const Mechanism mechanism = RandomMechanism(10, &random);
  const RandomState x(mechanism, &random);
  Model model(mechanism);
  VectorXd added = VectorXd::Zero(mechanism.nv);
  for (const Joint& joint : mechanism.joints) {
    if (joint.type == JointType::kFixed) continue;
    model.AddEffect(std::make_shared<TestArmature>(mechanism, joint.name));
    const double value = random.Uniform(0.1, 0.5);
    model.SetEffectParameter(joint.name + ".test_armature", value);
    added.segment(joint.v_index, VelocitySize(joint.type)).setConstant(value);
  }
  Workspace<double> ws(model);
  const Model plain(mechanism);
  Workspace<double> plain_ws(plain);
  const MatrixXd expected =
      Inertia(&plain_ws, x.q) + MatrixXd(added.asDiagonal());
  EXPECT_LT((Inertia(&ws, x.q) - expected).norm(),
            10 * kEpsilon * expected.norm());
}

// A force F at a link's centre of mass takes J^T F from what the drives must
// give; J and what the hook sees come from the poses by differences.
TEST(EffectHooks, LinkForceActsAtTheCentreOfMassOfEveryLink) {
  for (int tree = 0; tree < 10; ++tree) {
    Random random(tree);
    const Mechanism mechanism = RandomMechanism(8, &random);
    const RandomState x(mechanism, &random);
    for (size_t i = 1; i < mechanism.links.size(); ++i) {
      const std::string link = mechanism.links[i].name;
      SCOPED_TRACE(link + " of tree " + std::to_string(tree));
      Model model(mechanism);
      model.AddEffect(std::make_shared<TestLinkForce>(mechanism, link));
      model.SetEffectParameter(link + ".test_v", 0.7);
      model.SetEffectParameter(link + ".test_w", -0.4);
      model.SetEffectParameter(link + ".test_R", 0.3);
      Workspace<double> ws(model);
      const Model plain(mechanism);
      Workspace<double> plain_ws(plain);

      const int index = static_cast<int>(i);
      const LinkRates rates = RatesByDifferences(mechanism, x.q, x.qd, index);
      const Eigen::Matrix3d R = LinkPoses(mechanism, x.q)[i].linear();
      const Vector3d force =
          0.7 * rates.v_com - 0.4 * rates.w + 0.3 * (R * Vector3d(1, 2, 3));
      VectorXd expected(mechanism.nv);  // J^T F
      for (int k = 0; k < mechanism.nv; ++k) {
        const VectorXd along = VectorXd::Unit(mechanism.nv, k);
        expected[k] =
            RatesByDifferences(mechanism, x.q, along, index).v_com.dot(force);
      }
      const VectorXd given =
          Inverse(&plain_ws, x.q, x.qd, x.qdd) - Inverse(&ws, x.q, x.qd, x.qdd);
      // Ridders' differences, and the rounding of efforts of order 100.
      EXPECT_LT((given - expected).norm(), 1e-10);
    }
  }
}

TEST(EffectHooks, EffortActsAsMoreEffortOfTheDrives) {
  Random random(6);
  const Mechanism mechanism = RandomMechanism(8, &random);
  const RandomState x(mechanism, &random);
  Model model(mechanism);
  const Catalogue catalogue;
  VectorXd extra = VectorXd::Zero(mechanism.nv);
  for (const Joint& joint : mechanism.joints) {
    if (joint.type == JointType::kFixed) continue;
    model.AddEffect(
        catalogue.Make("viscous_damping@" + joint.name, mechanism, "test"));
    model.SetEffectParameter(joint.name + ".damping", 0.5);
    const int n = VelocitySize(joint.type);
    extra.segment(joint.v_index, n) -= 0.5 * x.qd.segment(joint.v_index, n);
  }
  Workspace<double> ws(model);
  const Model plain(mechanism);
  Workspace<double> plain_ws(plain);
  EXPECT_EQ(Forward(&ws, x.q, x.qd, x.tau),
            Forward(&plain_ws, x.q, x.qd, x.tau + extra));
}

// Who integrates and who measures calls these; the workspace binds them.
TEST(EffectHooks, InputAndMeasurementAreBoundToTheirJointsAndParameters) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  const Inertial<double> body = Body(1.0, {0, 0, 1}, {1, 1, 1});
  mechanism.AddJoint(MakeJoint("a", JointType::kRevolute, 0, Vector3d::UnitX()),
                     "link_a", {0, 0, 0}, body);
  mechanism.AddJoint(MakeJoint("b", JointType::kRevolute, 1, Vector3d::UnitX()),
                     "link_b", {0, 0, 1}, body);
  Model model(mechanism);
  model.AddEffect(Catalogue().Make("effort_delay@base", mechanism, "test"));
  model.AddEffect(std::make_shared<TestMeasurement>(mechanism, "b"));
  model.AddEffect(std::make_shared<TestInput>(mechanism, "b"));
  model.SetEffectParameter("effort_delay", 0.125);
  model.SetEffectParameter("b.test_scale", 0.5);
  model.SetEffectParameter("b.test_gain", 1.0);
  model.SetEffectParameter("b.test_shift", 0.25);
  Workspace<double> ws(model);
  EXPECT_THAT(ws.effort_effects, IsEmpty());
  EXPECT_THAT(ws.link_force_effects, IsEmpty());
  ASSERT_EQ(ws.measurement_effects.size(), 1u);
  ASSERT_EQ(ws.input_effects.size(), 1u);
  ASSERT_EQ(ws.delay_effects.size(), 1u);
  EXPECT_EQ(ws.measurement_effects[0].body, 1);
  EXPECT_EQ(ws.input_effects[0].body, 1);
  double q = 4.0;
  ws.measurement_effects[0].hooks->ModifyMeasurement(
      {nullptr, nullptr}, ws.measurement_effects[0].p, &q);
  EXPECT_EQ(q, 6.0);
  double tau = 1.5;
  ws.input_effects[0].hooks->ModifyInput(ws.input_effects[0].p, &tau);
  EXPECT_EQ(tau, 2 * 1.5 + 0.25);
  double delay = 1.0;
  ws.delay_effects[0].hooks->AddInputDelay(ws.delay_effects[0].p, &delay);
  EXPECT_EQ(delay, 1.125);
}

class OnBase : public EffectOf<OnBase> {
 public:
  static constexpr TargetKind kTarget = TargetKind::kBase;
  explicit OnBase(const Mechanism& mechanism)
      : EffectOf("on_base", kInputHook, mechanism, "base") {}
};

TEST(EffectHooksDeathTest, ThoseOfAJointNeedAJoint) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  EXPECT_DEATH(OnBase{mechanism}, "on_base acts on a joint and has none");
}

// URDF lets a joint and a link have the same name.
TEST(EffectHooks, FindTheirTargetWhereAJointAndALinkShareAName) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  const Inertial<double> body = Body(1.0, {0, 0, 1}, {1, 1, 1});
  mechanism.AddJoint(
      MakeJoint("arm", JointType::kPrismatic, 0, Vector3d::UnitX()), "hand",
      {0, 0, 0}, body);
  mechanism.AddJoint(
      MakeJoint("hand", JointType::kRevolute, 1, Vector3d::UnitX()), "arm",
      {0, 0, 1}, body);
  const TestLinkForce on_link(mechanism, "arm");
  EXPECT_EQ(on_link.link(), 2);
  EXPECT_EQ(on_link.joint(), -1);
  const TestArmature on_joint(mechanism, "arm");
  EXPECT_EQ(on_joint.joint(), 0);
  EXPECT_EQ(on_joint.link(), -1);
}

TEST(EffectHooks, LinkForceOnALinkThatIsFixedToTheWorldDoesNothing) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  const Inertial<double> body = Body(1.0, {0, 0, 1}, {1, 1, 1});
  mechanism.AddJoint(MakeJoint("bolt", JointType::kFixed, 0, Vector3d::UnitX()),
                     "stand", {0, 0, 0}, body);
  mechanism.AddJoint(
      MakeJoint("joint1", JointType::kRevolute, 1, Vector3d::UnitX()), "link1",
      {0, 0, 1}, body);
  Model model(mechanism);
  model.AddEffect(std::make_shared<TestLinkForce>(mechanism, "stand"));
  model.SetEffectParameter("stand.test_R", 100.0);
  Workspace<double> ws(model);
  const Model plain(mechanism);
  Workspace<double> plain_ws(plain);
  const VectorXd one = VectorXd::Ones(1);
  EXPECT_EQ(Forward(&ws, one, one, one), Forward(&plain_ws, one, one, one));
}

}  // namespace
}  // namespace sysid
