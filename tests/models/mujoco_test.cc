#include <gtest/gtest.h>

#include <cstdlib>
#include <set>

#include "models/dry_friction.h"
#include "models/dynamics.h"
#include "models/effects/catalogue.h"
#include "models/effects/viscous_damping.h"
#include "tests/support/conditioning.h"
#include "tests/support/mujoco_model.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/test_effects.h"

// An engine that is not ours as the oracle of the dynamics: MuJoCo 2.2, whose
// algorithms (composite inertias about the subtree's centre of mass, sparse
// factorisation) share nothing with an ABA in world axes.

namespace sysid {
namespace {

constexpr int kTrees = 200;

// The largest error of the rotations and positions themselves is some epsilon
// a joint; relative errors of matrices and forces follow.
constexpr double kKinematicTolerance = 1e-13;

double RelativeError(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).norm() / b.norm();
}

TEST(MuJoCo, AgreesOnPositionsInertiasForcesAndAccelerationsOfRandomTrees) {
  double worst_acceleration = 0.0, worst_inertia = 0.0, worst_bias = 0.0;
  std::set<JointType> seen;
  for (int tree = 0; tree < kTrees; ++tree) {
    Random random(1000 + tree);
    const Mechanism mechanism = RandomTree(tree, &random);
    const Model model(mechanism);
    Workspace<double> ws(model);
    MujocoModel mujoco(mechanism, {});
    for (const Joint& joint : mechanism.joints) seen.insert(joint.type);
    for (int draw = 0; draw < 3; ++draw) {
      SCOPED_TRACE("tree " + std::to_string(tree));
      const RandomState x(mechanism, &random);
      mujoco.Forward(x.q, x.qd, x.tau);

      ForwardKinematics<double>(&ws, x.q.data());
      for (size_t link = 0; link < mechanism.links.size(); ++link) {
        const int i = static_cast<int>(link);
        EXPECT_LT((LinkPosition<double>(ws, i) - mujoco.LinkPosition(i)).norm(),
                  kKinematicTolerance * (1.0 + mujoco.LinkPosition(i).norm()));
      }

      Eigen::MatrixXd M;
      MassMatrix<double>(&ws, x.q.data(), &M);
      worst_inertia =
          std::max(worst_inertia, RelativeError(M, mujoco.MassMatrix()));

      const Eigen::VectorXd zero = Eigen::VectorXd::Zero(mechanism.nv);
      Eigen::VectorXd bias(mechanism.nv);
      InverseDynamics<double>(&ws, x.q.data(), x.qd.data(), zero.data(),
                              bias.data());
      worst_bias = std::max(worst_bias, RelativeError(bias, mujoco.Bias()));

      Eigen::VectorXd qdd(mechanism.nv);
      ASSERT_TRUE(ForwardDynamics<double>(&ws, x.q.data(), x.qd.data(),
                                          x.tau.data(), qdd.data()));
      const double error =
          Conditioning(M, x.tau, bias).Units(qdd, mujoco.Acceleration());
      worst_acceleration = std::max(worst_acceleration, error);
      EXPECT_LT(error, Conditioning::kTolerance);
    }
  }
  EXPECT_LT(worst_inertia, kKinematicTolerance);
  EXPECT_LT(worst_bias, kKinematicTolerance);
  EXPECT_EQ(seen.size(), 5u) << "not every joint type was drawn";
  RecordProperty("worst_acceleration_over_cond_epsilon",
                 std::to_string(worst_acceleration));
  std::printf("worst: qdd %.2g cond eps, M %.2g, bias %.2g\n",
              worst_acceleration, worst_inertia, worst_bias);
}

TEST(MuJoCo, AgreesOnViscousDampingOfEveryJointType) {
  const Catalogue catalogue;
  double worst = 0.0;
  for (int tree = 0; tree < kTrees; ++tree) {
    SCOPED_TRACE("tree " + std::to_string(tree));
    Random random(2000 + tree);
    Mechanism mechanism = RandomTree(tree, &random);
    for (Joint& joint : mechanism.joints) {
      if (joint.type != JointType::kFixed) {
        joint.damping = random.Uniform(0.1, 2.0);
      }
    }
    const Model model = MakeModel(mechanism, catalogue);
    Workspace<double> ws(model);
    MujocoModel mujoco(mechanism, {});
    const RandomState x(mechanism, &random);
    mujoco.Forward(x.q, x.qd, x.tau);
    Eigen::VectorXd qdd(mechanism.nv);
    ASSERT_TRUE(ForwardDynamics<double>(&ws, x.q.data(), x.qd.data(),
                                        x.tau.data(), qdd.data()));
    Eigen::MatrixXd M;
    MassMatrix<double>(&ws, x.q.data(), &M);
    worst = std::max(worst, Conditioning(M, x.tau, mujoco.Bias())
                                .Units(qdd, mujoco.Acceleration()));
  }
  EXPECT_LT(worst, Conditioning::kTolerance);
  std::printf("worst: qdd %.2g cond eps\n", worst);
}

// Who of all joints that stand still rests, and who breaks away and to which
// side, is one coupled problem; MuJoCo solves it as a convex one, a little
// softened: a joint that is held creeps away with 1e-4 of the acceleration that
// it would have, and the others feel that.
TEST(MuJoCo, AgreesOnWhichJointsDryFrictionHolds) {
  int rest = 0, slip = 0;
  double worst = 0.0;
  for (int tree = 0; tree < kTrees; ++tree) {
    SCOPED_TRACE("tree " + std::to_string(tree));
    Random random(4000 + tree);
    Mechanism mechanism = RandomTree(tree, &random);
    for (Joint& joint : mechanism.joints) {
      if (joint.type == JointType::kFixed) continue;
      joint.damping = 0.1;
      // Ours is of a ball's direction, theirs of each axis.
      if (joint.type == JointType::kSpherical) continue;
      joint.friction = random.Uniform(0.1, 8.0);
    }
    const Model model = MakeModel(mechanism, Catalogue());
    Workspace<double> ws(model);
    MujocoModel mujoco(mechanism, {});
    RandomState x(mechanism, &random);
    x.qd.setZero();
    mujoco.Forward(x.q, x.qd, x.tau);
    Eigen::VectorXd qdd(mechanism.nv), free(mechanism.nv);
    ASSERT_TRUE(RestOrSlip<double>(&ws, x.q.data(), x.qd.data(), x.tau.data(),
                                   qdd.data()));
    ASSERT_TRUE(ForwardDynamics<double>(&ws, x.q.data(), x.qd.data(),
                                        x.tau.data(), free.data()));
    for (const int i : ws.dry_bodies) {
      ++(qdd[model.bodies()[i].v_index] == 0.0 ? rest : slip);
    }
    worst = std::max(worst, (qdd - mujoco.Acceleration()).norm() / free.norm());
  }
  std::printf("worst: qdd %.2g of the free one, %d rest, %d slip\n", worst,
              rest, slip);
  EXPECT_GT(rest, 100);
  EXPECT_GT(slip, 100);
  EXPECT_LT(worst, 1e-3);
}

TEST(MuJoCo, AgreesOnArmatureOfEveryJointType) {
  double worst = 0.0, worst_inertia = 0.0;
  for (int tree = 0; tree < kTrees; ++tree) {
    SCOPED_TRACE("tree " + std::to_string(tree));
    Random random(3000 + tree);
    const Mechanism mechanism = RandomTree(tree, &random);
    Model model(mechanism);
    std::vector<double> armature;
    for (const Joint& joint : mechanism.joints) {
      armature.push_back(random.Uniform(0.01, 0.5));
      if (joint.type == JointType::kFixed) continue;
      model.AddEffect(std::make_shared<TestArmature>(mechanism, joint.name));
      model.SetEffectParameter(joint.name + ".test_armature", armature.back());
    }
    Workspace<double> ws(model);
    MujocoModel mujoco(mechanism, armature);
    const RandomState x(mechanism, &random);
    mujoco.Forward(x.q, x.qd, x.tau);
    Eigen::VectorXd qdd(mechanism.nv);
    ASSERT_TRUE(ForwardDynamics<double>(&ws, x.q.data(), x.qd.data(),
                                        x.tau.data(), qdd.data()));
    Eigen::MatrixXd M;
    MassMatrix<double>(&ws, x.q.data(), &M);
    worst_inertia =
        std::max(worst_inertia, RelativeError(M, mujoco.MassMatrix()));
    worst = std::max(worst, Conditioning(M, x.tau, mujoco.Bias())
                                .Units(qdd, mujoco.Acceleration()));
  }
  EXPECT_LT(worst, Conditioning::kTolerance);
  EXPECT_LT(worst_inertia, kKinematicTolerance);
  std::printf("worst: qdd %.2g cond eps, M %.2g\n", worst, worst_inertia);
}

// The oracle itself must be able to say no: a changed number is a failure.
TEST(MuJoCo, DisagreesWhereTheModelsDiffer) {
  Random random(4000);
  const Mechanism mechanism = RandomMechanism(6, &random);
  Mechanism other = mechanism;
  other.nominal.links.back().mass *= 1.0 + 1e-6;
  other.nominal.links[1].inertia *= 1.0 + 1e-6;
  const Model model(other);
  Workspace<double> ws(model);
  MujocoModel mujoco(mechanism, {});
  const RandomState x(mechanism, &random);
  mujoco.Forward(x.q, x.qd, x.tau);
  Eigen::VectorXd qdd(mechanism.nv);
  ASSERT_TRUE(ForwardDynamics<double>(&ws, x.q.data(), x.qd.data(),
                                      x.tau.data(), qdd.data()));
  Eigen::MatrixXd M;
  MassMatrix<double>(&ws, x.q.data(), &M);
  EXPECT_GT(
      Conditioning(M, x.tau, mujoco.Bias()).Units(qdd, mujoco.Acceleration()),
      10 * Conditioning::kTolerance);
}

}  // namespace
}  // namespace sysid
