#include "models/dry_friction.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "models/integrator.h"
#include "models/step_tangent.h"
#include "tests/models/dry_two_links.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

Model WithEffects(const Mechanism& mechanism,
                  const std::vector<std::string>& effects,
                  const std::vector<std::pair<std::string, double>>& values) {
  Model model(mechanism);
  for (const std::string& effect : effects) {
    model.AddEffect(Catalogue().Make(effect, mechanism, "test"));
  }
  for (const auto& [name, value] : values) {
    model.SetEffectParameter(name, value);
  }
  return model;
}

// A joint on the world that carries 2 kg (or 2 kg m^2).
Mechanism OneJoint(JointType type, const Vector3d& axis) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  mechanism.AddJoint(MakeJoint("joint", type, 0, axis), "body",
                     Vector3d::Zero(),
                     Body(2.0, Vector3d::Zero(), Vector3d(2, 2, 2)));
  return mechanism;
}

Model CoulombTwoLinks() {
  return WithEffects(TwoLinks::Make(),
                     {"coulomb_friction@joint1", "coulomb_friction@joint2"},
                     {{"joint1.friction", 0.4}, {"joint2.friction", 0.15}});
}

Model StribeckTwoLinks() {
  return WithEffects(TwoLinks::Make(),
                     {"stribeck_friction@joint1", "stribeck_friction@joint2"},
                     {{"joint1.friction", 0.25},
                      {"joint1.static_friction", 0.4},
                      {"joint1.stribeck_velocity", 0.8},
                      {"joint2.friction", 0.1},
                      {"joint2.static_friction", 0.15},
                      {"joint2.stribeck_velocity", 1.0}});
}

double CoulombLevel(int joint, double) { return joint == 0 ? 0.4 : 0.15; }
double StribeckLevel(int joint, double speed) {
  const double v = joint == 0 ? 0.8 : 1.0;
  const double e = std::exp(-speed * speed / (v * v));
  return joint == 0 ? 0.25 + 0.15 * e : 0.1 + 0.05 * e;
}

// Efforts of both joints, held for 20 ms: they let the first come to rest and
// push it loose again.
Vector2d Push(double t) {
  return {t < 2.8 ? 0.3 * std::sin(2.1 * t) : std::sin(7.0 * (t - 2.8)),
          0.3 * std::sin(3.7 * t + 1.0)};
}

const Eigen::Vector4d kStart(0.5, -0.6, 0.4, -0.9);

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

struct Law {
  const char* name;
  Model (*make)();
  double (*level)(int, double);
};
class DryFrictionLaws : public testing::TestWithParam<Law> {};

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

// Eight directions: q, qd, both levels (both static ones), a mass and a centre
// of mass.
struct Directions {
  MechanismParameters<double> values;
  Eigen::Vector4d x = kStart;
  void Move(const Model& model, int k, double by) {
    if (k < 4) {
      x[k] += by;
    } else if (k < 6) {
      const int second = model.effects().offset(1);
      values.effects[k == 4 ? 0 : second] += by;
    } else if (k == 6) {
      values.links[2].mass += by;
    } else {
      values.links[1].com[2] += by;
    }
  }
};

// At so many samples of 20 ms after the start, after each one.
template <typename Visit>
void RollWith(const Model& model, const Directions& at, double h,
              const Visit& visit) {
  Workspace<double> ws(model);
  ws.SetParameters(at.values);
  Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
  Eigen::Vector4d x = at.x;
  const int steps = static_cast<int>(std::lround(0.02 / h));
  for (int k = 0; k < 200; ++k) {
    const Vector2d tau = Push(0.02 * k);
    for (int s = 0; s < steps; ++s) {
      ASSERT_TRUE(stepper.Step(0.02 / steps, tau.data(), x.data()));
    }
    visit(k, x);
  }
}

// Jets, the tangent, and differences of the double rollout: 200 x (4 x 8).
struct Derivatives {
  std::vector<MatrixXd> jets, tangent, differences;
  MatrixXd states;
};
Derivatives Differentiate(const Model& model, double h) {
  Derivatives out;
  const Directions center{model.nominal(), kStart};
  // Jets, and what moves of the parameters for the tangent.
  MechanismParameters<Jet8> values;
  model.nominal().CastTo(&values);
  values.effects[0].v[4] = 1.0;
  values.effects[model.effects().offset(1)].v[5] = 1.0;
  values.links[2].mass.v[6] = 1.0;
  values.links[1].com[2].v[7] = 1.0;
  Workspace<Jet8> jet_ws(model);
  jet_ws.SetParameters(values);
  Stepper<Jet8> jet_stepper(Integrator::kRungeKutta4, &jet_ws);
  std::array<Jet8, 4> x_jet;
  for (int i = 0; i < 4; ++i) x_jet[i] = Jet8(kStart[i], i);
  Workspace<double> ws(model);
  StepTangent tangent(Integrator::kRungeKutta4, &ws);
  StateColumns columns(model, ParameterColumns(jet_ws));
  for (int i = 0; i < 2; ++i) {
    columns.dq[i] = UnitLanes(i);
    columns.dqd[i] = UnitLanes(2 + i);
  }
  Eigen::Vector4d x = kStart;
  out.states.resize(200, 4);
  const int steps = static_cast<int>(std::lround(0.02 / h));
  for (int k = 0; k < 200; ++k) {
    const Vector2d tau = Push(0.02 * k);
    const std::array<Jet8, 2> tau_jet{Jet8(tau[0]), Jet8(tau[1])};
    for (int s = 0; s < steps; ++s) {
      EXPECT_TRUE(jet_stepper.Step(0.02 / steps, tau_jet.data(), x_jet.data()));
      EXPECT_TRUE(tangent.Step(0.02 / steps, tau.data(), x.data(), {&columns}));
    }
    MatrixXd by_jets(4, 8), by_tangent(4, 8);
    for (int i = 0; i < 4; ++i) {
      by_jets.row(i) = x_jet[i].v.transpose();
      double lanes[kLanes];
      StoreLanes(i < 2 ? columns.dq[i] : columns.dqd[i - 2], lanes);
      by_tangent.row(i) = Eigen::Map<Eigen::RowVectorXd>(lanes, 8);
      EXPECT_NEAR(x_jet[i].a, x[i], 1e-11);
    }
    out.states.row(k) = x;
    out.jets.push_back(by_jets);
    out.tangent.push_back(by_tangent);
    out.differences.push_back(MatrixXd::Zero(4, 8));
  }
  constexpr double kBy = 1e-6;
  for (int d = 0; d < 8; ++d) {
    for (const double sign : {1.0, -1.0}) {
      Directions at = center;
      at.Move(model, d, sign * kBy);
      RollWith(model, at, h, [&](int k, const Eigen::Vector4d& moved) {
        out.differences[k].col(d) += moved * (sign / (2 * kBy));
      });
    }
  }
  return out;
}

TEST_P(DryFrictionLaws, HaveTheDerivativesOfTheirRollouts) {
  const Model model = GetParam().make();
  const Derivatives by = Differentiate(model, 0.0025);
  double worst_paths = 0.0, worst_differences = 0.0;
  int compared = 0;
  for (int k = 0; k < 200; ++k) {
    const double size = by.jets[k].norm() + 1.0;
    worst_paths =
        std::max(worst_paths, (by.jets[k] - by.tangent[k]).norm() / size);
    worst_differences = std::max(
        worst_differences, (by.jets[k] - by.differences[k]).norm() / size);
    ++compared;
    // What rests does not move with anything.
    for (int j = 0; j < 2; ++j) {
      if (by.states(k, 2 + j) != 0.0) continue;
      EXPECT_EQ(by.jets[k].row(2 + j).norm(), 0.0);
      EXPECT_EQ(by.tangent[k].row(2 + j).norm(), 0.0);
    }
  }
  std::printf("%s: tangent off Jets by %.2g, differences by %.2g\n",
              GetParam().name, worst_paths, worst_differences);
  EXPECT_LT(worst_paths, 1e-10);
  EXPECT_LT(worst_differences, 1e-6);
}

// What a screening asks of a candidate that is off. From above, that is: less
// than no friction there is not. The reversals are 0.05 s apart; missed by a
// step's length they would be 10 % of the derivative.
TEST(DryFriction, IsDifferentiatedWhereItIsOff) {
  Model model = CoulombTwoLinks();
  model.SetEffectParameter("joint1.friction", 0.0);
  model.SetEffectParameter("joint2.friction", 0.0);
  // The motion bends a lot with the level: 1e-6 would be 5e-4 off.
  constexpr double h = 0.01, kOn = 1e-8;
  const Derivatives by = Differentiate(model, h);
  const Directions off{model.nominal(), kStart};
  MatrixXd plain(200, 4);
  RollWith(model, off, h,
           [&](int k, const Eigen::Vector4d& x) { plain.row(k) = x; });
  double worst = 0.0, worst_paths = 0.0;
  for (int d = 4; d < 6; ++d) {
    Directions on = off;
    on.Move(model, d, kOn);
    RollWith(model, on, h, [&](int k, const Eigen::Vector4d& x) {
      const VectorXd change = (x - plain.row(k).transpose()) / kOn;
      const double size = 1.0 + change.norm();
      worst = std::max(worst, (by.jets[k].col(d) - change).norm() / size);
      worst_paths =
          std::max(worst_paths,
                   (by.jets[k].col(d) - by.tangent[k].col(d)).norm() / size);
    });
  }
  std::printf("off: tangent off Jets by %.2g, differences by %.2g\n",
              worst_paths, worst);
  EXPECT_LT(worst_paths, 1e-10);
  EXPECT_LT(worst, 2e-5);
}

// A joint that stands still under no load is free to move while the level is 0,
// and moves nothing where it is not: whatever pushes it, it stops at once.
TEST(DryFriction, StopsTheDerivativesOfAJointAtRest) {
  for (const double level : {0.0, 0.5}) {
    SCOPED_TRACE(level);
    const Model model =
        WithEffects(OneJoint(JointType::kContinuous, Vector3d::UnitZ()),
                    {"coulomb_friction@joint"}, {{"joint.friction", level}});
    Workspace<Jet8> ws(model);
    Stepper<Jet8> stepper(Integrator::kRungeKutta4, &ws);
    Jet8 x[2] = {Jet8(0.2, 0), Jet8(0.0, 1)}, tau(0.0, 2);
    ASSERT_TRUE(stepper.Step(0.1, &tau, x));
    const double free = level == 0.0 ? 1.0 : 0.0;
    EXPECT_EQ(x[0].v[0], 1.0);
    EXPECT_NEAR(x[0].v[1], 0.1 * free, 1e-15);
    EXPECT_NEAR(x[1].v[1], free, 1e-15);
    EXPECT_NEAR(x[1].v[2], 0.1 / 2.0 * free, 1e-15);
  }
}

// Locking a joint is an impulse on the others: of the momentum that they had
// with it, none is lost.
TEST(DryFriction, LocksAJointByAnImpulse) {
  const Model model = WithEffects(TwoLinks::Make(), {"coulomb_friction@joint2"},
                                  {{"joint2.friction", 50.0}});
  Workspace<Jet8> ws(model);
  Stepper<Jet8> stepper(Integrator::kRungeKutta4, &ws);
  std::array<Jet8, 4> x{Jet8(0.3, 0), Jet8(0.4, 1), Jet8(0.7, 2), Jet8(0.0, 3)};
  const std::array<Jet8, 2> tau{};
  ASSERT_TRUE(stepper.Step(1e-9, tau.data(), x.data()));
  Workspace<double> plain(model);
  const MatrixXd M = Inertia(&plain, Vector2d(0.3, 0.4));
  EXPECT_NEAR(x[2].v[3], M(0, 1) / M(0, 0), 1e-7);
  EXPECT_EQ(x[3].v[3], 0.0);
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
