#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "models/effects/catalogue.h"
#include "models/math/rotation.h"
#include "tests/support/conditioning.h"
#include "tests/support/dynamics_calls.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"
#include "tests/support/test_effects.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

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
  const Catalogue catalogue = WithDynamicsEffects();
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
