#include "models/internal_state.h"

#include <gmock/gmock.h>

#include <cmath>
#include <string>

#include "models/effects/catalogue.h"
#include "models/integrator.h"
#include "models/state.h"
#include "tests/support/all_joints.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/random_mechanism.h"

// Effects that remember: z of a model's state.

namespace sysid {
namespace {

using Eigen::VectorXd;

void Add(const std::string& name, const std::vector<double>& values,
         Model* model) {
  const auto effect = Catalogue().Make(name, model->mechanism(), "test");
  model->AddEffect(effect);
  for (size_t i = 0; i < values.size(); ++i) {
    model->SetEffectParameter(effect->parameters()[i].name, values[i]);
  }
}

// A mass of 2 kg on a slide, nothing else: no weight acts along it.
Mechanism Cart() {
  Mechanism mechanism;
  mechanism.AddRoot("rail");
  mechanism.AddJoint(
      MakeJoint("slide", JointType::kPrismatic, 0, Eigen::Vector3d::UnitX()),
      "cart", {0, 0, 0}, Body(2.0, {0, 0, 0}, {1, 1, 1}));
  return mechanism;
}

TEST(StateLayout, HasWhatEffectsRememberBehindPositionsAndVelocities) {
  Model model{AllJoints()};
  const int nq = model.nq(), nv = model.nv();
  EXPECT_EQ(model.layout().nz(), 0);
  Add("viscous_damping@hinge", {0.1}, &model);
  EXPECT_EQ(model.layout().nz(), 0);
  Add("joint_elasticity@slide", {}, &model);
  Add("presliding_friction@hinge", {}, &model);
  EXPECT_EQ(model.layout().nz(), 3);
  EXPECT_EQ(model.state_size(), nq + nv + 3);
  EXPECT_EQ(model.tangent_size(), 2 * nv + 3);
  EXPECT_EQ(model.layout().z(), nq + nv);
  EXPECT_EQ(model.layout().dz(), 2 * nv);
  EXPECT_EQ(model.z_index(0), -1);
  EXPECT_EQ(model.z_index(1), 0);
  EXPECT_EQ(model.z_index(2), 2);
  // Backlash takes the place of elasticity, whose numbers it has.
  Add("backlash@slide", {}, &model);
  EXPECT_EQ(model.layout().nz(), 3);
}

// l z' = qd - |qd| z along a way that turns back, by small steps.
TEST(PreslidingFriction, RemembersTheWayAsDahlsEquationSays) {
  Model model(Cart());
  const double length = 0.01;
  Add("presliding_friction@slide", {3.0, length}, &model);
  Workspace<double> ws(model);
  VectorXd x = NeutralState(model), before = x;
  double z = 0.0, at = 0.0;
  for (const double end : {0.004, 0.03, 0.025, -0.5, -0.495}) {
    before = x;
    x[model.layout().q()] = end;
    MoveStates(&ws, before.data(), x.data());
    constexpr int kSteps = 200000;
    const double way = (end - at) / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const double middle = z + 0.5 * (way - std::abs(way) * z) / length;
      z += (way - std::abs(way) * middle) / length;
    }
    at = end;
    EXPECT_NEAR(x[model.layout().z()], z, 1e-8);
    EXPECT_LE(std::abs(x[model.layout().z()]), 1.0);
  }
}

// It swings as on a spring of c / l while it is far from slipping.
TEST(PreslidingFriction, IsASpringAboutRest) {
  Model model(Cart());
  Add("presliding_friction@slide", {8.0, 0.01}, &model);  // 800 N/m on 2 kg
  const double w = 20.0, amplitude = 1e-7;
  VectorXd x = NeutralState(model);
  x[model.layout().qd()] = w * amplitude;
  const int steps = 300;
  const double h = 0.25 * 2 * M_PI / w / steps;
  x = Roll(model, Integrator::kRungeKutta4, x, VectorXd::Zero(1), h, steps);
  EXPECT_NEAR(x[0], amplitude, 1e-4 * amplitude);
  EXPECT_NEAR(x[model.layout().qd()], 0.0, 1e-4 * w * amplitude);
}

// However far a step goes: the law is stiff where it slips.
TEST(PreslidingFriction, IsItsLevelWhereItSlips) {
  Model model(Cart());
  Add("presliding_friction@slide", {3.0, 1e-5}, &model);
  VectorXd x = NeutralState(model);
  x[model.layout().qd()] = 2.0;
  x = Roll(model, Integrator::kRungeKutta4, x, VectorXd::Zero(1), 0.01, 50);
  EXPECT_NEAR(x[model.layout().qd()], 2.0 - 0.5 * 3.0 / 2.0, 2e-2);
  EXPECT_NEAR(x[model.layout().z()], 1.0, 1e-12);
}

// What the motor and the joint have of momentum is what the effort gave.
TEST(JointElasticity, KeepsTheMomentum) {
  for (const char* name : {"joint_elasticity@slide", "backlash@slide"}) {
    SCOPED_TRACE(name);
    Model model(Cart());
    Add(name, {500.0, 3.0, 0.4}, &model);
    VectorXd x = NeutralState(model);
    x[model.layout().qd()] = 0.3;
    x[model.layout().z() + 1] = -0.2;
    const double before = 2.0 * 0.3 - 0.4 * 0.2;
    x = Roll(model, Integrator::kRungeKutta4, x, VectorXd::Constant(1, 5.0),
             1e-3, 400);
    const double after =
        2.0 * x[model.layout().qd()] + 0.4 * x[model.layout().z() + 1];
    EXPECT_NEAR(after - before, 5.0 * 0.4, 1e-12);
    // It has swung meanwhile.
    EXPECT_GT(std::abs(x[model.layout().qd()] - before / 2.4 - 5.0 * 0.4 / 2.4),
              0.01);
  }
}

TEST(JointElasticity, SwingsAtTheFrequencyOfItsTwoInertias) {
  Model model(Cart());
  Add("joint_elasticity@slide", {500.0, 0.0, 0.5}, &model);
  const double w = std::sqrt(500.0 * (1 / 2.0 + 1 / 0.5));
  VectorXd x = NeutralState(model);
  x[model.layout().z()] = 0.02;  // bent
  const int steps = 400;
  x = Roll(model, Integrator::kRungeKutta4, x, VectorXd::Zero(1),
           2 * M_PI / w / steps, steps);
  EXPECT_NEAR(x[model.layout().z()], 0.02, 1e-9);
  EXPECT_NEAR(x[0], 0.0, 1e-9);
}

TEST(Backlash, LeavesTheJointAloneWithinTheGap) {
  Model model(Cart());
  Add("backlash@slide", {500.0, 3.0, 0.5, 0.1}, &model);
  VectorXd x = NeutralState(model);
  x[model.layout().z() + 1] = 0.3;
  x = Roll(model, Integrator::kRungeKutta4, x, VectorXd::Zero(1), 1e-3, 50);
  EXPECT_NEAR(x[model.layout().z()], 0.015, 1e-3);
  EXPECT_LT(std::abs(x[model.layout().qd()]), 5e-3);
  // Beyond it the teeth take the joint along.
  x = Roll(model, Integrator::kRungeKutta4, x, VectorXd::Zero(1), 1e-3, 400);
  EXPECT_GT(x[model.layout().qd()], 0.03);
}

// With no gap it is elasticity.
TEST(Backlash, IsElasticityWithoutAGap) {
  Model gap(Cart()), elastic(Cart());
  Add("backlash@slide", {500.0, 3.0, 0.5, 0.0}, &gap);
  Add("joint_elasticity@slide", {500.0, 3.0, 0.5}, &elastic);
  VectorXd x(4);
  x << 0.1, 0.2, 0.03, -0.4;
  const VectorXd effort = VectorXd::Constant(1, 5.0);
  const VectorXd a = Roll(gap, Integrator::kRungeKutta4, x, effort, 1e-3, 100);
  const VectorXd b =
      Roll(elastic, Integrator::kRungeKutta4, x, effort, 1e-3, 100);
  EXPECT_LT((a - b).norm(), 1e-12);
}

// A step of each integrator is of its order, with z in the state.
TEST(Integrator, IsOfItsOrderWithWhatEffectsRemember) {
  Model model{AllJoints()};
  Add("joint_elasticity@hinge", {200.0, 0.5, 0.2}, &model);
  Add("backlash@wheel", {300.0, 0.5, 0.3, 0.2}, &model);
  Add("presliding_friction@slide", {2.0, 0.3}, &model);
  Random random(3);
  const RandomState at(model.mechanism(), &random);
  VectorXd x = VectorXd::Zero(model.state_size());
  x.head(model.nq()) = at.q;
  x.segment(model.nq(), model.nv()) = at.qd;
  const int slide = model.mechanism().FindJoint("slide");
  x[model.layout().qd(model.mechanism().joints[slide])] = 3.0;  // one way
  x.tail(5) << 0.1, 0.3, 0.2, -0.3, 0.2;
  const VectorXd held = VectorXd::Constant(model.held_size(), 0.7);
  const double span = 0.02;
  for (const Integrator integrator :
       {Integrator::kRungeKutta4, Integrator::kSemiImplicitEuler,
        Integrator::kRosenbrock2}) {
    const auto end = [&](int steps) {
      return Roll(model, integrator, x, held, span / steps, steps);
    };
    const VectorXd fine = end(512);
    const double ratio = (end(32) - fine).norm() / (end(64) - fine).norm();
    EXPECT_NEAR(std::log2(ratio), Order(integrator), 0.5);
  }
}

TEST(AdoptState, KeepsWhatBothRememberAndStartsTheRest) {
  Model from(Cart()), to(Cart());
  Add("joint_elasticity@slide", {500.0, 3.0, 0.5}, &from);
  Add("presliding_friction@slide", {2.0, 0.01}, &to);
  Add("backlash@slide", {500.0, 3.0, 0.5, 0.1}, &to);
  VectorXd x(4), expected(5);
  x << 1, 2, 3, 4;
  expected << 1, 2, 0, 3, 4;
  EXPECT_EQ(AdoptState(from, x.data(), to), expected);
  const Model none(Cart());
  EXPECT_EQ(AdoptState(from, x.data(), none), x.head(2));
  // A motor starts as fast as its joint.
  expected << 1, 2, 0, 0, 2;
  EXPECT_EQ(AdoptState(none, x.data(), to), expected);
  EXPECT_TRUE(SameStates(from, from));
  EXPECT_FALSE(SameStates(from, to));
}

}  // namespace
}  // namespace sysid
