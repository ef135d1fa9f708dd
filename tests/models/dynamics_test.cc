#include "models/dynamics.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <set>

#include "models/effects/catalogue.h"
#include "tests/support/conditioning.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/link_poses.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"
#include "tests/support/test_effects.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr int kTrees = 200;

struct Errors {
  double round_trip = 0.0;   // ABA of RNEA against qdd, Conditioning units
  double mass_matrix = 0.0;  // ABA against M^-1 (tau - bias)
  std::set<JointType> seen;
};

Errors WorstErrors(bool with_effects) {
  const Catalogue catalogue = WithDynamicsEffects();
  Errors worst;
  for (int tree = 0; tree < kTrees; ++tree) {
    Random random(tree);
    Model model(RandomTree(tree, &random));
    // The inverse dynamics below do not know the efforts.
    if (with_effects) {
      AddEveryEffect(catalogue, &random, &model, kReadsEffort);
    }
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
    const Model model(RandomTree(tree, &random));
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
    const Model model(RandomTree(tree, &random));
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
    const Model model(RandomTree(tree, &random));
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
    const Model model(RandomTree(tree, &random));
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

}  // namespace
}  // namespace sysid
