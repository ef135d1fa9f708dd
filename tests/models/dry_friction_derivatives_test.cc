// The derivatives of rollouts with dry friction: Jets, the tangent and
// differences.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "models/step_tangent.h"
#include "models/stepper.h"
#include "tests/models/dry_laws.h"
#include "tests/support/dynamics_calls.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

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
TEST(DryFrictionDerivatives, IsDifferentiatedWhereItIsOff) {
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
TEST(DryFrictionDerivatives, StopsTheDerivativesOfAJointAtRest) {
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
TEST(DryFrictionDerivatives, LocksAJointByAnImpulse) {
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

INSTANTIATE_TEST_SUITE_P(
    All, DryFrictionLaws,
    testing::Values(Law{"Coulomb", CoulombTwoLinks, CoulombLevel},
                    Law{"Stribeck", StribeckTwoLinks, StribeckLevel}),
    [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace sysid
