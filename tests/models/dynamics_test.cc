#include "models/dynamics.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "models/dynamics-impl.h"
#include "models/effects/catalogue.h"
#include "tests/support/conditioning.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"
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

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr int kTrees = 200;

VectorXd Forward(Workspace<double>* ws, const VectorXd& q, const VectorXd& qd,
                 const VectorXd& tau) {
  VectorXd qdd(tau.size());
  EXPECT_TRUE(
      ForwardDynamics<double>(ws, q.data(), qd.data(), tau.data(), qdd.data()));
  return qdd;
}

VectorXd Inverse(Workspace<double>* ws, const VectorXd& q, const VectorXd& qd,
                 const VectorXd& qdd) {
  VectorXd tau(qdd.size());
  InverseDynamics<double>(ws, q.data(), qd.data(), qdd.data(), tau.data());
  return tau;
}

MatrixXd Inertia(Workspace<double>* ws, const VectorXd& q) {
  MatrixXd M;
  MassMatrix<double>(ws, q.data(), &M);
  return M;
}

// q moved by dq: a spherical joint's is a rotation vector in the child's axes.
VectorXd Moved(const Mechanism& mechanism, const VectorXd& q,
               const VectorXd& dq) {
  VectorXd out = q;
  for (const Joint& joint : mechanism.joints) {
    if (joint.type == JointType::kFixed) continue;
    if (joint.type != JointType::kSpherical) {
      out[joint.q_index] += dq[joint.v_index];
      continue;
    }
    const Vector3d u(dq[joint.v_index], dq[joint.v_index + 1],
                     dq[joint.v_index + 2]);
    const Eigen::Quaterniond at(q[joint.q_index + 3], q[joint.q_index],
                                q[joint.q_index + 1], q[joint.q_index + 2]);
    const Eigen::Quaterniond to = at * Exp<double>(u);
    for (int k = 0; k < 4; ++k) out[joint.q_index + k] = to.coeffs()[k];
  }
  return out;
}

// Where the links are, by the definition of the frames and nothing else.
std::vector<Eigen::Isometry3d> LinkPoses(const Mechanism& mechanism,
                                         const VectorXd& q) {
  std::vector<Eigen::Isometry3d> X(mechanism.links.size(),
                                   Eigen::Isometry3d::Identity());
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Joint& joint = mechanism.joints[i];
    Eigen::Isometry3d X_PC = Eigen::Isometry3d::Identity();
    X_PC.translate(mechanism.nominal.joint_p[i]);
    X_PC.rotate(joint.R_PJ);
    if (IsRotation1(joint.type)) {
      X_PC.rotate(Eigen::AngleAxisd(q[joint.q_index], joint.axis));
    } else if (joint.type == JointType::kPrismatic) {
      X_PC.translate(Vector3d(joint.axis * q[joint.q_index]));
    } else if (joint.type == JointType::kSpherical) {
      X_PC.rotate(Eigen::Quaterniond(q[joint.q_index + 3], q[joint.q_index],
                                     q[joint.q_index + 1],
                                     q[joint.q_index + 2]));
    }
    X[joint.child_link] = X[joint.parent_link] * X_PC;
  }
  return X;
}

// The velocity of a link's centre of mass and its angular velocity, world axes,
// by differences of the poses.
struct LinkRates {
  Vector3d v_com;
  Vector3d w;
};

LinkRates RatesByDifferences(const Mechanism& mechanism, const VectorXd& q,
                             const VectorXd& qd, int link) {
  const Vector3d com = mechanism.nominal.links[link].com;
  const auto rate = RiddersDifference(
      [&](double h) {
        const Eigen::Isometry3d X =
            LinkPoses(mechanism, Moved(mechanism, q, h * qd))[link];
        const Vector3d p = X * com;
        VectorXd out(12);
        for (int k = 0; k < 9; ++k) out[k] = X.matrix()(k % 3, k / 3);
        for (int k = 0; k < 3; ++k) out[9 + k] = p[k];
        return out;
      },
      0.1);
  Eigen::Matrix3d Rd;
  for (int k = 0; k < 9; ++k) Rd(k % 3, k / 3) = rate.value[k];
  const Eigen::Matrix3d R = LinkPoses(mechanism, q)[link].linear();
  const Eigen::Matrix3d W = Rd * R.transpose();  // [w]x
  return {{rate.value[9], rate.value[10], rate.value[11]},
          {W(2, 1), W(0, 2), W(1, 0)}};
}

Model RandomTree(int number, Random* random) {
  return Model(RandomMechanism(2 + number % 12, random));
}

// Every effect of the catalogue, and those of tests for the hooks that act in
// the dynamics.
Catalogue FullCatalogue() {
  Catalogue catalogue;
  catalogue.Add<TestArmature>();
  catalogue.Add<TestGravity>();
  catalogue.Add<TestLinkForce>();
  return catalogue;
}

struct Errors {
  double round_trip = 0.0;   // ABA of RNEA against qdd, Conditioning units
  double mass_matrix = 0.0;  // ABA against M^-1 (tau - bias)
  std::set<JointType> seen;
};

Errors WorstErrors(bool with_effects) {
  const Catalogue catalogue = FullCatalogue();
  Errors worst;
  for (int tree = 0; tree < kTrees; ++tree) {
    Random random(tree);
    Model model = RandomTree(tree, &random);
    if (with_effects) AddEveryEffect(catalogue, &random, &model);
    Workspace<double> ws(model);
    for (const Joint& joint : model.mechanism().joints) {
      worst.seen.insert(joint.type);
    }
    for (int draw = 0; draw < 5; ++draw) {
      const RandomState x(model.mechanism(), &random);
      const MatrixXd M = Inertia(&ws, x.q);
      const VectorXd zero = VectorXd::Zero(model.nv());
      const VectorXd bias = Inverse(&ws, x.q, x.qd, zero);
      const Conditioning conditioning(M, x.tau, bias);

      const VectorXd qdd = Forward(&ws, x.q, x.qd, x.tau);
      const VectorXd solved = M.ldlt().solve(x.tau - bias);
      worst.mass_matrix =
          std::max(worst.mass_matrix, conditioning.Units(qdd, solved));

      const VectorXd tau = Inverse(&ws, x.q, x.qd, x.qdd);
      const VectorXd back = Forward(&ws, x.q, x.qd, tau);
      worst.round_trip = std::max(
          worst.round_trip, Conditioning(M, tau, bias).Units(back, x.qdd));
    }
  }
  std::printf("worst over cond eps: ABA(RNEA) %.2g, ABA against CRBA %.2g\n",
              worst.round_trip, worst.mass_matrix);
  return worst;
}

TEST(Dynamics, AreConsistentOnRandomTrees) {
  const Errors worst = WorstErrors(false);
  EXPECT_LT(worst.round_trip, Conditioning::kTolerance);
  EXPECT_LT(worst.mass_matrix, Conditioning::kTolerance);
  EXPECT_EQ(worst.seen.size(), 5u) << "not every joint type was drawn";
}

TEST(Dynamics, AreConsistentOnRandomTreesWithEveryEffect) {
  const Errors worst = WorstErrors(true);
  EXPECT_LT(worst.round_trip, Conditioning::kTolerance);
  EXPECT_LT(worst.mass_matrix, Conditioning::kTolerance);
}

TEST(ForwardKinematics, PutsEveryLinkWhereTheFramesSay) {
  for (int tree = 0; tree < 50; ++tree) {
    Random random(tree);
    const Model model = RandomTree(tree, &random);
    Workspace<double> ws(model);
    const RandomState x(model.mechanism(), &random);
    ForwardKinematics<double>(&ws, x.q.data());
    const auto poses = LinkPoses(model.mechanism(), x.q);
    for (size_t i = 0; i < poses.size(); ++i) {
      const Vector3d p = LinkPosition<double>(ws, static_cast<int>(i));
      // Some epsilon a joint, up to 13 of them.
      EXPECT_LT((p - poses[i].translation()).norm(),
                100 * kEpsilon * (1.0 + p.norm()));
    }
  }
}

TEST(MassMatrix, GivesTheKineticEnergyOfTheMovingMasses) {
  for (int tree = 0; tree < 20; ++tree) {
    Random random(tree);
    const Model model = RandomTree(tree, &random);
    const Mechanism& mechanism = model.mechanism();
    Workspace<double> ws(model);
    const RandomState x(mechanism, &random);
    double energy = 0.0;
    for (size_t i = 1; i < mechanism.links.size(); ++i) {
      const Inertial<double>& body = mechanism.nominal.links[i];
      const int link = static_cast<int>(i);
      const LinkRates rates = RatesByDifferences(mechanism, x.q, x.qd, link);
      const Vector3d w =
          LinkPoses(mechanism, x.q)[i].linear().transpose() * rates.w;
      energy += 0.5 * body.mass * rates.v_com.squaredNorm() +
                0.5 * w.dot(body.inertia * w);
    }
    // Ridders' differences are good to 1e-12 of numbers of order 10.
    EXPECT_NEAR(KineticEnergy(&ws, x.q.data(), x.qd.data()) / energy, 1.0,
                1e-10);
  }
}

TEST(PotentialEnergy, IsTheWeightTimesTheHeightOfTheMovingMasses) {
  for (int tree = 0; tree < 20; ++tree) {
    Random random(tree);
    const Model model = RandomTree(tree, &random);
    const Mechanism& mechanism = model.mechanism();
    Workspace<double> ws(model);
    const RandomState x(mechanism, &random);
    const auto poses = LinkPoses(mechanism, x.q);
    double energy = 0.0, scale = 1.0;
    for (size_t i = 1; i < mechanism.links.size(); ++i) {
      if (model.placement(static_cast<int>(i)).body < 0) continue;
      const Inertial<double>& body = mechanism.nominal.links[i];
      const double part = 9.81 * body.mass * (poses[i] * body.com).z();
      energy += part;
      scale += std::abs(part);
    }
    EXPECT_NEAR(PotentialEnergy(&ws, x.q.data()), energy,
                100 * kEpsilon * scale);
  }
}

// dE/dt = tau . qd without losses: ties ABA, CRBA and the energies together
// along an actual motion.
TEST(Dynamics, ChangeTheEnergyByThePowerOfTheDrives) {
  for (int tree = 0; tree < 20; ++tree) {
    Random random(tree);
    const Model model = RandomTree(tree, &random);
    Workspace<double> ws(model);
    const RandomState x(model.mechanism(), &random);
    const VectorXd qdd = Forward(&ws, x.q, x.qd, x.tau);
    const auto power = RiddersDifference(
        [&](double h) {
          const VectorXd q = Moved(model.mechanism(), x.q, h * x.qd);
          const VectorXd qd = x.qd + h * qdd;
          return VectorXd::Constant(1, KineticEnergy(&ws, q.data(), qd.data()) +
                                           PotentialEnergy(&ws, q.data()))
              .eval();
        },
        0.01);
    const double scale = 1.0 + (x.tau.cwiseProduct(x.qd)).cwiseAbs().sum();
    // Energies of order 100 J over steps of 1e-2 to 5e-4 s.
    EXPECT_NEAR(power.value[0], x.tau.dot(x.qd), 1e-9 * scale) << tree;
  }
}

// --- Closed forms -----------------------------------------------------------

Inertial<double> Body(double mass, const Vector3d& com,
                      const Vector3d& moments) {
  Inertial<double> body;
  body.mass = mass;
  body.com = com;
  body.inertia = moments.asDiagonal();
  return body;
}

Joint MakeJoint(const std::string& name, JointType type, int parent,
                const Vector3d& axis) {
  Joint joint;
  joint.name = name;
  joint.type = type;
  joint.parent_link = parent;
  joint.axis = axis;
  return joint;
}

TEST(ForwardDynamics, MatchesThePendulum) {
  constexpr double kMass = 1.3, kLength = 0.7, kMoment = 0.05;
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(
      MakeJoint("joint1", JointType::kRevolute, 0, Vector3d::UnitY()), "link1",
      {0.1, 0.2, 0.3}, Body(kMass, {0, 0, -kLength}, {0.09, kMoment, 0.08}));
  const Model model(mechanism);
  Workspace<double> ws(model);
  const double inertia = kMoment + kMass * kLength * kLength;
  for (double q = -4.0; q < 4.0; q += 0.37) {
    const double expected =
        (0.4 - kMass * 9.81 * kLength * std::sin(q)) / inertia;
    const VectorXd qdd =
        Forward(&ws, VectorXd::Constant(1, q), VectorXd::Constant(1, 2.0),
                VectorXd::Constant(1, 0.4));
    EXPECT_NEAR(qdd[0], expected, 20 * kEpsilon * 9.81 / kLength);
  }
}

// Euler's equation about the pivot, in body axes:
// I_o wd + w x I_o w = tau + c x m R^T g.
TEST(ForwardDynamics, MatchesTheSphericalPendulum) {
  const Inertial<double> body = Body(0.8, {0.1, -0.3, 0.2}, {0.05, 0.06, 0.07});
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(
      MakeJoint("joint1", JointType::kSpherical, 0, Vector3d::UnitZ()), "link1",
      {0.1, 0.2, 0.3}, body);
  const Model model(mechanism);
  Workspace<double> ws(model);
  const Eigen::Matrix3d about_pivot =
      body.inertia +
      body.mass * (body.com.squaredNorm() * Eigen::Matrix3d::Identity() -
                   body.com * body.com.transpose());
  Random random(1);
  for (int n = 0; n < 50; ++n) {
    const RandomState x(mechanism, &random);
    const Vector3d w = x.qd, tau = x.tau;
    const Eigen::Quaterniond q(Eigen::Vector4d(x.q));
    const Vector3d weight = q.conjugate() * Vector3d(0, 0, -9.81 * body.mass);
    const Vector3d expected =
        about_pivot.inverse() *
        (tau + body.com.cross(weight) - w.cross(Vector3d(about_pivot * w)));
    EXPECT_LT((Forward(&ws, x.q, x.qd, x.tau) - expected).norm(),
              200 * kEpsilon * expected.norm());
  }
}

// Cart of mass M along x, pole of mass m hanging at distance l, moment I about
// its centre, angle q about y (its centre is at x - l sin q, -l cos q):
//   (M + m) xdd - m l cos(q) qdd + m l sin(q) qd^2 = F
//   (I + m l^2) qdd - m l cos(q) xdd + m g l sin(q) = tau.
TEST(ForwardDynamics, MatchesTheCartPole) {
  constexpr double kCart = 2.0, kMass = 0.6, kLength = 0.4, kMoment = 0.02;
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(
      MakeJoint("cart", JointType::kPrismatic, 0, Vector3d::UnitX()), "cart",
      {0, 0, 0.5}, Body(kCart, {0.1, 0.2, 0.3}, {1, 1, 1}));
  mechanism.AddJoint(
      MakeJoint("pole", JointType::kContinuous, 1, Vector3d::UnitY()), "pole",
      {0, 0, 0.2}, Body(kMass, {0, 0, -kLength}, {0.03, kMoment, 0.04}));
  const Model model(mechanism);
  Workspace<double> ws(model);
  Random random(2);
  for (int n = 0; n < 50; ++n) {
    const RandomState x(mechanism, &random);
    const double s = std::sin(x.q[1]), c = std::cos(x.q[1]);
    const double ml = kMass * kLength;
    Eigen::Matrix2d M;
    M << kCart + kMass, -ml * c, -ml * c, kMoment + ml * kLength;
    const Eigen::Vector2d rhs(x.tau[0] - ml * s * x.qd[1] * x.qd[1],
                              x.tau[1] - ml * 9.81 * s);
    const Eigen::Vector2d expected = M.inverse() * rhs;
    const VectorXd qdd = Forward(&ws, x.q, x.qd, x.tau);
    EXPECT_LT((qdd - expected).norm(), 200 * kEpsilon * (1 + expected.norm()));
  }
}

TEST(ForwardDynamics, MatchesASlideUpAnIncline) {
  const Vector3d axis = Vector3d(2, 3, 6) / 7.0;
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(MakeJoint("slide", JointType::kPrismatic, 0, axis), "car",
                     {0, 0, 0}, Body(4.0, {0.1, 0.2, 0.3}, {1, 1, 1}));
  const Model model(mechanism);
  Workspace<double> ws(model);
  const VectorXd qdd =
      Forward(&ws, VectorXd::Constant(1, 0.3), VectorXd::Constant(1, -1.0),
              VectorXd::Constant(1, 10.0));
  EXPECT_NEAR(qdd[0], 10.0 / 4.0 - 9.81 * 6.0 / 7.0, 20 * kEpsilon);
}

// A slide on a turning arm: rdd = r qd^2 + F / m and
// (I + m r^2) qdd + 2 m r rd qd = tau, in the horizontal plane.
TEST(ForwardDynamics, HasCentrifugalAndCoriolisForcesOnASlide) {
  constexpr double kMass = 0.5, kMoment = 0.3;
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.AddJoint(
      MakeJoint("turn", JointType::kRevolute, 0, Vector3d::UnitZ()), "arm",
      {0, 0, 0}, Body(1.0, {0, 0, 0}, {1, 1, kMoment}));
  mechanism.AddJoint(
      MakeJoint("slide", JointType::kPrismatic, 1, Vector3d::UnitX()), "bead",
      {0, 0, 0}, Body(kMass, {0, 0, 0}, {0, 0, 0}));
  const Model model(mechanism);
  Workspace<double> ws(model);
  const Eigen::Vector2d q(0.4, 0.8), qd(1.5, -0.6), tau(0.2, 0.1);
  const VectorXd qdd = Forward(&ws, q, qd, tau);
  EXPECT_NEAR(qdd[1], q[1] * qd[0] * qd[0] + tau[1] / kMass, 20 * kEpsilon);
  EXPECT_NEAR(qdd[0],
              (tau[0] - 2 * kMass * q[1] * qd[1] * qd[0]) /
                  (kMoment + kMass * q[1] * q[1]),
              20 * kEpsilon);
}

// --- Gravity and the hooks of effects ---------------------------------------

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
  class Ramp : public EffortSignal {
   public:
    const double* At(double time) const override {
      value_[0] = time;
      value_[1] = 10.0 * time;
      return value_;
    }

   private:
    mutable double value_[2];
  };
  Mechanism mechanism;
  mechanism.AddRoot("root");
  const Inertial<double> body = Body(1.0, {0, 0, 1}, {1, 1, 1});
  mechanism.AddJoint(MakeJoint("a", JointType::kRevolute, 0, Vector3d::UnitX()),
                     "link_a", {0, 0, 0}, body);
  mechanism.AddJoint(MakeJoint("b", JointType::kRevolute, 1, Vector3d::UnitX()),
                     "link_b", {0, 0, 1}, body);
  Model model(mechanism);
  model.AddEffect(std::make_shared<TestMeasurement>(mechanism, "b"));
  model.AddEffect(std::make_shared<TestInput>(mechanism, "base"));
  model.SetEffectParameter("b.test_scale", 0.5);
  model.SetEffectParameter("test_input_gain", 1.0);
  model.SetEffectParameter("test_input_drift", 0.25);
  Workspace<double> ws(model);
  EXPECT_THAT(ws.effort_effects, IsEmpty());
  EXPECT_THAT(ws.link_force_effects, IsEmpty());
  ASSERT_EQ(ws.measurement_effects.size(), 1u);
  ASSERT_EQ(ws.input_effects.size(), 1u);
  EXPECT_EQ(ws.measurement_effects[0].body, 1);
  double q = 4.0;
  ws.measurement_effects[0].hooks->ModifyMeasurement(
      ws.measurement_effects[0].p, &q);
  EXPECT_EQ(q, 6.0);
  double tau[2] = {0.0, 0.0};
  ws.input_effects[0].hooks->ModifyInput(Ramp(), 2.0, ws.input_effects[0].p,
                                         tau);
  EXPECT_EQ(tau[0], 2 * 1.5 + 0.25 * 2.0);
  EXPECT_EQ(tau[1], 2 * 15.0 + 0.25 * 2.0);
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

// --- Models that cannot move ------------------------------------------------

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
  return SingularJoints(Model(mechanism));
}

TEST(SingularJoints, AreNoneInRandomTrees) {
  for (int tree = 0; tree < kTrees; ++tree) {
    Random random(tree);
    EXPECT_THAT(SingularJoints(RandomTree(tree, &random)), IsEmpty()) << tree;
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

// --- Jets -------------------------------------------------------------------

// Everything that the dynamics depend on, moved from a point by the vector
// A z: positions along their tangents, velocities, accelerations, efforts,
// and every parameter.
template <typename T>
class MovedPoint {
 public:
  VectorX<T> q, qd, qdd, tau;
  MechanismParameters<T> parameters;

  MovedPoint(const Model& model, const RandomState& x, const VectorX<T>& moves)
      : moves_(moves) {
    const Mechanism& mechanism = model.mechanism();
    q = x.q.cast<T>();
    for (const Joint& joint : mechanism.joints) {
      T* at = q.data() + joint.q_index;
      if (joint.type == JointType::kSpherical) {
        const Quaternion<T> to = Multiply<T>(
            Quaternion<T>(at[3], at[0], at[1], at[2]), Exp<T>(Next3()));
        for (int k = 0; k < 4; ++k) at[k] = to.coeffs()[k];
      } else if (joint.type != JointType::kFixed) {
        *at += Next();
      }
    }
    qd = Moved(x.qd);
    qdd = Moved(x.qdd);
    tau = Moved(x.tau);
    const MechanismParameters<double>& nominal = model.nominal();
    for (const Inertial<double>& body : nominal.links) {
      Inertial<T> moved;
      moved.mass = body.mass * (Next() + 1.0);
      moved.com = body.com.cast<T>() + Next3();
      moved.inertia = body.inertia.cast<T>() * (Next() + 1.0);
      const double scale = 0.01 * body.inertia.trace();
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < i; ++j) {
          const T change = Next() * scale;
          moved.inertia(i, j) += change;
          moved.inertia(j, i) += change;
        }
      }
      parameters.links.push_back(moved);
    }
    for (const Vector3d& p : nominal.joint_p) {
      parameters.joint_p.push_back(p.cast<T>() + Next3());
    }
    parameters.gravity = nominal.gravity + Next();
    for (const double value : nominal.effects) {
      parameters.effects.push_back(value * (Next() + 1.0));
    }
  }

 private:
  T Next() { return moves_[cursor_++ % moves_.size()]; }
  Vector3<T> Next3() {
    const T x = Next(), y = Next(), z = Next();
    return Vector3<T>(x, y, z);
  }
  VectorX<T> Moved(const VectorXd& from) {
    VectorX<T> to = from.cast<T>();
    for (int i = 0; i < to.size(); ++i) to[i] += Next();
    return to;
  }

  const VectorX<T> moves_;
  int cursor_ = 0;
};

// All that the dynamics compute: ABA, RNEA, CRBA, positions of links.
template <typename T>
VectorX<T> Everything(const Model& model, const RandomState& x,
                      const VectorX<T>& moves) {
  const MovedPoint<T> at(model, x, moves);
  Workspace<T> ws(model);
  ws.SetParameters(at.parameters);
  const int nv = model.nv();
  VectorX<T> qdd(nv), tau(nv);
  EXPECT_TRUE(ForwardDynamics<T>(&ws, at.q.data(), at.qd.data(), at.tau.data(),
                                 qdd.data()));
  InverseDynamics<T>(&ws, at.q.data(), at.qd.data(), at.qdd.data(), tau.data());
  MatrixX<T> M;
  MassMatrix<T>(&ws, at.q.data(), &M);
  ForwardKinematics<T>(&ws, at.q.data());
  std::vector<T> all(qdd.data(), qdd.data() + nv);
  all.insert(all.end(), tau.data(), tau.data() + nv);
  all.insert(all.end(), M.data(), M.data() + M.size());
  for (size_t i = 0; i < model.mechanism().links.size(); ++i) {
    const Vector3<T> p = LinkPosition<T>(ws, static_cast<int>(i));
    all.insert(all.end(), p.data(), p.data() + 3);
  }
  VectorX<T> out(all.size());
  for (size_t i = 0; i < all.size(); ++i) out[i] = all[i];
  return out;
}

// The largest error of a Jet's derivative over what the differences can know:
// the conditioning's rounding of the value, over the size of their steps.
template <int N>
double WorstJetError(bool at_zero) {
  using T = ceres::Jet<double, N>;
  const Catalogue catalogue = FullCatalogue();
  double worst = 0.0;
  for (int tree = 0; tree < 6; ++tree) {
    Random random(100 * N + tree);
    Model model(RandomMechanism(3 + tree, &random));
    AddEveryEffect(catalogue, &random, &model);
    RandomState x(model.mechanism(), &random);
    if (at_zero) {
      x.q = model.mechanism().NeutralConfiguration();
      x.qd.setZero();
    }
    // Directions: each Jet's component moves everything at once.
    const int moves = 401;  // prime: more than there are quantities
    MatrixXd directions(moves, N);
    for (int k = 0; k < N; ++k) {
      directions.col(k) = 0.1 * random.NormalVector(moves);
    }
    VectorX<T> seeded(moves);
    for (int i = 0; i < moves; ++i) {
      seeded[i] = T(0.0);
      for (int k = 0; k < N; ++k) seeded[i].v[k] = directions(i, k);
    }
    const VectorX<T> jets = Everything<T>(model, x, seeded);
    Workspace<double> ws(model);
    const MatrixXd M = Inertia(&ws, x.q);
    const double condition = Conditioning(M, x.tau, x.tau).condition();
    for (int k = 0; k < N; ++k) {
      // The smoothing speed of Coulomb friction on a slide, 1e-3 m/s, bounds
      // the first step: within it the law must be smooth.
      constexpr double kStep = 2e-3;
      const auto d = RiddersDifference(
          [&](double h) {
            return Everything<double>(model, x, directions.col(k) * h);
          },
          kStep);
      double value = 0.0, error = 0.0;
      for (int i = 0; i < jets.size(); ++i) {
        EXPECT_TRUE(std::isfinite(jets[i].v[k]));
        value = std::max(value,
                         std::abs(jets[i].a) + std::abs(jets[i].v[k]) * kStep);
        error = std::max(error, std::abs(jets[i].v[k] - d.value[i]));
      }
      worst = std::max(worst, error / (condition * kEpsilon * value / kStep));
    }
  }
  std::printf("Jet%d at %s: worst derivative %.2g cond eps / step\n", N,
              at_zero ? "zero" : "generic points", worst);
  return worst;
}

// Ridders' tableau takes differences of steps down to a twentieth of the first
// and amplifies their rounding some more: 100 in units of the first.
constexpr double kJetTolerance = 100.0;

TEST(DynamicsJets, MatchDifferencesAtGenericPoints) {
  EXPECT_LT(WorstJetError<8>(false), kJetTolerance);
  EXPECT_LT(WorstJetError<16>(false), kJetTolerance);
  EXPECT_LT(WorstJetError<24>(false), kJetTolerance);
}

TEST(DynamicsJets, MatchDifferencesAtRestAtZeroRotation) {
  EXPECT_LT(WorstJetError<8>(true), kJetTolerance);
  EXPECT_LT(WorstJetError<16>(true), kJetTolerance);
  EXPECT_LT(WorstJetError<24>(true), kJetTolerance);
}

}  // namespace
}  // namespace sysid
