#include "models/dry_friction.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "models/step_tangent.h"
#include "models/stepper.h"
#include "tests/models/dry_laws.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// States every 20 ms over 4 s.
MatrixXd RollReference(const DryTwoLinks::Level& level) {
  const DryTwoLinks reference(level);
  Eigen::Vector4d x = kStart;
  MatrixXd states(200, 4);
  for (int k = 0; k < 200; ++k) {
    states.row(k) = x;
    reference.Advance(0.02, Push(0.02 * k), &x);
  }
  return states;
}
MatrixXd Roll(const Model& model, double h) {
  Workspace<double> ws(model);
  Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
  Eigen::Vector4d x = kStart;
  MatrixXd states(200, 4);
  const int steps = static_cast<int>(std::lround(0.02 / h));
  for (int k = 0; k < 200; ++k) {
    states.row(k) = x;
    const Vector2d tau = Push(0.02 * k);
    for (int s = 0; s < steps; ++s) {
      EXPECT_TRUE(stepper.Step(0.02 / steps, tau.data(), x.data()));
    }
  }
  return states;
}

TEST_P(DryFrictionLaws, AgreeWithAnEventExactReference) {
  const Model model = GetParam().make();
  const MatrixXd exact = RollReference(GetParam().level);
  // The recording has what it is for: reversals and rests of both joints.
  for (const int j : {2, 3}) {
    int rests = 0, reversals = 0;
    for (int k = 1; k < 200; ++k) {
      rests += exact(k, j) == 0;
      reversals += exact(k, j) * exact(k - 1, j) < 0;
    }
    EXPECT_GE(rests, 5) << j;
    EXPECT_GE(reversals + rests, 3) << j;
  }
  double last = 0.0;
  for (const auto& [h, tolerance] :
       {std::pair{0.01, 1e-5}, {0.005, 1e-6}, {0.0025, 1e-7}}) {
    const MatrixXd error = (Roll(model, h) - exact).leftCols(2);
    const double worst = error.cwiseAbs().maxCoeff();
    std::printf("%s, steps of %g s: worst %.2g rad\n", GetParam().name, h,
                worst);
    EXPECT_LT(worst, tolerance);
    // Fourth order: 16 times less; some of it goes to the events.
    if (last > 0.0) {
      EXPECT_LT(worst, last / 8);
    }
    last = worst;
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, DryFrictionLaws,
    testing::Values(Law{"Coulomb", CoulombTwoLinks, CoulombLevel},
                    Law{"Stribeck", StribeckTwoLinks, StribeckLevel}),
    [](const auto& info) { return info.param.name; });

// x'' = -k/m x - c/m sign: each half swing is a cosine about -+c/k, so that
// amplitudes fall by 2 c / k; within c / k of the middle it stays.
TEST(DryFriction, StopsASpringWithinItsDeadBandAsTheTextbookSays) {
  for (const JointType type : {JointType::kPrismatic, JointType::kRevolute}) {
    const double m = 2.0, k = 50.0, c = 3.0, a0 = 0.5;
    const Model model =
        WithEffects(OneJoint(type, Vector3d::UnitX()),
                    {"coulomb_friction@joint", "spring@joint"},
                    {{"joint.friction", c}, {"joint.stiffness", k}});
    Workspace<double> ws(model);
    Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
    Vector2d x(a0, 0.0);
    const double tau = 0.0, half = std::numbers::pi * std::sqrt(m / k);
    // Amplitudes 0.5, 0.38, 0.26, 0.14, 0.02: there it rests.
    double amplitude = a0, sign = 1.0;
    for (int swing = 0; swing < 4; ++swing) {
      for (int i = 0; i < 100; ++i) {
        ASSERT_TRUE(stepper.Step(half / 100, &tau, x.data()));
      }
      amplitude -= 2 * c / k;
      sign = -sign;
      EXPECT_NEAR(x[0], sign * amplitude, 1e-8);
      EXPECT_NEAR(x[1], 0.0, 1e-6);
    }
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(stepper.Step(0.01, &tau, x.data()));
    }
    EXPECT_EQ(x[1], 0.0);
    EXPECT_NEAR(x[0], 0.02, 1e-8);
    const double rest = x[0];
    for (int i = 0; i < 1000; ++i) {
      ASSERT_TRUE(stepper.Step(0.01, &tau, x.data()));
    }
    EXPECT_EQ(x[0], rest);
  }
}

// A block on an incline of 30 degrees, pulled by efforts that are held.
TEST(DryFriction, HoldsAJointUntilItsLoadExceedsTheLevel) {
  const double g = 9.81, m = 2.0, load = m * g * 0.5;
  const Mechanism incline =
      OneJoint(JointType::kPrismatic, Vector3d(std::sqrt(0.75), 0.0, -0.5));
  const Model model =
      WithEffects(incline, {"coulomb_friction@joint"}, {{"joint.friction", 4}});
  Workspace<double> ws(model);
  const Vector2d x(0.3, 0.0);
  const auto acceleration = [&](double tau) {
    double qdd;
    EXPECT_TRUE(RestOrSlip<double>(&ws, &x[0], &x[1], &tau, &qdd));
    return qdd;
  };
  EXPECT_EQ(acceleration(-load), 0.0);
  EXPECT_EQ(acceleration(-load + 3.999), 0.0);
  EXPECT_EQ(acceleration(-load - 3.999), 0.0);
  EXPECT_NEAR(acceleration(-load + 5.0), (5.0 - 4.0) / m, 1e-12);
  EXPECT_NEAR(acceleration(-load - 5.0), -(5.0 - 4.0) / m, 1e-12);
  EXPECT_NEAR(acceleration(0.0), (load - 4.0) / m, 1e-12);
}

// The levels of several effects on one joint add up.
TEST(DryFriction, AddsTheLevelsOfOneJoint) {
  const Mechanism mechanism =
      OneJoint(JointType::kContinuous, Vector3d::UnitZ());
  Mechanism urdf = mechanism;
  urdf.joints[0].friction = 0.7;
  const Model model = MakeModel(urdf, Catalogue());
  Workspace<double> ws(model);
  ASSERT_EQ(ws.dry_bodies.size(), 1u);
  const Vector2d x(0.0, 0.0);
  double qdd, tau = 0.69;
  ASSERT_TRUE(RestOrSlip<double>(&ws, &x[0], &x[1], &tau, &qdd));
  EXPECT_EQ(qdd, 0.0);
  tau = 0.9;
  ASSERT_TRUE(RestOrSlip<double>(&ws, &x[0], &x[1], &tau, &qdd));
  EXPECT_NEAR(qdd, 0.1, 1e-14);
}

TEST(DryFriction, KeepsAnArmWhereItRestsToTheLastBit) {
  // Of three joints under gravity two rest, one swings above them.
  Random random(3);
  Mechanism mechanism = TwoLinks::Make();
  mechanism.AddJoint(
      MakeJoint("joint3", JointType::kRevolute, 2, Vector3d::UnitY()), "link3",
      Vector3d(0, 0, -0.3),
      Body(0.05, Vector3d(0, 0, -0.1), Vector3d(1e-3, 1e-3, 1e-3)));
  const Model model = WithEffects(
      mechanism, {"coulomb_friction@joint1", "stribeck_friction@joint2"},
      {{"joint1.friction", 20.0},
       {"joint2.friction", 4.0},
       {"joint2.static_friction", 8.0}});
  Workspace<double> ws(model);
  Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
  VectorXd x(6);
  x << 0.8, 0.5, 0.9, 0.0, 0.0, 0.0;
  const VectorXd start = x;
  const Vector3d tau(0.3, -0.2, 0.0);
  for (int i = 0; i < 100000; ++i) {
    ASSERT_TRUE(stepper.Step(0.01, tau.data(), x.data()));
  }
  EXPECT_EQ(x[0], start[0]);
  EXPECT_EQ(x[1], start[1]);
  EXPECT_EQ(x[3], 0.0);
  EXPECT_EQ(x[4], 0.0);
  EXPECT_GT(std::abs(x[5]) + std::abs(x[2] - start[2]), 1e-3);
}

// Random trees under random efforts that jump, friction on every joint: none at
// all, next to none, ordinary, and more than anything could overcome.
TEST(DryFriction, EndsEveryStepWithFiniteNumbers) {
  for (int tree = 0; tree < 60; ++tree) {
    SCOPED_TRACE("tree " + std::to_string(tree));
    Random random(700 + tree);
    const Mechanism mechanism = RandomTree(tree, &random);
    Model model(mechanism);
    for (const Joint& joint : mechanism.joints) {
      if (joint.type == JointType::kFixed) continue;
      const char* const law =
          random.Integer(2) == 0 ? "coulomb_friction@" : "stribeck_friction@";
      for (const std::string& effect :
           {std::string("viscous_damping@"), std::string(law)}) {
        model.AddEffect(
            Catalogue().Make(effect + joint.name, mechanism, "test"));
      }
      model.SetEffectParameter(joint.name + ".damping", 1.0);
      const double levels[] = {0.0, 1e-12, 0.1, 2.0, 1e6};
      // A ball's friction is smoothed, and too much of it is too stiff.
      if (joint.type == JointType::kSpherical) continue;
      const double level = levels[random.Integer(5)];
      model.SetEffectParameter(joint.name + ".friction", level);
      if (law[0] == 's') {
        model.SetEffectParameter(joint.name + ".static_friction",
                                 level + levels[random.Integer(5)]);
      }
    }
    const RandomState at(mechanism, &random);
    // At rest in some of its joints, and in half of the trees in all.
    VectorXd qd = at.qd;
    for (double& rate : qd) {
      if (tree % 2 == 0 || random.Integer(3) == 0) rate = 0.0;
    }
    Workspace<double> ws(model);
    Workspace<Jet8> jet_ws(model);
    Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
    Stepper<Jet8> jets(Integrator::kRungeKutta4, &jet_ws);
    VectorXd x(model.state_size());
    x << at.q, qd;
    std::vector<Jet8> x_jet(x.begin(), x.end());
    for (int i = 0; i < model.nv(); ++i) {
      x_jet[model.layout().qd() + i].v[i % 8] = 1.0;
    }
    for (int k = 0; k < 150; ++k) {
      const VectorXd tau =
          random.Integer(3) == 0
              ? VectorXd(VectorXd::Zero(model.nv()))
              : VectorXd(3.0 * random.NormalVector(model.nv()));
      const std::vector<Jet8> tau_jet(tau.begin(), tau.end());
      ASSERT_TRUE(stepper.Step(0.004, tau.data(), x.data())) << k;
      ASSERT_TRUE(jets.Step(0.004, tau_jet.data(), x_jet.data())) << k;
      ASSERT_TRUE(x.allFinite()) << k;
      for (const Jet8& number : x_jet) {
        ASSERT_TRUE(number.v.allFinite()) << k;
      }
    }
    // Nothing of a step stays in the workspace.
    for (const int i : ws.dry_bodies) {
      EXPECT_EQ(ws.bodies[i].dry, DryMode::kSmoothed);
    }
  }
}

}  // namespace
}  // namespace sysid
