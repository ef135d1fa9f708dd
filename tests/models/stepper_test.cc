#include "models/stepper.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/integrator.h"
#include "models/state.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/error_text.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// A chain of spherical joints and one hinge, bodies of no symmetry.
Mechanism SphericalChain() {
  Random random(5);
  Mechanism mechanism;
  mechanism.AddRoot("base");
  for (int i = 0; i < 3; ++i) {
    const JointType type =
        i == 2 ? JointType::kRevolute : JointType::kSpherical;
    mechanism.AddJoint(MakeJoint("joint" + std::to_string(i + 1), type, i,
                                 Vector3d(2, 3, 6) / 7.0),
                       "link" + std::to_string(i + 1),
                       i == 0 ? Vector3d::Zero() : Vector3d(0.1, 0, -0.4),
                       RandomInertial(&random));
  }
  return mechanism;
}

VectorXd StateOf(const RandomState& at) {
  VectorXd x(at.q.size() + at.qd.size());
  x << at.q, at.qd;
  return x;
}

double Energy(const Model& model, const VectorXd& x) {
  Workspace<double> ws(model);
  return KineticEnergy(&ws, x.data(), x.data() + model.nq()) +
         PotentialEnergy(&ws, x.data());
}

TEST(Integrator, KeepsTheEnergyOfUndampedRandomChains) {
  Random random(1);
  for (int number = 0; number < 20; ++number) {
    const Model model(RandomMechanism(2 + number % 5, &random));
    const VectorXd x0 = StateOf(RandomState(model.mechanism(), &random));
    const VectorXd tau = VectorXd::Zero(model.nv());
    Workspace<double> ws(model);
    const double moving =
        KineticEnergy(&ws, x0.data(), x0.data() + model.nq()) +
        model.nominal().links.size() * 9.81;
    const auto drift = [&](double h) {
      const int steps = static_cast<int>(std::lround(0.5 / h));
      const VectorXd x =
          Roll(model, Integrator::kRungeKutta4, x0, tau, h, steps);
      return std::abs(Energy(model, x) - Energy(model, x0)) / moving;
    };
    EXPECT_LT(drift(2.5e-4), 1e-8) << "mechanism " << number;
  }
}

TEST(Integrator, KeepsQuaternionsUnit) {
  const Model model(SphericalChain());
  Random random(2);
  const VectorXd x0 = StateOf(RandomState(model.mechanism(), &random));
  const VectorXd x = Roll(model, Integrator::kRungeKutta4, x0,
                          VectorXd::Zero(model.nv()), 0.01, 1000);
  EXPECT_NEAR(x.segment<4>(0).norm(), 1.0, 1e-12);
  EXPECT_NEAR(x.segment<4>(4).norm(), 1.0, 1e-12);
}

// A damping that would stop the joint within 1e-4 of a step: the speed is gone
// after one, and the joint has hardly moved.
TEST(Integrator, Rosenbrock2StopsAStiffJoint) {
  Model model(SphericalChain());
  const Catalogue catalogue;
  for (const char* joint : {"joint1", "joint2", "joint3"}) {
    model.AddEffect(catalogue.Make(std::string("viscous_damping@") + joint,
                                   model.mechanism(), "test"));
  }
  MechanismParameters<double> values = model.nominal();
  for (double& damping : values.effects) damping = 1e6;
  model.SetNominal(values);
  Random random(6);
  const VectorXd x0 = StateOf(RandomState(model.mechanism(), &random));
  const VectorXd x = Roll(model, Integrator::kRosenbrock2, x0,
                          VectorXd::Zero(model.nv()), 0.01, 1);
  const VectorXd qd = x.tail(model.nv());
  EXPECT_LT(qd.norm(), 1e-3 * x0.tail(model.nv()).norm());
  EXPECT_LT((x - x0).head(model.nq()).norm(), 1e-4);
}

// Errors after 0.4 s at falling steps against the same integrator's limit.
class OrderTest : public testing::TestWithParam<Integrator> {};
// Of those whose Jets are the derivatives of the step; Rosenbrock's holds D.
class DerivativeTest : public OrderTest {};

TEST_P(OrderTest, ShowsUnderStepHalvingWithSphericalJoints) {
  const Integrator integrator = GetParam();
  Model model(SphericalChain());
  for (const char* effect :
       {"viscous_damping@joint1", "coulomb_friction@joint2"}) {
    model.AddEffect(Catalogue().Make(effect, model.mechanism(), "test"));
  }
  MechanismParameters<double> values = model.nominal();
  values.effects = {0.3, 0.05};
  model.SetNominal(values);
  Random random(3);
  RandomState at(model.mechanism(), &random);
  at.tau *= 0.1;
  const VectorXd x0 = StateOf(at);
  const double duration = 0.4;
  const VectorXd limit = Roll(model, Integrator::kRungeKutta4, x0, at.tau,
                              duration / 20000, 20000);
  const auto error = [&](int steps) {
    const VectorXd x =
        Roll(model, integrator, x0, at.tau, duration / steps, steps);
    VectorXd dx(model.tangent_size());
    BoxMinus<double>(model, x.data(), limit.data(), dx.data());
    return dx.norm();
  };
  const double expected = std::pow(2.0, Order(integrator));
  const int coarse = Order(integrator) == 4 ? 100 : 800;
  double before = error(coarse);
  for (int steps = 2 * coarse; steps <= 8 * coarse; steps *= 2) {
    const double after = error(steps);
    EXPECT_NEAR(before / after, expected, 0.1 * expected) << steps << " steps";
    before = after;
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, OrderTest,
                         testing::Values(Integrator::kSemiImplicitEuler,
                                         Integrator::kRungeKutta4,
                                         Integrator::kRosenbrock2),
                         [](const auto& info) { return ToString(info.param); });

INSTANTIATE_TEST_SUITE_P(Integrators, DerivativeTest,
                         testing::Values(Integrator::kSemiImplicitEuler,
                                         Integrator::kRungeKutta4),
                         [](const auto& info) { return ToString(info.param); });

TEST(Integrator, SemiImplicitEulerMovesWithTheNewVelocity) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  mechanism.AddJoint(
      MakeJoint("slide", JointType::kPrismatic, 0, Vector3d::UnitX()), "car",
      Vector3d::Zero(), Body(2.0, Vector3d::Zero(), Vector3d::Ones()));
  const Model model(mechanism);
  const VectorXd x =
      Roll(model, Integrator::kSemiImplicitEuler, Eigen::Vector2d(1.0, 0.5),
           VectorXd::Constant(1, 3.0), 0.1, 1);
  EXPECT_DOUBLE_EQ(x[1], 0.5 + 0.1 * 3.0 / 2.0);
  EXPECT_DOUBLE_EQ(x[0], 1.0 + 0.1 * x[1]);
}

TEST(Integrator, HoldsTheEffortsOverAStep) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  mechanism.AddJoint(
      MakeJoint("slide", JointType::kPrismatic, 0, Vector3d::UnitX()), "car",
      Vector3d::Zero(), Body(2.0, Vector3d::Zero(), Vector3d::Ones()));
  const Model model(mechanism);
  // Under a constant force the motion is a parabola, which the step meets.
  const VectorXd x =
      Roll(model, Integrator::kRungeKutta4, Eigen::Vector2d(1.0, 0.5),
           VectorXd::Constant(1, 3.0), 0.1, 1);
  EXPECT_DOUBLE_EQ(x[1], 0.5 + 0.1 * 1.5);
  EXPECT_DOUBLE_EQ(x[0], 1.0 + 0.1 * 0.5 + 0.5 * 0.01 * 1.5);
}

TEST_P(DerivativeTest, JetsThroughAStepEqualDifferences) {
  const Integrator integrator = GetParam();
  Random random(4);
  const Catalogue catalogue;
  for (int number = 0; number < 20; ++number) {
    Model model(RandomMechanism(1 + number % 6, &random));
    // But pairs of joints, which may turn against each other so that what they
    // share nearly rests (gear_coupling_test.cc).
    AddEveryEffect(catalogue, &random, &model, kPairHook);
    const int nv = model.nv(), tangent = model.tangent_size();
    RandomState at(model.mechanism(), &random);
    // No joint stops within the step: what that does to the derivatives is of
    // the flow, and of the step to its own error (dry_friction_test.cc).
    for (double& rate : at.qd) rate += std::copysign(0.5, rate);
    // Nor does an effort change its sign, at which friction by load bends.
    for (double& effort : at.tau) effort += std::copysign(0.5, effort);
    const VectorXd x0 = StateOf(at);
    const VectorXd dx = 0.1 * random.NormalVector(tangent);
    const VectorXd dtau = random.NormalVector(nv);
    const double h = 0.001;

    Workspace<Jet8> ws(model);
    Stepper<Jet8> stepper(integrator, &ws);
    std::vector<Jet8> x(x0.begin(), x0.end()), move(tangent), tau(nv);
    for (int i = 0; i < tangent; ++i) move[i].v[0] = dx[i];
    for (int i = 0; i < nv; ++i) {
      tau[i] = Jet8(at.tau[i]);
      tau[i].v[0] = dtau[i];
    }
    BoxPlus<Jet8>(model, x.data(), move.data(), x.data());
    ASSERT_TRUE(stepper.Step(h, tau.data(), x.data()));

    Workspace<double> plain_ws(model);
    Stepper<double> plain(integrator, &plain_ws);
    const auto difference = RiddersDifference(
        [&](double s) {
          VectorXd moved = x0;
          const VectorXd step = s * dx, effort = at.tau + s * dtau;
          BoxPlus<double>(model, x0.data(), step.data(), moved.data());
          EXPECT_TRUE(plain.Step(h, effort.data(), moved.data()));
          return moved;
        },
        0.05);
    VectorXd by_jets(model.state_size());
    for (int i = 0; i < by_jets.size(); ++i) by_jets[i] = x[i].v[0];
    EXPECT_LT((by_jets - difference.value).norm(),
              1e-8 * (1.0 + by_jets.norm()))
        << "mechanism " << number;
  }
}

TEST(Integrator, FailsWhereTheDynamicsDo) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  mechanism.AddJoint(
      MakeJoint("hinge", JointType::kRevolute, 0, Vector3d::UnitY()), "link",
      Vector3d::Zero(), {});
  const Model model(mechanism);
  Workspace<double> ws(model);
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kRungeKutta4}) {
    Stepper<double> stepper(integrator, &ws);
    Eigen::Vector2d x(0.1, 0.0);
    const double tau = 0.0;
    EXPECT_FALSE(stepper.Step(0.01, &tau, x.data()));
  }
}

TEST(Integrator, IsReadByItsName) {
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kRungeKutta4}) {
    EXPECT_EQ(ParseIntegrator(ToString(integrator), ""), integrator);
  }
  EXPECT_EQ(ErrorText([] { ParseIntegrator("rk5", "--integrator"); }),
            "--integrator: unknown integrator 'rk5'\n"
            "  hint: did you mean 'rk4'?");
}

}  // namespace
}  // namespace sysid
