#include "residuals/costs.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/state.h"
#include "tests/support/all_joints.h"
#include "tests/support/random_mechanism.h"
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

// --- StateDefect ------------------------------------------------------------

TEST(StateDefect, IsTheTangentBetweenTheStatesWithItsDerivatives) {
  const Model model{AllJoints()};
  Random random(2);
  const int n = model.tangent_size();
  for (const double apart : {0.0, 1e-4, 0.3, 2.0}) {
    const VectorXd x_next = RandomX(model, &random);
    VectorXd dx = random.NormalVector(n);
    dx *= apart / dx.norm();
    VectorXd x_end(x_next.size()), defect(n);
    BoxPlus<double>(model, x_next.data(), dx.data(), x_end.data());
    RowMatrixXd J_end, J_next;
    StateDefect(model, x_end.data(), x_next.data(), defect.data(), &J_end,
                &J_next);
    EXPECT_LT((defect - dx).norm(), 1e-13);
    // By the tangent of either state.
    const auto moved = [&](bool end, int column, double h) {
      const VectorXd step = h * VectorXd::Unit(n, column);
      VectorXd x = end ? x_end : x_next, out(n);
      BoxPlus<double>(model, x.data(), step.data(), x.data());
      StateDefect(model, end ? x.data() : x_end.data(),
                  end ? x_next.data() : x.data(), out.data(), nullptr, nullptr);
      return out;
    };
    for (const bool end : {true, false}) {
      const RowMatrixXd& J = end ? J_end : J_next;
      ASSERT_EQ(J.cols(), n);
      for (int column = 0; column < n; ++column) {
        const auto difference = RiddersDifference(
            [&](double h) { return moved(end, column, h); }, 2e-3);
        EXPECT_LT((J.col(column) - difference.value).norm(), 1e-8)
            << (end ? "end" : "next") << ", column " << column;
      }
    }
  }
}

// --- Priors -----------------------------------------------------------------

TEST(PriorCost, IsTheDistanceFromTheMeansBySigmas) {
  const PriorCost cost(4, {2, 0}, {1.5, -1.0}, {1.0, 0.5});
  const VectorXd theta = Eigen::Vector4d(3.0, 5.0, 2.0, 7.0);
  EXPECT_EQ(Residuals(cost, {theta}), Eigen::Vector2d(0.5, 8.0));
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
                              std::vector<double>(prior.begin(), prior.end()),
                              std::vector<double>(dx.size(), 0.5));
    EXPECT_LT((Residuals(cost, {x}) - 2.0 * dx).norm(), 1e-13);
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

// A cost whose errors a Whitening divides and bends.
class WhitenedCost final : public ceres::CostFunction {
 public:
  WhitenedCost(std::unique_ptr<ceres::CostFunction> cost,
               std::vector<double> sigmas, RobustLoss loss = RobustLoss::kNone,
               double loss_scale = 1.0,
               std::vector<Whitening::Group> groups = {})
      : cost_(std::move(cost)),
        whitening_(std::move(sigmas), loss, loss_scale, std::move(groups)) {
    *mutable_parameter_block_sizes() = cost_->parameter_block_sizes();
    set_num_residuals(cost_->num_residuals());
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    if (!cost_->Evaluate(parameters, residuals, jacobians)) return false;
    std::vector<Eigen::Map<RowMatrixXd>> J;
    for (size_t b = 0; b < parameter_block_sizes().size(); ++b) {
      if (jacobians == nullptr || jacobians[b] == nullptr) continue;
      J.emplace_back(jacobians[b], num_residuals(), parameter_block_sizes()[b]);
    }
    whitening_.Apply(residuals, J);
    return true;
  }

 private:
  std::unique_ptr<ceres::CostFunction> cost_;
  Whitening whitening_;
};

std::vector<VectorXd> CurvedPoint() {
  return {Eigen::Vector3d(0.3, -0.5, 0.9), Eigen::Vector2d(0.2, 0.7)};
}
std::vector<double> SomeSigmas() { return {0.1, 0.2, 0.3, 0.5, 1.0, 4.0}; }

TEST(Whitening, DividesByTheSigmas) {
  const WhitenedCost cost(std::make_unique<CurvedCost>(), SomeSigmas());
  const VectorXd plain = Residuals(CurvedCost(), CurvedPoint());
  const VectorXd r = Residuals(cost, CurvedPoint());
  for (int i = 0; i < 6; ++i) {
    EXPECT_DOUBLE_EQ(r[i], plain[i] / SomeSigmas()[i]);
  }
  ExpectGradients(cost, {nullptr, nullptr}, CurvedPoint());
}

class LossTest : public testing::TestWithParam<RobustLoss> {};

TEST_P(LossTest, ChargesExactlyRhoOfEachGroup) {
  for (const double scale : {0.01, 1.0, 3.0, 100.0}) {
    const std::vector<Whitening::Group> groups = {{0, 2}, {2, 3}};
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
