#include "models/state.h"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/all_joints.h"
#include "tests/support/random_mechanism.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

const Model& TheModel() {
  static const Model& model = *new Model(AllJoints());
  return model;
}

VectorXd RandomX(Random* random) {
  const RandomState at(TheModel().mechanism(), random);
  VectorXd x(TheModel().state_size());
  x << at.q, at.qd;
  return x;
}

VectorXd Plus(const VectorXd& x, const VectorXd& dx) {
  VectorXd out(x.size());
  BoxPlus<double>(TheModel(), x.data(), dx.data(), out.data());
  return out;
}

VectorXd Minus(const VectorXd& x1, const VectorXd& x0) {
  VectorXd dx(TheModel().tangent_size());
  BoxMinus<double>(TheModel(), x1.data(), x0.data(), dx.data());
  return dx;
}

const Body& Ball() {
  for (const Body& body : TheModel().bodies()) {
    if (body.type == JointType::kSpherical) return body;
  }
  ADD_FAILURE();
  return TheModel().bodies().front();
}

// Tangents from rounding to nearly half a turn.
class SizeTest : public testing::TestWithParam<double> {};

TEST_P(SizeTest, MinusTakesBackWhatPlusAdded) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const VectorXd x = RandomX(&random);
    VectorXd dx = random.NormalVector(TheModel().tangent_size());
    dx.segment<3>(Ball().v_index).normalize();
    dx *= GetParam();
    const VectorXd back = Minus(Plus(x, dx), x);
    EXPECT_LT((back - dx).norm(), 1e-14 * (1.0 + x.norm() + dx.norm()) * 30);
  }
}

TEST_P(SizeTest, PlusReachesWhatMinusMeasured) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const VectorXd x0 = RandomX(&random);
    VectorXd dx = random.NormalVector(TheModel().tangent_size());
    dx.segment<3>(Ball().v_index).normalize();
    VectorXd x1 = Plus(x0, GetParam() * dx);
    // The other sign is the same rotation.
    if (i % 2 == 0) x1.segment<4>(Ball().q_index) *= -1.0;
    VectorXd back = Plus(x0, Minus(x1, x0));
    auto q = back.segment<4>(Ball().q_index);
    if (q.dot(x1.segment<4>(Ball().q_index)) < 0) q *= -1.0;
    EXPECT_LT((back - x1).norm(), 1e-12 * (1.0 + x1.norm()));
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, SizeTest,
                         testing::Values(0.0, 1e-12, 1e-6, 1e-4, 1e-3, 3e-3,
                                         0.0101, 0.3, 2.0, 3.1));

TEST(BoxPlus, MayWriteOverItsInput) {
  Random random(3);
  const VectorXd x = RandomX(&random);
  const VectorXd dx = random.NormalVector(TheModel().tangent_size());
  VectorXd over = x;
  BoxPlus<double>(TheModel(), over.data(), dx.data(), over.data());
  EXPECT_EQ(over, Plus(x, dx));
}

// What (3.1) is for: a rod that is twisted about itself keeps swinging as it
// did.
TEST(BoxPlus, OfARotationLeavesTheAngularVelocityInTheParentsAxes) {
  Random random(4);
  const Body& ball = Ball();
  const int w = TheModel().nq() + ball.v_index;
  for (int i = 0; i < 20; ++i) {
    const VectorXd x = RandomX(&random);
    VectorXd dx = VectorXd::Zero(TheModel().tangent_size());
    dx.segment<3>(ball.v_index) = random.NormalVector(3);
    const VectorXd moved = Plus(x, dx);
    const auto in_parent = [&](const VectorXd& state) {
      const Eigen::Quaterniond q(
          Eigen::Vector4d(state.segment<4>(ball.q_index)));
      return Vector3d(q * Vector3d(state.segment<3>(w)));
    };
    EXPECT_LT((in_parent(moved) - in_parent(x)).norm(), 1e-14 * 10);
    // And not in the child's: the two differ here.
    EXPECT_GT((moved - x).segment<3>(w).norm(), 1e-3);
  }
}

TEST(BoxPlus, ChangesTheVelocityInTheChildsAxes) {
  Random random(5);
  const VectorXd x = RandomX(&random);
  VectorXd dx = VectorXd::Zero(TheModel().tangent_size());
  dx.tail(TheModel().nv()) = random.NormalVector(TheModel().nv());
  const VectorXd moved = Plus(x, dx);
  EXPECT_EQ(moved.head(TheModel().nq()), x.head(TheModel().nq()));
  EXPECT_LT((moved - x -
             (VectorXd(x.size()) << VectorXd::Zero(TheModel().nq()),
              dx.tail(TheModel().nv()))
                 .finished())
                .norm(),
            1e-15 * 10);
}

// Jets at zero, where a norm would give NaN.
TEST(BoxPlus, HasAFiniteDerivativeAtZeroThatEqualsDifferences) {
  Random random(6);
  const int tangent = TheModel().tangent_size();
  const VectorXd x0 = RandomX(&random);
  for (int column = 0; column < tangent; ++column) {
    std::vector<Jet8> x(x0.begin(), x0.end()), dx(tangent), out(x0.size());
    dx[column].v[0] = 1.0;
    BoxPlus<Jet8>(TheModel(), x.data(), dx.data(), out.data());
    const auto difference = RiddersDifference(
        [&](double h) { return Plus(x0, h * VectorXd::Unit(tangent, column)); },
        0.1);
    for (int i = 0; i < x0.size(); ++i) {
      ASSERT_TRUE(std::isfinite(out[i].v[0]));
      EXPECT_EQ(out[i].a, x0[i]);
      EXPECT_NEAR(out[i].v[0], difference.value[i], 1e-10);
    }
  }
}

TEST(BoxMinus, HasAFiniteDerivativeAtZeroWhichIsTheIdentity) {
  Random random(7);
  const int tangent = TheModel().tangent_size();
  const VectorXd x0 = RandomX(&random);
  for (int column = 0; column < tangent; ++column) {
    std::vector<Jet8> center(x0.begin(), x0.end()), dx(tangent),
        moved(x0.size()), back(tangent);
    dx[column].v[0] = 1.0;
    BoxPlus<Jet8>(TheModel(), center.data(), dx.data(), moved.data());
    BoxMinus<Jet8>(TheModel(), moved.data(), center.data(), back.data());
    for (int i = 0; i < tangent; ++i) {
      EXPECT_NEAR(back[i].v[0], i == column ? 1.0 : 0.0, 1e-14);
    }
  }
}

}  // namespace
}  // namespace sysid
