#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "models/dry_friction.h"
#include "models/dynamics.h"
#include "models/dynamics_tangent.h"
#include "models/effects/catalogue.h"
#include "models/hold_joints.h"
#include "models/state.h"
#include "models/stepper.h"
#include "tests/support/conditioning.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/error_text.h"
#include "tests/support/link_poses.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kTrees = 60;

// The same with indices that leave the mimics out.
Mechanism Numbered(const Mechanism& mechanism) {
  return HoldJoints(mechanism, {});
}

// A random tree in which many joints follow others: earlier or later ones,
// movers or other followers.
Mechanism TreeWithMimics(int number, bool balls, Random* random) {
  for (;;) {
    Mechanism tree = RandomMechanism(4 + number % 5, random);
    std::vector<int> order(tree.joints.size());
    std::iota(order.begin(), order.end(), 0);
    for (size_t i = order.size(); i > 1; --i) {
      std::swap(order[i - 1], order[random->Integer(static_cast<int>(i))]);
    }
    std::vector<int> leaders;
    int mimics = 0;
    bool has_ball = false;
    for (const int j : order) {
      Joint& joint = tree.joints[j];
      has_ball |= joint.type == JointType::kSpherical;
      if (VelocitySize(joint.type) != 1) continue;
      if (!leaders.empty() && random->Uniform(0, 1) < 0.6) {
        const int count = static_cast<int>(leaders.size());
        joint.mimic = Mimic{tree.joints[leaders[random->Integer(count)]].name,
                            random->Uniform(-2, 2), random->Normal()};
        ++mimics;
      }
      leaders.push_back(j);
    }
    if (mimics > 0 && (balls || !has_ball)) return Numbered(tree);
  }
}

// M(q) from the motion of each link by itself, by differences.
MatrixXd InertiaOfLinks(const Mechanism& mechanism, const VectorXd& q) {
  MatrixXd M = MatrixXd::Zero(mechanism.nv, mechanism.nv);
  const std::vector<Eigen::Isometry3d> X = LinkPoses(mechanism, q);
  for (size_t link = 1; link < mechanism.links.size(); ++link) {
    const Inertial<double>& body = mechanism.nominal.links[link];
    MatrixXd Jv(3, mechanism.nv), Jw(3, mechanism.nv);
    for (int k = 0; k < mechanism.nv; ++k) {
      const LinkRates rates =
          RatesByDifferences(mechanism, q, VectorXd::Unit(mechanism.nv, k),
                             static_cast<int>(link));
      Jv.col(k) = rates.v_com;
      Jw.col(k) = rates.w;
    }
    const Eigen::Matrix3d R = X[link].linear();
    M += body.mass * Jv.transpose() * Jv +
         Jw.transpose() * R * body.inertia * R.transpose() * Jw;
  }
  return M;
}

double Potential(const Mechanism& mechanism, const VectorXd& q) {
  double energy = 0.0;
  const std::vector<Eigen::Isometry3d> X = LinkPoses(mechanism, q);
  for (size_t link = 1; link < mechanism.links.size(); ++link) {
    const Inertial<double>& body = mechanism.nominal.links[link];
    energy += body.mass * mechanism.nominal.gravity * (X[link] * body.com).z();
  }
  return energy;
}

TEST(FollowedBy, MakesOneOfAChain) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  const Inertial<double> body = Body(1, {0.1, 0, 0}, {0.01, 0.01, 0.01});
  for (const char* name : {"a", "b", "c"}) {
    Joint joint = MakeJoint(name, JointType::kRevolute, 0, Vector3d::UnitX());
    if (joint.name == "a") joint.mimic = Mimic{"b", 2.0, 0.5};
    if (joint.name == "b") joint.mimic = Mimic{"c", -3.0, 0.25};
    mechanism.AddJoint(joint, joint.name + "_link", {0, 0, 0}, body);
  }
  EXPECT_EQ(mechanism.nv, 1);
  EXPECT_THAT(mechanism.JointNames(), ::testing::ElementsAre("c"));
  const Followed a = FollowedBy(mechanism, 0), c = FollowedBy(mechanism, 2);
  EXPECT_EQ(a.joint, 2);
  EXPECT_EQ(a.multiplier, -6.0);
  EXPECT_EQ(a.offset, 1.0);
  EXPECT_EQ(c.joint, 2);
  EXPECT_EQ(c.multiplier, 1.0);
}

TEST(Followers, ForwardDynamicsInvertInverseDynamics) {
  double round_trip = 0.0, mass_matrix = 0.0;
  for (int tree = 0; tree < kTrees; ++tree) {
    Random random(tree);
    const Model model(TreeWithMimics(tree, true, &random));
    Workspace<double> ws(model);
    for (int draw = 0; draw < 5; ++draw) {
      const RandomState x(model.mechanism(), &random);
      const MatrixXd M = Inertia(&ws, x.q);
      const VectorXd bias = Inverse(&ws, x.q, x.qd, VectorXd::Zero(model.nv()));
      const VectorXd qdd = Forward(&ws, x.q, x.qd, x.tau);
      mass_matrix =
          std::max(mass_matrix, Conditioning(M, x.tau, bias)
                                    .Units(qdd, M.ldlt().solve(x.tau - bias)));
      const VectorXd tau = Inverse(&ws, x.q, x.qd, x.qdd);
      round_trip =
          std::max(round_trip, Conditioning(M, tau, bias)
                                   .Units(Forward(&ws, x.q, x.qd, tau), x.qdd));
    }
  }
  EXPECT_LT(round_trip, Conditioning::kTolerance);
  EXPECT_LT(mass_matrix, Conditioning::kTolerance);
}

TEST(Followers, HaveTheKinematicsAndTheInertiaOfTheMovingLinks) {
  for (int tree = 0; tree < kTrees; ++tree) {
    Random random(tree);
    const Model model(TreeWithMimics(tree, true, &random));
    const Mechanism& mechanism = model.mechanism();
    Workspace<double> ws(model);
    const RandomState x(mechanism, &random);
    ForwardKinematics<double>(&ws, x.q.data());
    const std::vector<Eigen::Isometry3d> X = LinkPoses(mechanism, x.q);
    for (size_t i = 0; i < X.size(); ++i) {
      EXPECT_LT(
          (LinkPosition<double>(ws, static_cast<int>(i)) - X[i].translation())
              .norm(),
          1e-12);
    }
    const MatrixXd M = Inertia(&ws, x.q);
    EXPECT_LT((M - InertiaOfLinks(mechanism, x.q)).norm(), 1e-9 * M.norm());
    EXPECT_NEAR(KineticEnergy(&ws, x.q.data(), x.qd.data()),
                0.5 * x.qd.dot(M * x.qd),
                1e-12 * M.norm() * x.qd.squaredNorm());
    // What does not move has no part in the one.
    const RandomState y(mechanism, &random);
    EXPECT_NEAR(
        PotentialEnergy(&ws, x.q.data()) - PotentialEnergy(&ws, y.q.data()),
        Potential(mechanism, x.q) - Potential(mechanism, y.q), 1e-9);
  }
}

// tau = d/dt dT/dqd - dT/dq + dV/dq, of the links' own energies.
TEST(Followers, ObeyLagrange) {
  for (int tree = 0; tree < kTrees / 3; ++tree) {
    Random random(tree);
    const Model model(TreeWithMimics(tree, false, &random));
    const Mechanism& mechanism = model.mechanism();
    Workspace<double> ws(model);
    const RandomState x(mechanism, &random);
    const int nv = mechanism.nv;
    const auto momentum = [&](const VectorXd& q) -> VectorXd {
      return Inertia(&ws, q) * x.qd;
    };
    const VectorXd drift =
        RiddersDifference(
            [&](double h) -> VectorXd { return momentum(x.q + h * x.qd); },
            0.05)
            .value;
    VectorXd tau = Inertia(&ws, x.q) * x.qdd + drift;
    for (int k = 0; k < nv; ++k) {
      tau[k] -= RiddersDifference(
                    [&](double h) -> VectorXd {
                      const VectorXd q = x.q + h * VectorXd::Unit(nv, k);
                      return VectorXd::Constant(1, 0.5 * x.qd.dot(momentum(q)) -
                                                       Potential(mechanism, q));
                    },
                    0.05)
                    .value[0];
    }
    const VectorXd found = Inverse(&ws, x.q, x.qd, x.qdd);
    EXPECT_LT((found - tau).norm(), 1e-8 * tau.norm()) << tree;
  }
}

// An arm with a gripper: multipliers 2 and -1, offsets, a chain of two mimics,
// a slide that a hinge follows.
Mechanism Arm() {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  const auto add = [&](const std::string& name, JointType type, int parent,
                       const Vector3d& axis, double mass,
                       std::optional<Mimic> mimic) {
    Joint joint = MakeJoint(name, type, parent, axis);
    joint.mimic = mimic;
    mechanism.AddJoint(joint, name + "_link", {0.1, 0.05, -0.3},
                       Body(mass, {0.05, 0.02, -0.1}, {0.02, 0.025, 0.015}));
  };
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(),
                 z = Vector3d::UnitZ();
  add("shoulder", JointType::kRevolute, 0, y, 1.0, {});
  add("elbow", JointType::kRevolute, 1, y, 0.8, Mimic{"shoulder", 2.0, 0.3});
  add("slide", JointType::kPrismatic, 2, x, 0.4, {});
  add("wheel", JointType::kContinuous, 3, z, 0.3, Mimic{"slide", 5.0, 0.0});
  add("thumb", JointType::kRevolute, 2, x, 0.2, Mimic{"finger", -1.0, 0.1});
  add("finger", JointType::kRevolute, 2, x, 0.2, Mimic{"wrist", -0.5, -0.2});
  add("wrist", JointType::kRevolute, 1, z, 0.5, {});
  return mechanism;
}

TEST(Followers, ConserveTheEnergy) {
  const Model model(Arm());
  ASSERT_EQ(model.nv(), 3);
  ASSERT_EQ(model.followers().size(), 4u);
  Workspace<double> ws(model);
  const auto energy = [&](const VectorXd& x) {
    return KineticEnergy(&ws, x.data(), x.data() + 3) +
           PotentialEnergy(&ws, x.data());
  };
  VectorXd x(6);
  x << 0.7, 0.05, -0.4, 0.5, 0.2, -1.0;
  const double start = energy(x);
  Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
  const VectorXd tau = VectorXd::Zero(3);
  double kinetic = 0.0;
  for (int k = 0; k < 2000; ++k) {
    ASSERT_TRUE(stepper.Step(1e-3, tau.data(), x.data()));
    kinetic = std::max(kinetic, KineticEnergy(&ws, x.data(), x.data() + 3));
  }
  EXPECT_GT(kinetic, 1.0);
  EXPECT_NEAR(energy(x), start, 1e-7 * kinetic);
}

// The moves of q, qd, tau, the masses and the origins of the joints.
template <typename T>
VectorX<T> MovedAcceleration(const Model& model, const RandomState& at,
                             const VectorX<T>& z) {
  const int nv = model.nv();
  VectorX<T> q = at.q.cast<T>(), qd = at.qd.cast<T>(), tau = at.tau.cast<T>();
  MechanismParameters<T> parameters;
  model.nominal().CastTo(&parameters);
  int next = 0;
  for (int i = 0; i < nv; ++i) {
    q[i] += z[next++];
    qd[i] += z[next++];
    tau[i] += z[next++];
  }
  for (size_t j = 0; j < parameters.joint_p.size(); ++j) {
    parameters.links[j + 1].mass *= z[next++] + 1.0;
    parameters.joint_p[j][1] += z[next++];
  }
  for (T& p : parameters.effects) p += z[next++];
  EXPECT_EQ(next, z.size());
  Workspace<T> ws(model);
  ws.SetParameters(parameters);
  VectorX<T> qdd(nv);
  EXPECT_TRUE(
      ForwardDynamics<T>(&ws, q.data(), qd.data(), tau.data(), qdd.data()));
  return qdd;
}

void Add(const std::string& effect, double value, Model* model) {
  model->AddEffect(Catalogue().Make(effect, model->mechanism(), "--add"));
  model->SetEffectParameter(model->effects().parameters().back().name, value);
}

TEST(Followers, HaveDerivatives) {
  Model model(Arm());
  Add("viscous_damping@elbow", 0.4, &model);
  Add("armature@wheel", 0.02, &model);
  Random random(3);
  const RandomState x(model.mechanism(), &random);
  const int size = 3 * 3 + 2 * 7 + 2;
  for (int c = 0; c < size; ++c) {
    VectorX<Jet8> z = VectorX<Jet8>::Constant(size, Jet8(0.0));
    z[c].v[0] = 1.0;
    const VectorX<Jet8> jets = MovedAcceleration<Jet8>(model, x, z);
    const VectorXd differences =
        RiddersDifference(
            [&](double h) {
              return MovedAcceleration<double>(model, x,
                                               h * VectorXd::Unit(size, c));
            },
            0.005)
            .value;
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(jets[i].v[0], differences[i],
                  1e-7 * (1.0 + differences.norm()))
          << c;
    }
  }
  EXPECT_FALSE(DynamicsTangent::Covers(model));
}

// A force -d y' at a follower, y = m q + c, is -m^2 d q' at its leader; so with
// a rotor.
TEST(Followers, ProjectDampingAndRotors) {
  Random random(5);
  Model there(Arm()), here(Arm());
  const RandomState x(there.mechanism(), &random);
  Add("viscous_damping@thumb", 0.3, &there);  // y = 0.5 wrist + ...
  Add("armature@elbow", 0.05, &there);        // y = 2 shoulder + ...
  Add("viscous_damping@wrist", 0.25 * 0.3, &here);
  Add("armature@shoulder", 4 * 0.05, &here);
  Workspace<double> a(there), b(here);
  const VectorXd qdd = Forward(&a, x.q, x.qd, x.tau);
  EXPECT_LT((qdd - Forward(&b, x.q, x.qd, x.tau)).norm(), 1e-12 * qdd.norm());
  EXPECT_LT(
      (Inverse(&a, x.q, x.qd, x.qdd) - Inverse(&b, x.q, x.qd, x.qdd)).norm(),
      1e-12);
}

TEST(Followers, AreHeldByTheirDryFriction) {
  Mechanism mechanism = Arm();
  mechanism.nominal.gravity = 0.0;
  Model model(mechanism);
  Add("coulomb_friction@elbow", 0.5, &model);
  Add("coulomb_friction@shoulder", 0.25, &model);
  Workspace<double> ws(model);
  const VectorXd q = VectorXd::Zero(3), still = VectorXd::Zero(3);
  VectorXd tau = VectorXd::Zero(3), qdd(3);
  // 2 * 0.5 + 0.25 of the shoulder.
  for (const double sign : {1.0, -1.0}) {
    tau[0] = 1.24 * sign;
    ASSERT_TRUE(RestOrSlip<double>(&ws, q.data(), still.data(), tau.data(),
                                   qdd.data()));
    EXPECT_EQ(qdd[0], 0.0);
    tau[0] = 1.3 * sign;
    ASSERT_TRUE(RestOrSlip<double>(&ws, q.data(), still.data(), tau.data(),
                                   qdd.data()));
    const VectorXd without = tau - Vector3d(1.25 * sign, 0, 0);
    const Model plain(mechanism);
    Workspace<double> free(plain);
    EXPECT_LT((qdd - Forward(&free, q, still, without)).norm(), 1e-12);
  }
  // It comes to rest, and stays there.
  Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
  VectorXd x = VectorXd::Zero(6);
  x[3] = 0.3;
  tau.setZero();
  for (int k = 0; k < 500; ++k) {
    ASSERT_TRUE(stepper.Step(0.005, tau.data(), x.data()));
  }
  EXPECT_NE(x[0], 0.0);
  const double rests = x[0];
  ASSERT_TRUE(stepper.Step(0.005, tau.data(), x.data()));
  EXPECT_EQ(x[0], rests);
}

// Dampings of a leader and of a follower, which brake by the leader's rate.
TEST(Followers, AreBrakedImplicitly) {
  const Mechanism mechanism = Arm();
  Model model(mechanism);
  ASSERT_FALSE(model.followers().empty());
  std::vector<double> size;
  for (const Joint& joint : mechanism.joints) {
    if (joint.type == JointType::kFixed) continue;
    model.AddEffect(
        Catalogue().Make("viscous_damping@" + joint.name, mechanism, "test"));
    size.push_back(0.3);
  }
  MechanismParameters<double> values = model.nominal();
  values.effects = size;
  model.SetNominal(values);
  VectorXd x0(6);
  x0 << 0.7, 0.05, -0.4, 0.5, 0.2, -1.0;
  const VectorXd tau = VectorXd::Zero(3);
  const VectorXd limit =
      Roll(model, Integrator::kRungeKutta4, x0, tau, 0.2 / 4000, 4000);
  const auto error = [&](int steps) {
    return (Roll(model, Integrator::kRosenbrock2, x0, tau, 0.2 / steps, steps) -
            limit)
        .norm();
  };
  EXPECT_NEAR(error(100) / error(200), 4.0, 0.4);
  // Far too stiff for Runge and Kutta's step, it stops.
  values.effects.assign(size.size(), 1e6);
  model.SetNominal(values);
  EXPECT_LT(
      Roll(model, Integrator::kRosenbrock2, x0, tau, 0.01, 1).tail(3).norm(),
      1e-3);
}

TEST(Followers, WithALeaderWithoutInertiaMoveIt) {
  Mechanism mechanism = Arm();
  mechanism.nominal.links[7] = Inertial<double>();  // of the wrist
  EXPECT_THAT(SingularJoints(Model(mechanism)), IsEmpty());
  mechanism.nominal.links[5] = mechanism.nominal.links[6] = Inertial<double>();
  const std::vector<SingularJoint> singular = SingularJoints(Model(mechanism));
  ASSERT_EQ(singular.size(), 1u);
  EXPECT_EQ(singular[0].text,
            "joint 'wrist': link 'wrist_link', what it carries and what "
            "follows have no, or less than no, inertia about its axis");
}

TEST(Followers, AreHeldWithTheirLeader) {
  const Mechanism held = HoldJoints(Arm(), {{6, 0.4}, {2, 0.1}});
  EXPECT_EQ(held.nv, 1);
  EXPECT_NEAR(held.joints[5].held->position, -0.4, 1e-15);
  EXPECT_NEAR(held.joints[4].held->position, 0.5, 1e-15);
  EXPECT_NEAR(held.joints[3].held->position, 0.5, 1e-15);
  const Model all(Arm()), some(held);
  ASSERT_EQ(some.followers().size(), 1u);
  Workspace<double> a(all), b(some);
  const VectorXd q = Vector3d(0.6, 0.1, 0.4), qd = Vector3d(0.9, 0, 0);
  const VectorXd first = q.head(1), rate = qd.head(1);
  const VectorXd accelerated = Vector3d(1.7, 0, 0);
  EXPECT_NEAR(Inverse(&a, q, qd, accelerated)[0],
              Inverse(&b, first, rate, accelerated.head(1))[0], 1e-12);
}

TEST(Followers, TakeLawsThatAUserTypes) {
  Random random(7);
  Model there(Arm()), here(Arm());
  const RandomState x(there.mechanism(), &random);
  Add("custom@thumb: -d*qd", 0.3, &there);
  Add("viscous_damping@thumb", 0.3, &here);
  Workspace<double> a(there), b(here);
  const VectorXd qdd = Forward(&a, x.q, x.qd, x.tau);
  EXPECT_LT((qdd - Forward(&b, x.q, x.qd, x.tau)).norm(), 1e-12 * qdd.norm());
  EXPECT_THAT(ErrorText([&] {
                Catalogue().Make("custom@thumb: exp(k*q)", Arm(), "--add");
              }),
              HasSubstr("--add: effect 'custom@thumb: exp(k*q)': no value of"));
}

TEST(Followers, HaveNoColumnsForEffects) {
  const Mechanism arm = Arm();
  EXPECT_EQ(
      ErrorText([&] { Catalogue().Make("sensor_offset@thumb", arm, "--add"); }),
      "--add: effect 'sensor_offset' has no meaning on the joint "
      "'thumb': it follows joint 'wrist' (<mimic>) and has no columns of "
      "its own\n  hint: name sensor_offset@wrist");
  EXPECT_THAT(
      ErrorText([&] { Catalogue().Make("effort_gain@elbow", arm, "--add"); }),
      HasSubstr("name effort_gain@shoulder"));
  const std::vector<std::string> candidates = Catalogue().Candidates(arm);
  EXPECT_THAT(candidates, ::testing::Contains("viscous_damping@wrist"));
  EXPECT_THAT(candidates,
              ::testing::Not(::testing::Contains("viscous_damping@thumb")));
}

}  // namespace
}  // namespace sysid
