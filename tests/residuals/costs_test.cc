#include "residuals/costs.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/state.h"
#include "tests/support/all_joints.h"
#include "tests/support/measured_run.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd RandomX(const Model& model, Random* random) {
  const RandomState at(model.mechanism(), random);
  VectorXd x(model.state_size());
  x << at.q, at.qd;
  return x;
}

VectorXd Residuals(const ceres::CostFunction& cost,
                   const std::vector<VectorXd>& blocks) {
  std::vector<const double*> parameters;
  for (const VectorXd& block : blocks) parameters.push_back(block.data());
  VectorXd r(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(parameters.data(), r.data(), nullptr));
  return r;
}

// Derivatives by each block's tangent against differences. (Not
// ceres::GradientChecker: it compares entry by entry, so that 1e-17 beside a
// difference of 1e-12 fails, and it hands over matrices that Debian's libceres
// allocated, which our objects, with -march=native, free in another way.)
void ExpectGradients(const ceres::CostFunction& cost,
                     const std::vector<const ceres::Manifold*>& manifolds,
                     const std::vector<VectorXd>& blocks,
                     double tolerance = 1e-8) {
  const int rows = cost.num_residuals();
  std::vector<RowMatrixXd> jacobians;
  std::vector<const double*> parameters;
  std::vector<double*> pointers;
  for (const VectorXd& block : blocks) {
    jacobians.emplace_back(rows, block.size());
    parameters.push_back(block.data());
  }
  for (RowMatrixXd& J : jacobians) pointers.push_back(J.data());
  VectorXd r(rows);
  ASSERT_TRUE(cost.Evaluate(parameters.data(), r.data(), pointers.data()));
  EXPECT_LT((r - Residuals(cost, blocks)).norm(), 1e-13 * (1.0 + r.norm()));
  for (size_t b = 0; b < blocks.size(); ++b) {
    const ceres::Manifold* manifold = manifolds[b];
    RowMatrixXd J = jacobians[b];
    if (manifold != nullptr) {
      RowMatrixXd plus(J.cols(), manifold->TangentSize());
      ASSERT_TRUE(manifold->PlusJacobian(parameters[b], plus.data()));
      J *= plus;
    }
    for (int column = 0; column < J.cols(); ++column) {
      const auto difference = RiddersDifference(
          [&](double h) {
            std::vector<VectorXd> moved = blocks;
            const VectorXd step = h * VectorXd::Unit(J.cols(), column);
            if (manifold == nullptr) {
              moved[b] += step;
            } else {
              EXPECT_TRUE(
                  manifold->Plus(parameters[b], step.data(), moved[b].data()));
            }
            return Residuals(cost, moved);
          },
          2e-3);
      EXPECT_LT((J.col(column) - difference.value).norm(),
                tolerance * (1.0 + J.col(column).norm()))
          << "block " << b << ", column " << column;
    }
  }
}

// --- StateManifold: what every manifold of Ceres has to keep ----------------

class StateManifoldTest : public testing::Test {
 protected:
  VectorXd Plus(const VectorXd& x, const VectorXd& delta) const {
    VectorXd out(manifold_.AmbientSize());
    EXPECT_TRUE(manifold_.Plus(x.data(), delta.data(), out.data()));
    return out;
  }
  VectorXd Minus(const VectorXd& y, const VectorXd& x) const {
    VectorXd out(manifold_.TangentSize());
    EXPECT_TRUE(manifold_.Minus(y.data(), x.data(), out.data()));
    return out;
  }
  RowMatrixXd PlusJacobian(const VectorXd& x) const {
    RowMatrixXd J(manifold_.AmbientSize(), manifold_.TangentSize());
    EXPECT_TRUE(manifold_.PlusJacobian(x.data(), J.data()));
    return J;
  }
  RowMatrixXd MinusJacobian(const VectorXd& x) const {
    RowMatrixXd J(manifold_.TangentSize(), manifold_.AmbientSize());
    EXPECT_TRUE(manifold_.MinusJacobian(x.data(), J.data()));
    return J;
  }
  // Ambient differences, which leave the unit quaternions behind: only their
  // part along the manifold means something.
  MatrixXd MinusDifferences(const VectorXd& x) const {
    MatrixXd D(manifold_.TangentSize(), manifold_.AmbientSize());
    for (int i = 0; i < D.cols(); ++i) {
      D.col(i) = RiddersDifference(
                     [&](double h) {
                       return Minus(x + h * VectorXd::Unit(x.size(), i), x);
                     },
                     0.02)
                     .value;
    }
    return D;
  }

  const Model model_{AllJoints()};
  const StateManifold manifold_{&model_};
  Random random_{1};
};

TEST_F(StateManifoldTest, HasTheSizesOfStateAndTangent) {
  EXPECT_EQ(manifold_.AmbientSize(), model_.nq() + model_.nv());
  EXPECT_EQ(manifold_.TangentSize(), 2 * model_.nv());
}

TEST_F(StateManifoldTest, StaysWithoutAStep) {
  const VectorXd x = RandomX(model_, &random_);
  EXPECT_LT((Plus(x, VectorXd::Zero(manifold_.TangentSize())) - x).norm(),
            1e-15 * 10);
  EXPECT_LT(Minus(x, x).norm(), 1e-15 * 10);
}

TEST_F(StateManifoldTest, TakesBackItsSteps) {
  for (int i = 0; i < 20; ++i) {
    const VectorXd x = RandomX(model_, &random_);
    const VectorXd delta = 0.5 * random_.NormalVector(manifold_.TangentSize());
    const VectorXd y = Plus(x, delta);
    EXPECT_LT((Plus(x, Minus(y, x)) - y).norm(), 1e-12);
  }
}

TEST_F(StateManifoldTest, DerivesPlusAsDifferencesDo) {
  for (int i = 0; i < 5; ++i) {
    const VectorXd x = RandomX(model_, &random_);
    const RowMatrixXd J = PlusJacobian(x);
    for (int column = 0; column < J.cols(); ++column) {
      const auto difference = RiddersDifference(
          [&](double h) {
            return Plus(x, h * VectorXd::Unit(J.cols(), column));
          },
          0.1);
      EXPECT_LT((J.col(column) - difference.value).norm(), 1e-10);
    }
  }
}

TEST_F(StateManifoldTest, DerivesMinusAsDifferencesDo) {
  for (int i = 0; i < 5; ++i) {
    const VectorXd x = RandomX(model_, &random_);
    const MatrixXd along = PlusJacobian(x);
    EXPECT_LT(((MinusJacobian(x) - MinusDifferences(x)) * along).norm(), 1e-9);
  }
}

TEST_F(StateManifoldTest, HasJacobiansThatAreInverse) {
  for (int i = 0; i < 5; ++i) {
    const VectorXd x = RandomX(model_, &random_);
    EXPECT_TRUE((MinusJacobian(x) * PlusJacobian(x))
                    .isIdentity(1e-14 * manifold_.AmbientSize()));
  }
}

TEST_F(StateManifoldTest, MultipliesByThePlusJacobianOnTheRight) {
  const VectorXd x = RandomX(model_, &random_);
  const RowMatrixXd ambient = RowMatrixXd::Random(3, manifold_.AmbientSize());
  RowMatrixXd tangent(3, manifold_.TangentSize());
  ASSERT_TRUE(manifold_.RightMultiplyByPlusJacobian(x.data(), 3, ambient.data(),
                                                    tangent.data()));
  EXPECT_LT((tangent - ambient * PlusJacobian(x)).norm(), 1e-14);
}

// --- SegmentCost ------------------------------------------------------------

struct SegmentSetup {
  explicit SegmentSetup(OrientationResidual orientation,
                        std::vector<std::string> free)
      : model(AllJoints()) {
    Random random(2);
    AddEveryEffect(Catalogue(), &random, &model);
    map = std::make_unique<ParameterMap>(model,
                                         FindParameters(model, free, "test"));
    VectorXd values(map->size());
    for (int i = 0; i < map->size(); ++i) {
      values[i] = map->parameters()[i].nominal;
    }
    EXPECT_TRUE(map->ThetaOf(values, &theta));
    x0 = RandomX(model, &random);
    run = MeasureEverything(model, x0, 6, 0.02, 0.1, &random);
    measurements = MeasurementsOf(model.mechanism(), run, orientation);
    rollout = std::make_unique<SegmentRollout>(&model, map.get(), &measurements,
                                               0, 4, RolloutOptions{});
    // The next segment does not start where this one ends.
    x_next = StatesOf(model, run, x0).row(4).transpose();
    const VectorXd dx = 0.3 * random.NormalVector(model.tangent_size());
    BoxPlus<double>(model, x_next.data(), dx.data(), x_next.data());
  }
  Model model;
  std::unique_ptr<ParameterMap> map;
  VectorXd theta, x0, x_next;
  Run run;
  Measurements measurements;
  std::unique_ptr<SegmentRollout> rollout;
};

const std::vector<std::string>& SomeFree() {
  static const auto& names = *new std::vector<std::string>{
      "upper.length", "car.mass",          "lower.ixx",
      "lower.iyy",    "lower.izz",         "hinge.x",
      "rim.com_y",    "gravity",           "hinge.friction",
      "ball.damping", "slide.effort_bias", "hinge.sensor_offset",
      "wheel.damping"};
  return names;
}

class SegmentCostTest : public testing::TestWithParam<OrientationResidual> {};

TEST_P(SegmentCostTest, HasTheGradientsOfDifferencesWithADefect) {
  const SegmentSetup at(GetParam(), SomeFree());
  const StateManifold manifold(&at.model);
  const SegmentCost cost(at.rollout.get(), true);
  ExpectGradients(cost, {&manifold, nullptr, &manifold},
                  {at.x0, at.theta, at.x_next});
}

TEST_P(SegmentCostTest, HasTheGradientsOfDifferencesWithoutADefect) {
  const SegmentSetup at(GetParam(), SomeFree());
  const StateManifold manifold(&at.model);
  const SegmentCost cost(at.rollout.get(), false);
  ExpectGradients(cost, {&manifold, nullptr}, {at.x0, at.theta});
}

TEST_P(SegmentCostTest, HasTheGradientsOfDifferencesWithoutTheta) {
  const SegmentSetup at(GetParam(), {});
  const StateManifold manifold(&at.model);
  const SegmentCost cost(at.rollout.get(), true);
  ExpectGradients(cost, {&manifold, &manifold}, {at.x0, at.x_next});
}

INSTANTIATE_TEST_SUITE_P(Orientations, SegmentCostTest,
                         testing::Values(OrientationResidual::kHeading,
                                         OrientationResidual::kRotation),
                         [](const auto& info) {
                           return info.param == OrientationResidual::kHeading
                                      ? "Heading"
                                      : "Rotation";
                         });

TEST(SegmentCost, HoldsTheErrorsAndThenTheDefect) {
  const SegmentSetup at(OrientationResidual::kHeading, SomeFree());
  const SegmentCost cost(at.rollout.get(), true);
  const VectorXd r = Residuals(cost, {at.x0, at.theta, at.x_next});
  const int n = at.rollout->num_residuals();
  ASSERT_EQ(r.size(), n + at.model.tangent_size());
  VectorXd errors(n), x_end(at.model.state_size()),
      defect(at.model.tangent_size());
  ASSERT_TRUE((*at.rollout)(at.x0.data(), at.theta.data(), errors.data(),
                            x_end.data()));
  BoxMinus<double>(at.model, x_end.data(), at.x_next.data(), defect.data());
  EXPECT_EQ(r.head(n), errors);
  EXPECT_EQ(r.tail(defect.size()), defect);
}

TEST(SegmentCost, LeavesOutTheDerivativesThatNobodyAsksFor) {
  const SegmentSetup at(OrientationResidual::kHeading, SomeFree());
  const SegmentCost cost(at.rollout.get(), true);
  const double* parameters[] = {at.x0.data(), at.theta.data(),
                                at.x_next.data()};
  const int rows = cost.num_residuals();
  RowMatrixXd J_x(rows, at.x0.size()), J_theta(rows, at.theta.size()),
      J_next(rows, at.x0.size());
  double* all[] = {J_x.data(), J_theta.data(), J_next.data()};
  VectorXd r(rows);
  ASSERT_TRUE(cost.Evaluate(parameters, r.data(), all));
  for (int left_out = 0; left_out < 3; ++left_out) {
    RowMatrixXd some[] = {J_x, J_theta, J_next};
    for (RowMatrixXd& J : some) J.setZero();
    double* jacobians[] = {some[0].data(), some[1].data(), some[2].data()};
    jacobians[left_out] = nullptr;
    ASSERT_TRUE(cost.Evaluate(parameters, r.data(), jacobians));
    const RowMatrixXd* expected[] = {&J_x, &J_theta, &J_next};
    for (int b = 0; b < 3; ++b) {
      if (b == left_out) continue;
      EXPECT_LT((some[b] - *expected[b]).norm(), 1e-11 * expected[b]->norm())
          << "block " << b << " without " << left_out;
    }
  }
}

TEST(SegmentCost, FailsForAnImpossibleBody) {
  const SegmentSetup at(OrientationResidual::kHeading, SomeFree());
  const SegmentCost cost(at.rollout.get(), true);
  VectorXd theta = at.theta;
  theta[1] = -1.0;  // car.mass
  const double* parameters[] = {at.x0.data(), theta.data(), at.x_next.data()};
  VectorXd r(cost.num_residuals());
  EXPECT_FALSE(cost.Evaluate(parameters, r.data(), nullptr));
}

// --- Priors -----------------------------------------------------------------

TEST(PriorCost, IsTheDistanceFromTheMeansInSi) {
  const PriorCost cost(4, {2, 0}, {1.5, -1.0});
  const VectorXd theta = Eigen::Vector4d(3.0, 5.0, 2.0, 7.0);
  EXPECT_EQ(Residuals(cost, {theta}), Eigen::Vector2d(0.5, 4.0));
  ExpectGradients(cost, {nullptr}, {theta}, 1e-9);
}

TEST(StatePriorCost, IsTheTangentFromThePriorWithItsGradient) {
  const Model model{AllJoints()};
  const StateManifold manifold(&model);
  Random random(3);
  for (const double away : {0.0, 1e-4, 0.3, 2.0}) {
    const VectorXd prior = RandomX(model, &random);
    VectorXd dx = random.NormalVector(model.tangent_size());
    dx *= away / dx.norm();
    VectorXd x(prior.size());
    BoxPlus<double>(model, prior.data(), dx.data(), x.data());
    const StatePriorCost cost(&model,
                              std::vector<double>(prior.begin(), prior.end()));
    EXPECT_LT((Residuals(cost, {x}) - dx).norm(), 1e-13);
    ExpectGradients(cost, {&manifold}, {x});
  }
}

// --- Whitening and robust losses --------------------------------------------

// Six errors of two blocks, curved.
class CurvedCost final : public ceres::SizedCostFunction<6, 3, 2> {
 public:
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (int i = 0; i < 6; ++i) {
      residuals[i] = 0.0;
      int column = 0;
      for (int b = 0; b < 2; ++b) {
        const int size = b == 0 ? 3 : 2;
        for (int k = 0; k < size; ++k, ++column) {
          const double a = 1.0 + 0.3 * i - 0.7 * column;
          residuals[i] += std::sin(a * parameters[b][k]);
          if (jacobians != nullptr && jacobians[b] != nullptr) {
            jacobians[b][i * size + k] = a * std::cos(a * parameters[b][k]);
          }
        }
      }
    }
    return true;
  }
};

std::vector<VectorXd> CurvedPoint() {
  return {Eigen::Vector3d(0.3, -0.5, 0.9), Eigen::Vector2d(0.2, 0.7)};
}
std::vector<double> SomeSigmas() { return {0.1, 0.2, 0.3, 0.5, 1.0, 4.0}; }

TEST(WhitenedCost, DividesByTheSigmas) {
  const WhitenedCost cost(std::make_unique<CurvedCost>(), SomeSigmas());
  const VectorXd plain = Residuals(CurvedCost(), CurvedPoint());
  const VectorXd r = Residuals(cost, CurvedPoint());
  for (int i = 0; i < 6; ++i)
    EXPECT_DOUBLE_EQ(r[i], plain[i] / SomeSigmas()[i]);
  ExpectGradients(cost, {nullptr, nullptr}, CurvedPoint());
}

class LossTest : public testing::TestWithParam<RobustLoss> {};

TEST_P(LossTest, ChargesExactlyRhoOfEachGroup) {
  for (const double scale : {0.01, 1.0, 3.0, 100.0}) {
    const std::vector<WhitenedCost::Group> groups = {{0, 2}, {2, 3}};
    const WhitenedCost cost(std::make_unique<CurvedCost>(), SomeSigmas(),
                            GetParam(), scale, groups);
    const VectorXd plain =
        Residuals(WhitenedCost(std::make_unique<CurvedCost>(), SomeSigmas()),
                  CurvedPoint());
    const VectorXd r = Residuals(cost, CurvedPoint());
    for (const auto& group : groups) {
      double rho, rho_prime;
      EvaluateLoss(GetParam(), scale,
                   plain.segment(group.first, group.size).squaredNorm(), &rho,
                   &rho_prime);
      EXPECT_NEAR(r.segment(group.first, group.size).squaredNorm(), rho,
                  1e-14 * (1.0 + rho));
    }
    EXPECT_EQ(r[5], plain[5]);  // in no group: a defect is never bent
    ExpectGradients(cost, {nullptr, nullptr}, CurvedPoint());
  }
}

TEST_P(LossTest, HasTheGradientsOfDifferencesNearZeroError) {
  // sin(0) = 0: every error of this point is 0 but for what is added.
  for (const double away : {0.0, 1e-13, 1e-6}) {
    const WhitenedCost cost(std::make_unique<CurvedCost>(), SomeSigmas(),
                            GetParam(), 1.0, {{0, 2}, {2, 3}});
    ExpectGradients(cost, {nullptr, nullptr},
                    {VectorXd::Constant(3, away), VectorXd::Constant(2, away)},
                    1e-6);
  }
}

TEST_P(LossTest, IsTheSquareNearZeroAndItsDerivativeThatOfDifferences) {
  double rho, rho_prime;
  EvaluateLoss(GetParam(), 2.0, 1e-9, &rho, &rho_prime);
  EXPECT_NEAR(rho, 1e-9, 1e-17);
  EXPECT_NEAR(rho_prime, 1.0, 1e-9);
  for (const double s : {0.1, 3.9, 4.1, 50.0}) {
    EvaluateLoss(GetParam(), 2.0, s, &rho, &rho_prime);
    const auto difference = RiddersDifference(
        [&](double h) {
          Eigen::Matrix<double, 1, 1> value;
          double unused;
          EvaluateLoss(GetParam(), 2.0, s + h, value.data(), &unused);
          return value;
        },
        0.05);
    EXPECT_NEAR(rho_prime, difference.value[0], 1e-9) << "s = " << s;
  }
}

std::string NameOf(const testing::TestParamInfo<RobustLoss>& info) {
  if (info.param == RobustLoss::kNone) return "None";
  return info.param == RobustLoss::kHuber ? "Huber" : "Cauchy";
}

INSTANTIATE_TEST_SUITE_P(Losses, LossTest,
                         testing::Values(RobustLoss::kNone, RobustLoss::kHuber,
                                         RobustLoss::kCauchy),
                         NameOf);

TEST(EvaluateLoss, GrowsAsItsFormulaSays) {
  double rho, rho_prime;
  EvaluateLoss(RobustLoss::kHuber, 3.0, 100.0, &rho, &rho_prime);
  EXPECT_DOUBLE_EQ(rho, 2 * 3.0 * 10.0 - 9.0);
  EXPECT_DOUBLE_EQ(rho_prime, 0.3);
  EvaluateLoss(RobustLoss::kHuber, 3.0, 8.0, &rho, &rho_prime);
  EXPECT_DOUBLE_EQ(rho, 8.0);
  EvaluateLoss(RobustLoss::kCauchy, 3.0, 100.0, &rho, &rho_prime);
  EXPECT_DOUBLE_EQ(rho, 9.0 * std::log1p(100.0 / 9.0));
  EXPECT_DOUBLE_EQ(rho_prime, 1.0 / (1.0 + 100.0 / 9.0));
  EvaluateLoss(RobustLoss::kNone, 3.0, 100.0, &rho, &rho_prime);
  EXPECT_DOUBLE_EQ(rho, 100.0);
}

}  // namespace
}  // namespace sysid
