#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <limits>

#include "tests/support/conditioning.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/test_effects.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

// Models that cannot move, and what is said about them.

// A point mass at the end of a massless rod along z.
Inertial<double> PointMass() { return Body(1.0, {0, 0, -0.5}, {0, 0, 0}); }

Inertial<double> RealBody() {
  return Body(1.0, {0, 0, -0.5}, {0.02, 0.03, 0.04});
}

// Links in a row, each 0.5 m below the one before.
Mechanism Chain(const std::vector<JointType>& types,
                const std::vector<Inertial<double>>& bodies,
                const Vector3d& axis = Vector3d::UnitY()) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  for (size_t i = 0; i < types.size(); ++i) {
    const std::string number = std::to_string(i + 1);
    mechanism.AddJoint(
        MakeJoint("joint" + number, types[i], static_cast<int>(i), axis),
        "link" + number, {0, 0, i == 0 ? 0.0 : -0.5}, bodies[i]);
  }
  return mechanism;
}

std::vector<std::string> Singular(const Mechanism& mechanism) {
  return TextsOf(SingularJoints(Model(mechanism)));
}

TEST(SingularJoints, AreNoneInRandomTrees) {
  for (int tree = 0; tree < 200; ++tree) {
    Random random(tree);
    EXPECT_THAT(Singular(RandomTree(tree, &random)), IsEmpty()) << tree;
  }
}

TEST(SingularJoints, NameASphericalJointThatCarriesAPointMass) {
  const Mechanism mechanism = Chain({JointType::kSpherical}, {PointMass()});
  const std::vector<std::string> faults = Singular(mechanism);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_THAT(faults[0], StartsWith("joint 'joint1': link 'link1' has no "
                                    "inertia about its axis ("));
  EXPECT_THAT(faults[0], HasSubstr("so its spin is undefined (a point mass on "
                                   "a massless rod?); give it a small inertia "
                                   "about that axis"));
  double x, y, z;
  ASSERT_EQ(std::sscanf(faults[0].c_str() + faults[0].find("axis (") + 6,
                        "%lf, %lf, %lf", &x, &y, &z),
            3);
  EXPECT_NEAR(std::abs(z), 1.0, 1e-3);
  EXPECT_NEAR(std::hypot(x, y), 0.0, 1e-3);
}

// A spherical joint hands no moment on: what link2 has does not help link1.
TEST(SingularJoints, NameASingularLinkThatCarriesASphericalJoint) {
  EXPECT_THAT(Singular(Chain({JointType::kSpherical, JointType::kSpherical},
                             {PointMass(), RealBody()})),
              ElementsAre(StartsWith("joint 'joint1': link 'link1'")));
  EXPECT_THAT(Singular(Chain({JointType::kSpherical, JointType::kSpherical},
                             {RealBody(), PointMass()})),
              ElementsAre(StartsWith("joint 'joint2': link 'link2'")));
  EXPECT_THAT(
      Singular(Chain(
          {JointType::kSpherical, JointType::kSpherical, JointType::kSpherical},
          {PointMass(), RealBody(), PointMass()})),
      ElementsAre(StartsWith("joint 'joint3'"), StartsWith("joint 'joint1'")));
}

TEST(SingularJoints, AreNoneWhereAHingeHandsTheMomentOn) {
  EXPECT_THAT(Singular(Chain({JointType::kSpherical, JointType::kRevolute},
                             {PointMass(), RealBody()})),
              IsEmpty());
}

TEST(SingularJoints, NameAHingeWithItsMassOnItsAxis) {
  EXPECT_THAT(
      Singular(Chain({JointType::kRevolute}, {PointMass()}, Vector3d::UnitZ())),
      ElementsAre("joint 'joint1': link 'link1' and what it carries have no "
                  "inertia about its axis"));
}

TEST(SingularJoints, NameASlideWithoutMass) {
  EXPECT_THAT(Singular(Chain({JointType::kPrismatic}, {Inertial<double>()})),
              ElementsAre("joint 'joint1': link 'link1' and what it carries "
                          "have no mass along its axis"));
}

TEST(SingularJoints, AreNoneInAUniversalJointWithAMasslessCross) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(MakeJoint("a", JointType::kRevolute, 0, Vector3d::UnitX()),
                     "cross", {0, 0, 0}, {});
  mechanism.AddJoint(MakeJoint("b", JointType::kRevolute, 1, Vector3d::UnitY()),
                     "arm", {0, 0, 0}, RealBody());
  EXPECT_THAT(Singular(mechanism), IsEmpty());
  const Model model(mechanism);
  Workspace<double> ws(model);
  Random random(7);
  const RandomState x(mechanism, &random);
  const VectorXd tau = Inverse(&ws, x.q, x.qd, x.qdd);
  const MatrixXd M = Inertia(&ws, x.q);
  EXPECT_LT(
      Conditioning(M, tau, tau).Units(Forward(&ws, x.q, x.qd, tau), x.qdd),
      Conditioning::kTolerance);
}

TEST(SingularJoints, AreCuredByArmature) {
  const Mechanism mechanism = Chain({JointType::kSpherical}, {PointMass()});
  Model model(mechanism);
  model.AddEffect(std::make_shared<TestArmature>(mechanism, "joint1"));
  EXPECT_EQ(SingularJoints(model).size(), 1u);
  model.SetEffectParameter("joint1.test_armature", 1e-3);
  EXPECT_THAT(SingularJoints(model), IsEmpty());
}

TEST(ForwardDynamics, RefusesASingularModel) {
  for (const JointType type :
       {JointType::kSpherical, JointType::kRevolute, JointType::kPrismatic}) {
    const Mechanism mechanism = Chain({type}, {Inertial<double>()});
    const Model model(mechanism);
    Workspace<double> ws(model);
    const VectorXd q = mechanism.NeutralConfiguration();
    const VectorXd zero = VectorXd::Zero(mechanism.nv);
    VectorXd qdd(mechanism.nv);
    EXPECT_FALSE(ForwardDynamics<double>(&ws, q.data(), zero.data(),
                                         zero.data(), qdd.data()))
        << ToString(type);
  }
}

TEST(ForwardDynamics, RefusesNumbersThatAreNotFinite) {
  const Mechanism mechanism = Chain(
      {JointType::kSpherical, JointType::kRevolute}, {RealBody(), RealBody()});
  const Model model(mechanism);
  Workspace<double> ws(model);
  const VectorXd q = mechanism.NeutralConfiguration();
  const VectorXd zero = VectorXd::Zero(4);
  VectorXd qdd(4);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    for (int i = 0; i < 4; ++i) {
      VectorXd tau = zero;
      tau[i] = bad;
      EXPECT_FALSE(ForwardDynamics<double>(&ws, q.data(), zero.data(),
                                           tau.data(), qdd.data()));
    }
    for (int i = 0; i < 5; ++i) {
      VectorXd at = q;
      at[i] = bad;
      EXPECT_FALSE(ForwardDynamics<double>(&ws, at.data(), zero.data(),
                                           zero.data(), qdd.data()));
    }
  }
}

}  // namespace
}  // namespace sysid
