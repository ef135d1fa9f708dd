#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>

#include "models/effects/catalogue.h"
#include "models/effects/coulomb_friction.h"
#include "models/math/rotation.h"
#include "tests/support/all_joints.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::Each;
using ::testing::ElementsAre;

// The laws of the effects, by numbers that are worked out by hand.

// The effort of an effect with parameters p at a position and a velocity, of
// what it reads besides: the drive's effort, inputs.
std::vector<double> EffortAt(const std::string& name,
                             const std::vector<double>& p,
                             const std::vector<double>& q,
                             const std::vector<double>& qd, double effort = 0.0,
                             const std::vector<double>& inputs = {}) {
  const Mechanism mechanism = AllJoints();
  const auto effect = Catalogue().Make(name, mechanism, "test");
  EXPECT_EQ(p.size(), effect->parameters().size());
  const Joint& joint = mechanism.joints[effect->joint()];
  std::vector<double> tau(qd.size(), 0.0);
  effect->HooksFor(ScalarTag<double>())
      .AddEffort({joint.type, static_cast<int>(qd.size()), q.data(), qd.data(),
                  &effort, inputs.data()},
                 p.data(), tau.data());
  return tau;
}

// The same of one parameter at a velocity alone.
std::vector<double> Effort(const std::string& name, double value,
                           const std::vector<double>& qd) {
  return EffortAt(name, {value}, {0.0, 0.0, 0.0, 1.0}, qd);
}

TEST(ViscousDamping, BrakesInProportionToTheVelocity) {
  EXPECT_THAT(Effort("viscous_damping@hinge", 0.5, {3.0}), ElementsAre(-1.5));
  EXPECT_THAT(Effort("viscous_damping@slide", 0.5, {-3.0}), ElementsAre(1.5));
  EXPECT_THAT(Effort("viscous_damping@ball", 0.5, {1.0, -2.0, 4.0}),
              ElementsAre(-0.5, 1.0, -2.0));
}

TEST(CoulombFriction, IsWithinHalfAPercentOfItsLevelAtTenSmoothingSpeeds) {
  EXPECT_NEAR(Effort("coulomb_friction@hinge", 2.0, {0.1})[0], -2.0, 0.01);
  EXPECT_NEAR(Effort("coulomb_friction@hinge", 2.0, {-0.1})[0], 2.0, 0.01);
  EXPECT_NEAR(Effort("coulomb_friction@wheel", 2.0, {0.1})[0], -2.0, 0.01);
  EXPECT_NEAR(Effort("coulomb_friction@slide", 2.0, {0.01})[0], -2.0, 0.01);
}

TEST(CoulombFriction, DoesNotGrowWithTheSpeed) {
  for (const double speed : {0.1, 1.0, 100.0}) {
    EXPECT_LE(-Effort("coulomb_friction@hinge", 2.0, {speed})[0], 2.0);
  }
  EXPECT_NEAR(Effort("coulomb_friction@hinge", 2.0, {100.0})[0], -2.0, 1e-7);
}

TEST(CoulombFriction, ActsAlongTheAngularVelocityOfASphericalJoint) {
  const Vector3d w(2, -3, 6);  // |w| = 7
  const auto tau = Effort("coulomb_friction@ball", 1.4, {w[0], w[1], w[2]});
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(tau[k], -0.2 * w[k], 1e-5);
}

TEST(CoulombFriction, IsZeroAndSmoothAtRest) {
  EXPECT_THAT(Effort("coulomb_friction@ball", 1.0, {0, 0, 0}), Each(0.0));
  const Mechanism mechanism = AllJoints();
  const auto effect =
      Catalogue().Make("coulomb_friction@ball", mechanism, "test");
  const Jet8 q[4] = {Jet8(0), Jet8(0), Jet8(0), Jet8(1)};
  const Jet8 qd[3] = {Jet8(0.0, 0), Jet8(0.0, 1), Jet8(0.0, 2)};
  const Jet8 p(0.5);
  Jet8 tau[3];
  effect->HooksFor(ScalarTag<Jet8>())
      .AddEffort({JointType::kSpherical, 3, q, qd}, &p, tau);
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(tau[k].v[j],
                  j == k ? -0.5 / FrictionSmoothingSpeed(false) : 0.0, 1e-10);
    }
  }
}

TEST(EffortBias, IsAConstantEffort) {
  EXPECT_THAT(Effort("effort_bias@hinge", 0.3, {5.0}), ElementsAre(0.3));
  EXPECT_THAT(Effort("effort_bias@slide", -0.3, {5.0}), ElementsAre(-0.3));
}

double Stribeck(const std::string& joint, double friction, double at_rest,
                double velocity, double speed) {
  return EffortAt("stribeck_friction@" + joint, {friction, at_rest, velocity},
                  {0.0}, {speed})[0];
}

TEST(StribeckFriction, IsItsStaticLevelNearRestAndCoulombsWhenFast) {
  // Above the smoothing speed and far below the Stribeck velocity.
  EXPECT_NEAR(Stribeck("hinge", 2.0, 5.0, 10.0, 0.2), -5.0, 0.01);
  EXPECT_NEAR(Stribeck("hinge", 2.0, 5.0, 10.0, -0.2), 5.0, 0.01);
  EXPECT_NEAR(Stribeck("slide", 2.0, 5.0, 1.0, 0.02), -5.0, 0.01);
  // Far above both.
  EXPECT_NEAR(Stribeck("hinge", 2.0, 5.0, 0.1, 1.0), -2.0, 1e-3);
  EXPECT_NEAR(Stribeck("slide", 2.0, 5.0, 0.01, 0.1), -2.0, 1e-3);
  // At the Stribeck velocity 1/e of the difference is left.
  EXPECT_NEAR(Stribeck("hinge", 2.0, 5.0, 3.0, 3.0),
              -(2.0 + 3.0 * std::exp(-1.0)), 1e-4);
  EXPECT_EQ(Stribeck("hinge", 2.0, 5.0, 3.0, 0.0), 0.0);
}

TEST(StribeckFriction, IsCoulombsWhereBothLevelsAreTheSame) {
  for (const double speed : {-2.0, -0.05, 0.003, 0.4}) {
    EXPECT_NEAR(Stribeck("hinge", 2.0, 2.0, 0.1, speed),
                Effort("coulomb_friction@hinge", 2.0, {speed})[0], 1e-14);
  }
}

TEST(StribeckFriction, ActsAlongTheAngularVelocityOfASphericalJoint) {
  const auto tau = EffortAt("stribeck_friction@ball", {1.4, 7.0, 0.1},
                            {0, 0, 0, 1}, {2.0, -3.0, 6.0});  // |w| = 7
  EXPECT_NEAR(tau[0], -0.4, 1e-5);
  EXPECT_NEAR(tau[1], 0.6, 1e-5);
  EXPECT_NEAR(tau[2], -1.2, 1e-5);
}

TEST(QuadraticDrag, GrowsWithTheSquareOfTheSpeed) {
  EXPECT_NEAR(Effort("quadratic_drag@hinge", 0.5, {3.0})[0], -4.5, 1e-4);
  EXPECT_NEAR(Effort("quadratic_drag@slide", 0.5, {-3.0})[0], 4.5, 1e-4);
  const auto tau = Effort("quadratic_drag@ball", 0.5, {2.0, -3.0, 6.0});
  EXPECT_NEAR(tau[0], -7.0, 1e-4);
  EXPECT_NEAR(tau[1], 10.5, 1e-4);
  EXPECT_NEAR(tau[2], -21.0, 1e-4);
  EXPECT_THAT(Effort("quadratic_drag@ball", 0.5, {0, 0, 0}), Each(0.0));
}

TEST(Spring, PullsTowardsItsReference) {
  EXPECT_THAT(EffortAt("spring@hinge", {2.0, 0.5}, {1.5}, {9.0}),
              ElementsAre(-2.0));
  EXPECT_THAT(EffortAt("spring@slide", {2.0, -0.5}, {-1.5}, {0.0}),
              ElementsAre(2.0));
}

// d/dt V = tau . qd with the potential V = k |phi|^2 / 2 of the angle from
// neutral, along any turn.
TEST(Spring, IsTheGradientOfItsPotentialOnASphericalJoint) {
  const double k = 1.7;
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Quaterniond q = random.Rotation();
    const Vector3d w = random.NormalVector(3);
    const auto potential = [&](double t) {
      const Eigen::Quaterniond turned =
          q * Eigen::Quaterniond(Exp<double>(Vector3d(t * w)));
      return VectorXd::Constant(1, 0.5 * k * Log<double>(turned).squaredNorm())
          .eval();
    };
    if (Log<double>(q).norm() > 2.8) continue;  // a fold at half a turn
    const auto tau =
        EffortAt("spring@ball", {k}, {q.x(), q.y(), q.z(), q.w()}, {0, 0, 0});
    const double power = tau[0] * w[0] + tau[1] * w[1] + tau[2] * w[2];
    EXPECT_NEAR(power, -RiddersDifference(potential, 0.02).value[0], 1e-8);
  }
}

TEST(Cogging, IsASineOfTheAngleThatManyTimesATurn) {
  const double q = 0.3;
  EXPECT_NEAR(EffortAt("cogging@wheel", {0.2, 0.0, 6.0}, {q}, {1.0})[0],
              0.2 * std::sin(1.8), 1e-15);
  EXPECT_NEAR(EffortAt("cogging@wheel", {0.0, 0.2, 6.0}, {q}, {1.0})[0],
              0.2 * std::cos(1.8), 1e-15);
  // The same after a sixth of a turn.
  const std::vector<double> p{0.2, -0.1, 6.0};
  EXPECT_NEAR(EffortAt("cogging@hinge", p, {q}, {0.0})[0],
              EffortAt("cogging@hinge", p, {q + M_PI / 3}, {0.0})[0], 1e-14);
}

TEST(Armature, AddsToTheInertiaOfItsJoint) {
  const Mechanism mechanism = AllJoints();
  for (const std::string joint : {"slide", "ball", "hinge"}) {
    const auto effect = Catalogue().Make("armature@" + joint, mechanism, "");
    const double p = 0.25;
    double inertia = 1.0;
    effect->HooksFor(ScalarTag<double>()).AddJointInertia(&p, &inertia);
    EXPECT_EQ(inertia, 1.25);
  }
}

TEST(EffortGain, MultipliesEveryEffortOfItsJoint) {
  const Mechanism mechanism = AllJoints();
  const auto effect = Catalogue().Make("effort_gain@ball", mechanism, "");
  double tau[3] = {1.0, -2.0, 4.0};
  const double p = 0.5;
  effect->HooksFor(ScalarTag<double>()).ModifyInput(&p, tau);
  EXPECT_THAT(tau, ElementsAre(1.5, -3.0, 6.0));
}

Vector3d Tilted(double x, double y) {
  const Mechanism mechanism = AllJoints();
  const auto effect = Catalogue().Make("gravity_tilt@base", mechanism, "");
  const double p[2] = {x, y};
  Vector3d gravity(0.0, 0.0, -10.0);
  effect->HooksFor(ScalarTag<double>()).ModifyGravity(nullptr, p, &gravity);
  return gravity;
}

TEST(GravityTilt, TurnsGravityAboutTheWorldsAxes) {
  const double s = 10.0 * std::sin(0.3), c = 10.0 * std::cos(0.3);
  EXPECT_LT((Tilted(0.3, 0.0) - Vector3d(0, s, -c)).norm(), 1e-14);
  EXPECT_LT((Tilted(0.0, 0.3) - Vector3d(-s, 0, -c)).norm(), 1e-14);
  // Both: about the axis (3, 4, 0) / 5, by the angle 0.3.
  EXPECT_LT((Tilted(0.18, 0.24) - Vector3d(-0.8 * s, 0.6 * s, -c)).norm(),
            1e-14);
}

TEST(AerodynamicDrag, BrakesTheCentreOfMassAgainstItsVelocity) {
  const Mechanism mechanism = AllJoints();
  const auto effect = Catalogue().Make("aerodynamic_drag@rim", mechanism, "");
  LinkState<double> link;
  link.v_com = Vector3d(2.0, -3.0, 6.0);
  link.w = Vector3d(1.0, 1.0, 1.0);
  link.R_WL.setIdentity();
  Vector3d force = Vector3d::Zero();
  const double p = 0.1;
  effect->HooksFor(ScalarTag<double>()).AddLinkForce(link, &p, &force);
  EXPECT_LT((force - Vector3d(-1.4, 2.1, -4.2)).norm(), 1e-4);
}

TEST(SensorOffset, IsAddedToTheTruePosition) {
  const Mechanism mechanism = AllJoints();
  const auto effect = Catalogue().Make("sensor_offset@hinge", mechanism, "");
  double q = 1.0;
  const double p = 0.25;
  effect->HooksFor(ScalarTag<double>())
      .ModifyMeasurement({nullptr, nullptr}, &p, &q);
  EXPECT_EQ(q, 1.25);
}

// Of a hinge at a rate that is far above the smoothing, under a drive's effort.
double HingeEffort(const std::string& kind, const std::vector<double>& p,
                   double rate, double effort = 0.0,
                   const std::vector<double>& inputs = {}) {
  return EffortAt(kind + "@hinge", p, {0.4}, {rate}, effort, inputs)[0];
}

// As good as sign() is at these rates: 1 - (v_s / qd)^2 / 2.
constexpr double kSmoothed = 1e-4;

TEST(CubicDamping, GrowsWithTheCubeOfTheSpeed) {
  EXPECT_NEAR(HingeEffort("cubic_damping", {0.5}, 2.0), -4.0, 1e-14);
  EXPECT_NEAR(HingeEffort("cubic_damping", {0.5}, -2.0), 4.0, 1e-14);
  const auto tau = Effort("cubic_damping@ball", 0.1, {2.0, -3.0, 6.0});  // 49
  EXPECT_NEAR(tau[0], -9.8, 1e-13);
  EXPECT_NEAR(tau[1], 14.7, 1e-13);
  EXPECT_NEAR(tau[2], -29.4, 1e-13);
}

TEST(LoadFriction, IsAPartOfTheDrivesEffortAgainstTheMotion) {
  for (const double effort : {5.0, -5.0}) {
    EXPECT_NEAR(HingeEffort("load_friction", {0.2}, 3.0, effort), -1.0,
                kSmoothed);
    EXPECT_NEAR(HingeEffort("load_friction", {0.2}, -3.0, effort), 1.0,
                kSmoothed);
  }
  EXPECT_EQ(HingeEffort("load_friction", {0.2}, 3.0, 0.0), 0.0);
}

TEST(LoadStribeckFriction, HasAnotherPartNearRest) {
  const std::vector<double> p{0.2, 0.5, 10.0};
  EXPECT_NEAR(HingeEffort("load_stribeck_friction", p, 0.5, 4.0),
              -4.0 * (0.2 + 0.3 * std::exp(-0.0025)), 4 * kSmoothed);
  EXPECT_NEAR(HingeEffort("load_stribeck_friction", p, -10.0, 4.0),
              4.0 * (0.2 + 0.3 * std::exp(-1.0)), 4 * kSmoothed);
}

TEST(GearEfficiency, LosesAnotherPartWhereItIsDriven) {
  const std::vector<double> p{0.1, 0.4};
  EXPECT_NEAR(HingeEffort("gear_efficiency", p, 2.0, 5.0), -0.5, kSmoothed);
  EXPECT_NEAR(HingeEffort("gear_efficiency", p, -2.0, -5.0), 0.5, kSmoothed);
  EXPECT_NEAR(HingeEffort("gear_efficiency", p, -2.0, 5.0), 2.0, kSmoothed);
  EXPECT_NEAR(HingeEffort("gear_efficiency", p, 2.0, -5.0), -2.0, kSmoothed);
}

TEST(AsymmetricFriction, IsMoreForwardsByItsParts) {
  const std::vector<double> p{2.0, 0.5, 0.5, -0.25};
  EXPECT_NEAR(HingeEffort("asymmetric_friction", p, 4.0),
              -2.0 * 1.25 - 0.5 * 0.5 * 4.0, 2 * kSmoothed);
  EXPECT_NEAR(HingeEffort("asymmetric_friction", p, -4.0),
              2.0 * 0.75 + 0.5 * 1.5 * 4.0, 2 * kSmoothed);
}

TEST(ThermalFriction, FallsFromItsValuesAtTwentyDegrees) {
  const std::vector<double> p{2.0, 0.5, 0.1};
  EXPECT_NEAR(HingeEffort("thermal_friction", p, 4.0, 0.0, {20.0}), -4.0,
              2 * kSmoothed);
  EXPECT_NEAR(HingeEffort("thermal_friction", p, -4.0, 0.0, {30.0}),
              4.0 * std::exp(-1.0), 2 * kSmoothed);
}

TEST(PositionDrive, PullsTowardsItsCommand) {
  // Towards 1 from 0.4, at 2 rad/s.
  EXPECT_NEAR(HingeEffort("position_drive", {10.0, 0.5, 0.0}, 2.0, 0.0, {1.0}),
              5.0, 1e-14);
}

TEST(EffortLimit, IsTheTorqueSpeedLineOfAMotor) {
  const Mechanism mechanism = AllJoints();
  const auto effect = Catalogue().Make("effort_limit@hinge", mechanism, "");
  const auto given = [&](double asked, double rate) {
    const double p[2] = {3.0, 0.1}, q = 0.0;
    double effort = asked;
    effect->HooksFor(ScalarTag<double>())
        .LimitDrive({JointType::kRevolute, 1, &q, &rate}, p, &effort);
    return effort;
  };
  EXPECT_EQ(given(2.0, 0.0), 2.0);
  EXPECT_EQ(given(5.0, 0.0), 3.0);
  EXPECT_EQ(given(-5.0, 0.0), -3.0);
  EXPECT_NEAR(given(5.0, 4.0), 1.8, 1e-15);  // towards no-load speed
  EXPECT_NEAR(given(-5.0, -4.0), -1.8, 1e-15);
  EXPECT_EQ(given(5.0, -4.0), 3.0);  // braking: no more than at rest
  EXPECT_EQ(given(5.0, 20.0), 0.0);  // above it
}

// What a sensor says at q = 1, moving at 2 with an acceleration of 8.
double Sensed(const std::string& kind, const std::vector<double>& p) {
  const auto effect = Catalogue().Make(kind + "@hinge", AllJoints(), "test");
  const double qd = 2.0, qdd = 8.0;
  double q = 1.0;
  effect->HooksFor(ScalarTag<double>())
      .ModifyMeasurement({&qd, &qdd}, p.data(), &q);
  return q;
}

TEST(Sensors, SayWhatTheirLawsSay) {
  EXPECT_NEAR(Sensed("sensor_gain", {0.25}), 1.25, 1e-15);
  // q(t - d) of a parabola: 1 - 2 d + 4 d^2.
  EXPECT_NEAR(Sensed("sensor_delay", {0.1}), 0.84, 1e-15);
  EXPECT_NEAR(Sensed("transmission_error", {0.02, -0.01, 5.0}),
              1.0 + 0.02 * std::sin(5.0) - 0.01 * std::cos(5.0), 1e-15);
}

TEST(BaseMotion, TakesTheBasesAccelerationFromGravity) {
  const auto effect = Catalogue().Make("base_motion@base", AllJoints(), "test");
  const double inputs[3] = {1.0, -2.0, 0.5}, gain = 2.0;
  Vector3d gravity(0.0, 0.0, -10.0);
  effect->HooksFor(ScalarTag<double>()).ModifyGravity(inputs, &gain, &gravity);
  EXPECT_LT((gravity - Vector3d(-2.0, 4.0, -11.0)).norm(), 1e-14);
}

// The names that an effect of the inertia corrects on the last of hinges about
// these axes, each turned against the one before by a quarter turn about x.
std::vector<std::string> CorrectedBehind(const std::vector<Vector3d>& axes) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  for (const Vector3d& axis : axes) {
    Joint joint;
    joint.name = "joint" + std::to_string(mechanism.links.size());
    joint.type = JointType::kContinuous;
    joint.parent_link = static_cast<int>(mechanism.links.size()) - 1;
    joint.axis = axis;
    joint.R_PJ = Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitX());
    mechanism.AddJoint(joint, "link" + std::to_string(mechanism.links.size()),
                       {0, 0, 1}, SomeBody());
  }
  return Catalogue()
      .Make("inertia@" + mechanism.links.back().name, mechanism, "test")
      ->adjusts_nominal();
}

TEST(WrongInertia, IsOneNumberOfALinkThatTurnsAboutOneDirection) {
  const Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  EXPECT_THAT(CorrectedBehind({y}), ElementsAre("link1.inertia_scale"));
  EXPECT_THAT(CorrectedBehind({x, -x}), ElementsAre("link2.inertia_scale"));
  // y of the second is z of the first.
  EXPECT_THAT(CorrectedBehind({z, y}), ElementsAre("link2.inertia_scale"));
  EXPECT_EQ(CorrectedBehind({y, y}).size(), 6u);
  EXPECT_EQ(CorrectedBehind({z, y, x}).size(), 6u);
}

TEST(EffectUnits, FollowTheTypeOfTheJoint) {
  const Mechanism mechanism = AllJoints();
  const auto unit = [&](const std::string& name) {
    return Catalogue().Make(name, mechanism, "test")->parameters()[0].unit;
  };
  EXPECT_EQ(unit("viscous_damping@hinge"), "N m s/rad");
  EXPECT_EQ(unit("viscous_damping@ball"), "N m s/rad");
  EXPECT_EQ(unit("viscous_damping@slide"), "N s/m");
  EXPECT_EQ(unit("coulomb_friction@wheel"), "N m");
  EXPECT_EQ(unit("coulomb_friction@slide"), "N");
  EXPECT_EQ(unit("effort_bias@hinge"), "N m");
  EXPECT_EQ(unit("effort_bias@slide"), "N");
  EXPECT_EQ(unit("sensor_offset@hinge"), "rad");
  EXPECT_EQ(unit("sensor_offset@slide"), "m");
  EXPECT_EQ(unit("quadratic_drag@hinge"), "N m s^2/rad^2");
  EXPECT_EQ(unit("quadratic_drag@slide"), "N s^2/m^2");
  EXPECT_EQ(unit("spring@ball"), "N m/rad");
  EXPECT_EQ(unit("spring@slide"), "N/m");
  EXPECT_EQ(unit("armature@wheel"), "kg m^2");
  EXPECT_EQ(unit("armature@slide"), "kg");
}

}  // namespace
}  // namespace sysid
