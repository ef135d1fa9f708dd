#include "sysid/estimation/shooting_segment.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/state.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/shooting_stage.h"
#include "tests/support/fit_setup.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Columns = ShootingSegment::Columns;

// Ten samples of a spherical double pendulum, from a state a little off, with a
// parameter that the data says nothing of.
struct At {
  explicit At(RobustLoss loss = RobustLoss::kNone) {
    const Model model = Shipped("pendulum2", {"viscous_damping@joint1"});
    SimulationOptions simulation;
    simulation.duration = 0.2;
    simulation.noise = 1e-3;
    EstimationOptions options;
    options.noise = 1e-3;
    options.loss = loss;
    problem = std::make_unique<ShootingProblem>(
        model,
        FreeFrom(model, {{"link1.length", 0.51}, {"joint1.damping", 1e-3}}),
        std::vector<Run>{
            Simulate(model, RandomState(model, 0.5, 1), simulation)},
        options);
    x = StatesFromData(*problem, 0).row(0).transpose();
    x_next = StatesFromData(*problem, 0).row(10).transpose();
    theta = problem->InitialTheta();
  }
  std::unique_ptr<ShootingProblem> problem;
  VectorXd x, x_next, theta;
  mutable ScratchPool pool;
};

// Whitened residuals and their derivatives by the tangent of x, theta and the
// tangent of x_next, densely.
struct Dense {
  // What a segment gives Ceres.
  Dense(const At& at, const ceres::CostFunction& cost, bool with_defect) {
    const int rows = cost.num_residuals(), size = at.x.size();
    const double* parameters[] = {at.x.data(), at.theta.data(),
                                  at.x_next.data()};
    RowMatrixXd J_x(rows, size), J_theta(rows, 2), J_next(rows, size);
    double* jacobians[] = {J_x.data(), J_theta.data(), J_next.data()};
    r.resize(rows);
    valid = cost.Evaluate(parameters, r.data(), jacobians);
    const StateManifold manifold(&at.problem->model());
    RowMatrixXd P(size, kState), P_next(size, kState);
    manifold.PlusJacobian(at.x.data(), P.data());
    manifold.PlusJacobian(at.x_next.data(), P_next.data());
    J.setZero(rows, kColumns);
    J.leftCols(kState) = J_x * P;
    J.middleCols(kState, 2) = J_theta;
    if (with_defect) J.rightCols(kState) = J_next * P_next;
    VectorXd alone(rows);
    EXPECT_TRUE(cost.Evaluate(parameters, alone.data(), nullptr));
    squares = alone.squaredNorm();
  }

  // The same by hand: all rows and the defect, by differences, then whitened.
  Dense(const At& at, bool with_defect) {
    const Model& model = at.problem->model();
    const RunData& data = *at.problem->runs().front();
    const SegmentRollout rollout(&model, &at.problem->map(), &data.measurements,
                                 0, 10, {});
    std::vector<double> sigma;
    std::vector<Whitening::Group> groups;
    for (const SegmentRow& row : rollout.rows()) {
      sigma.insert(sigma.end(), row.size, data.sigma[row.channel]);
      groups.push_back({row.first, row.size});
    }
    const int measured = rollout.num_residuals();
    if (with_defect) sigma.insert(sigma.end(), kState, kDefectSigma);
    valid = true;
    const auto errors = [&](const VectorXd& change) {
      VectorXd x = at.x, x_next = at.x_next, x_end(at.x.size());
      BoxPlus<double>(model, x.data(), change.data(), x.data());
      BoxPlus<double>(model, x_next.data(), change.data() + kState + 2,
                      x_next.data());
      const VectorXd theta = at.theta + change.segment(kState, 2);
      VectorXd out(sigma.size());
      valid =
          valid && rollout(x.data(), theta.data(), out.data(), x_end.data());
      if (with_defect) {
        StateDefect(model, x_end.data(), x_next.data(), out.data() + measured,
                    nullptr, nullptr);
      }
      return out;
    };
    r = errors(VectorXd::Zero(kColumns));
    RowMatrixXd rows(r.size(), kColumns);
    for (int column = 0; column < kColumns; ++column) {
      rows.col(column) =
          RiddersDifference(
              [&](double h) {
                return errors(h * VectorXd::Unit(kColumns, column));
              },
              2e-3)
              .value;
    }
    const EstimationOptions& options = at.problem->options();
    Whitening(sigma, options.loss, options.loss_scale, groups)
        .Apply(r.data(), {Eigen::Map<RowMatrixXd>(rows.data(), rows.rows(),
                                                  rows.cols())});
    J = rows;
    squares = r.squaredNorm();
  }

  bool valid = false;
  double squares;
  VectorXd r;
  MatrixXd J;

  static constexpr int kState = 12, kColumns = 2 * kState + 2;
  static constexpr double kDefectSigma = 1e-2;
};

class SegmentTest : public testing::TestWithParam<RobustLoss> {};

TEST_P(SegmentTest, HasTheNormalEquationsOfAllRows) {
  const At at(GetParam());
  for (const bool with_defect : {true, false}) {
    ShootingSegment segment(*at.problem, {}, 0, 0, 10, &at.pool);
    const ShootingSegmentCost cost(
        &segment, with_defect
                      ? std::vector<double>(Dense::kState, Dense::kDefectSigma)
                      : std::vector<double>());
    const Dense small(at, cost, with_defect), all(at, with_defect);
    ASSERT_TRUE(small.valid && all.valid);
    EXPECT_LT(small.r.size(), all.r.size());
    // As exact as the differences are.
    const MatrixXd H = all.J.transpose() * all.J;
    EXPECT_LT((small.J.transpose() * small.J - H).norm(), 1e-9 * H.norm());
    const VectorXd g = all.J.transpose() * all.r;
    EXPECT_LT((small.J.transpose() * small.r - g).norm(),
              1e-9 * all.J.norm() * all.r.norm());
    EXPECT_NEAR(small.r.squaredNorm(), all.squares, 1e-12 * all.squares);
    EXPECT_NEAR(small.squares, all.squares, 1e-12 * all.squares);
  }
}

INSTANTIATE_TEST_SUITE_P(Losses, SegmentTest,
                         testing::Values(RobustLoss::kNone, RobustLoss::kHuber,
                                         RobustLoss::kCauchy));

// All inertial parameters of an arm whose data tells a few combinations: most
// columns depend on others.
TEST(ShootingSegment, HasTheNormalEquationsOfDependentColumns) {
  const Model model = Shipped("arm7");
  SimulationOptions simulation;
  simulation.duration = 0.2;
  simulation.rate = 500.0;
  simulation.noise = 1e-4;
  EstimationOptions options;
  options.noise = 1e-4;
  std::vector<std::string> names;
  for (int link = 1; link <= 7; ++link) {
    for (const char* name : {"mass", "com_x", "com_y", "com_z", "ixx", "iyy",
                             "izz", "ixy", "ixz", "iyz"}) {
      names.push_back("link" + std::to_string(link) + "." + name);
    }
  }
  std::vector<Value> values;
  for (const Parameter& p : FindParameters(model, names, "test")) {
    values.push_back({p.name, p.nominal});
  }
  const ShootingProblem problem(
      model, FreeFrom(model, values),
      {Simulate(model, RandomState(model, 0.5, 1), simulation)}, options);
  const int last = problem.runs().front()->run.size() - 1;
  const VectorXd x = StatesFromData(problem, 0).row(0).transpose();
  const VectorXd theta = problem.InitialTheta();
  ScratchPool pool;
  ShootingSegment segment(problem, {}, 0, 0, last, &pool);
  VectorXd r, x_end;
  RowMatrixXd J, J_end;
  ASSERT_TRUE(segment.LinearizeRows(x.data(), theta.data(), Columns::kBoth, &r,
                                    &x_end, &J, &J_end));
  ASSERT_TRUE(segment.Linearize(x.data(), theta.data(), Columns::kBoth));
  // Columns of length 1: what says little of the cost may be all that is known
  // of a parameter.
  VectorXd scale = J.colwise().norm().transpose();
  for (double& s : scale) s = s > 0.0 ? 1.0 / s : 0.0;
  const MatrixXd A = J * scale.asDiagonal(),
                 B = segment.R() * scale.asDiagonal();
  EXPECT_LT((B.transpose() * B - A.transpose() * A).cwiseAbs().maxCoeff(),
            1e-12);
  EXPECT_LT(
      (B.transpose() * segment.z() - A.transpose() * r).cwiseAbs().maxCoeff(),
      1e-6 * r.norm());
  EXPECT_LE(segment.z().squaredNorm(), r.squaredNorm());
}

TEST(ShootingSegment, RemembersOnlyThePlaceItWasAt) {
  const At at;
  ShootingSegment segment(*at.problem, {}, 0, 0, 10, &at.pool);
  ASSERT_TRUE(segment.Linearize(at.x.data(), at.theta.data(), Columns::kBoth));
  const RowMatrixXd R = segment.R();
  const double squares = segment.squares();
  VectorXd x = at.x, theta = at.theta;
  const auto expect_new = [&] {
    ASSERT_TRUE(segment.Roll(x.data(), theta.data()));
    const double moved = segment.squares();
    EXPECT_NE(moved, squares);
    ShootingSegment fresh(*at.problem, {}, 0, 0, 10, &at.pool);
    ASSERT_TRUE(fresh.Roll(x.data(), theta.data()));
    EXPECT_EQ(moved, fresh.squares());
    ASSERT_TRUE(segment.Linearize(x.data(), theta.data(), Columns::kBoth));
    ASSERT_TRUE(fresh.Linearize(x.data(), theta.data(), Columns::kBoth));
    EXPECT_EQ(segment.R(), fresh.R());
  };
  x[at.problem->model().nq()] += 1e-6;
  expect_new();
  x = at.x;
  theta[0] += 1e-6;
  expect_new();
  ASSERT_TRUE(segment.Linearize(at.x.data(), at.theta.data(), Columns::kBoth));
  EXPECT_EQ(segment.R(), R);
}

TEST(ShootingSegment, LinearisesAgainForColumnsThatItDidNotHave) {
  const At at;
  ShootingSegment segment(*at.problem, {}, 0, 0, 10, &at.pool);
  ASSERT_TRUE(segment.Linearize(at.x.data(), at.theta.data(), Columns::kState));
  EXPECT_EQ(segment.R().cols(), 12);
  ASSERT_TRUE(segment.Linearize(at.x.data(), at.theta.data(), Columns::kBoth));
  EXPECT_EQ(segment.R().cols(), 14);
  ASSERT_TRUE(segment.Linearize(at.x.data(), at.theta.data(), Columns::kState));
  EXPECT_EQ(segment.R().cols(), 14);
}

TEST(ShootingSegment, LinearisesByThetaAlone) {
  const At at;
  ShootingSegment some(*at.problem, {}, 0, 0, 10, &at.pool),
      all(*at.problem, {}, 0, 0, 10, &at.pool);
  ASSERT_TRUE(some.Linearize(at.x.data(), at.theta.data(), Columns::kTheta));
  ASSERT_TRUE(all.Linearize(at.x.data(), at.theta.data(), Columns::kBoth));
  EXPECT_EQ(some.R().cols(), 2);
  const MatrixXd R = all.Take(all.R(), Columns::kTheta);
  const MatrixXd H = R.transpose() * R;
  EXPECT_LT((some.R().transpose() * some.R() - H).norm(), 1e-12 * H.norm());
  const VectorXd g = R.transpose() * all.z();
  EXPECT_LT((some.R().transpose() * some.z() - g).norm(), 1e-11 * g.norm());
  EXPECT_NEAR(some.squares(), all.squares(), 1e-12 * all.squares());
  const RowMatrixXd J_end = all.Take(all.J_end(), Columns::kTheta);
  EXPECT_LT((some.J_end() - J_end).norm(), 1e-12 * J_end.norm());
}

TEST(ShootingSegment, ForgetsWhatFailed) {
  const At at;
  ShootingSegment segment(*at.problem, {}, 0, 0, 10, &at.pool);
  ASSERT_TRUE(segment.Roll(at.x.data(), at.theta.data()));
  VectorXd x = at.x;
  x[at.problem->model().nq()] = std::nan("");
  EXPECT_FALSE(segment.Linearize(x.data(), at.theta.data(), Columns::kBoth));
  ASSERT_TRUE(segment.Linearize(at.x.data(), at.theta.data(), Columns::kBoth));
}

TEST(ShootingSegments, FitTheirCutAndStepAlone) {
  At at;
  Solution point;
  point.runs.push_back({{0, 10, 20}, {}});
  const ShootingSegments segments(*at.problem, point);
  EXPECT_TRUE(segments.Fit(point));
  Solution other = point;
  other.runs[0].samples[1] = 9;
  EXPECT_FALSE(segments.Fit(other));
  other = point;
  other.rollout.step = 0.005;
  EXPECT_FALSE(segments.Fit(other));
}

}  // namespace
}  // namespace sysid
