#include "sysid/estimation/shooting_stage.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

#include "models/state.h"
#include "sysid/estimation/elimination.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/linearization.h"
#include "sysid/estimation/segmentation.h"
#include "tests/support/fit_setup.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Two short runs of a spherical double pendulum cut into segments, with a prior
// on one of two parameters, at a point that is no solution.
struct Problem {
  explicit Problem(RobustLoss loss = RobustLoss::kNone) {
    const Model model = Shipped("pendulum2", {"viscous_damping@joint1"});
    EstimationOptions options;
    options.noise = 1e-2;
    options.loss = loss;
    options.rollout.step = 0.005;
    SimulationOptions simulation;
    simulation.noise = 1e-2;
    std::vector<sysid::Run> runs;
    for (const double duration : {0.8, 0.5}) {
      simulation.duration = duration;
      runs.push_back(Simulate(model, RandomState(model, 0.5, 1), simulation));
    }
    auto free =
        FreeFrom(model, {{"link1.length", 0.45}, {"joint1.damping", 0.001}});
    free[0].prior = FreeParameter::Prior{0.5, 0.1};
    problem = std::make_unique<ShootingProblem>(model, free, runs, options);
    std::vector<RowMatrixXd> states = {StatesFromData(*problem, 0),
                                       StatesFromData(*problem, 1)};
    start = point = CutPoint(*problem, problem->InitialTheta(), states, 0.25);
  }
  // All rows of a stage that began at the start.
  LinearizationOptions Rows(double defect) const {
    return {.defect = defect, .believed = &start, .triangular = false};
  }
  std::unique_ptr<ShootingProblem> problem;
  Solution start, point;
};

ShootingStage::Options WithDefect(double defect) {
  ShootingStage::Options options;
  options.defect = defect;
  return options;
}

// Every whitened residual in one column: priors of theta, then run by run the
// prior of the first state and the segments.
VectorXd AllResiduals(const Problem& at, double defect) {
  std::vector<RunLinearization> runs;
  EXPECT_TRUE(Linearize(*at.problem, at.point, at.Rows(defect), &runs));
  RowMatrixXd J;
  VectorXd all;
  LinearizePriors(*at.problem, at.point.theta, &J, &all);
  const auto append = [&](const VectorXd& r) {
    all.conservativeResize(all.size() + r.size());
    all.tail(r.size()) = r;
  };
  for (const RunLinearization& run : runs) {
    append(run.r_prior);
    for (const SegmentLinearization& segment : run.segments) append(segment.r);
  }
  return all;
}

class StageTest : public testing::TestWithParam<RobustLoss> {};

double Cost(const Problem& at, double defect) {
  return 0.5 * AllResiduals(at, defect).squaredNorm();
}

MatrixXd Columns(const SegmentLinearization& segment) {
  MatrixXd J(segment.r.size(), segment.J_x.cols() + segment.J_theta.cols() +
                                   segment.J_next.cols());
  J.leftCols(segment.J_x.cols()) = segment.J_x;
  J.middleCols(segment.J_x.cols(), segment.J_theta.cols()) = segment.J_theta;
  // Empty where segments are independent.
  if (segment.J_next.cols() > 0) {
    J.rightCols(segment.J_next.cols()) = segment.J_next;
  }
  return J;
}

TEST_P(StageTest, LinearizesWhatItMinimises) {
  Problem at(GetParam());
  ShootingStage stage(*at.problem, WithDefect(0.3), &at.point);
  const double before = Cost(at, 0.3);
  std::vector<HistoryEntry> history;
  const StageSummary summary = stage.Solve("test", Now(), &history);
  EXPECT_NEAR(history.front().cost, before, 1e-9 * before);
  EXPECT_NEAR(summary.cost, Cost(at, 0.3), 1e-9 * summary.cost);
}

TEST_P(StageTest, LinearizesWhatItMinimisesOfIndependentSegments) {
  Problem at(GetParam());
  ShootingStage stage(*at.problem, WithDefect(kInfinity), &at.point);
  std::vector<HistoryEntry> history;
  const StageSummary summary = stage.Solve("test", Now(), &history);
  EXPECT_NEAR(summary.cost, Cost(at, kInfinity), 1e-9 * summary.cost);
}

// The same least squares of theta and states, of far fewer rows.
TEST_P(StageTest, LinearizesTheSameByATriangularFactor) {
  for (const double defect : {0.3, kInfinity}) {
    Problem at(GetParam());
    std::vector<RunLinearization> all, triangular;
    LinearizationOptions rows = at.Rows(defect);
    ASSERT_TRUE(Linearize(*at.problem, at.point, rows, &all));
    rows.triangular = true;
    ASSERT_TRUE(Linearize(*at.problem, at.point, rows, &triangular));
    for (size_t r = 0; r < all.size(); ++r) {
      for (size_t k = 0; k < all[r].segments.size(); ++k) {
        const SegmentLinearization& a = all[r].segments[k];
        const SegmentLinearization& b = triangular[r].segments[k];
        EXPECT_LT(b.r.size(), a.r.size());
        const MatrixXd J_a = Columns(a), J_b = Columns(b);
        const MatrixXd H = J_a.transpose() * J_a;
        EXPECT_LT((J_b.transpose() * J_b - H).norm(), 1e-12 * H.norm());
        const VectorXd g = J_a.transpose() * a.r;
        EXPECT_LT((J_b.transpose() * b.r - g).norm(), 1e-12 * g.norm());
        EXPECT_NEAR(b.r.norm(), a.r.norm(), 1e-12 * a.r.norm());
      }
    }
  }
}

TEST_P(StageTest, LinearizesAsDifferencesDo) {
  Problem at(GetParam());
  std::vector<RunLinearization> runs;
  ASSERT_TRUE(Linearize(*at.problem, at.point, at.Rows(0.3), &runs));
  RowMatrixXd J_theta_prior;
  VectorXd r_theta_prior;
  LinearizePriors(*at.problem, at.point.theta, &J_theta_prior, &r_theta_prior);
  const Model& model = at.problem->model();
  const int tangent = model.tangent_size();
  const Solution center = at.point;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  // Along random directions of everything together; Huber's loss has a kink in
  // its second derivative, over which large differences would reach.
  const double largest = GetParam() == RobustLoss::kHuber ? 1e-3 : 0.05;
  for (int draw = 0; draw < 5; ++draw) {
    VectorXd dtheta(2);
    for (double& d : dtheta) d = 0.02 * normal(random);
    std::vector<RowMatrixXd> dx;
    for (const auto& nodes : center.runs) {
      dx.emplace_back(nodes.segments(), tangent);
      for (double& d : dx.back().reshaped()) d = 0.02 * normal(random);
    }
    const auto difference = RiddersDifference(
        [&](double h) {
          at.point.theta = center.theta + h * dtheta;
          for (size_t r = 0; r < dx.size(); ++r) {
            for (int k = 0; k < center.runs[r].segments(); ++k) {
              const VectorXd step = h * dx[r].row(k).transpose();
              BoxPlus<double>(model, center.runs[r].states.row(k).data(),
                              step.data(),
                              at.point.runs[r].states.row(k).data());
            }
          }
          return AllResiduals(at, 0.3);
        },
        largest);
    VectorXd expected = J_theta_prior * dtheta;
    const auto append = [&](const VectorXd& r) {
      expected.conservativeResize(expected.size() + r.size());
      expected.tail(r.size()) = r;
    };
    for (size_t r = 0; r < runs.size(); ++r) {
      append(runs[r].J_prior * dx[r].row(0).transpose());
      for (size_t k = 0; k < runs[r].segments.size(); ++k) {
        const SegmentLinearization& segment = runs[r].segments[k];
        VectorXd change =
            segment.J_x * dx[r].row(k).transpose() + segment.J_theta * dtheta;
        if (segment.J_next.size() > 0) {
          change += segment.J_next * dx[r].row(k + 1).transpose();
        }
        append(change);
      }
    }
    ASSERT_EQ(expected.size(), difference.value.size());
    EXPECT_LT((expected - difference.value).norm(), 1e-7 * expected.norm());
  }
}

std::string NameOf(const testing::TestParamInfo<RobustLoss>& info) {
  if (info.param == RobustLoss::kNone) return "None";
  return info.param == RobustLoss::kHuber ? "Huber" : "Cauchy";
}

INSTANTIATE_TEST_SUITE_P(Losses, StageTest,
                         testing::Values(RobustLoss::kNone, RobustLoss::kHuber,
                                         RobustLoss::kCauchy),
                         NameOf);

TEST(ShootingStage, FindsAPointWithoutAGradient) {
  Problem at;
  ShootingStage stage(*at.problem, WithDefect(0.3), &at.point);
  const double before = Cost(at, 0.3);
  std::vector<HistoryEntry> history;
  const StageSummary summary = stage.Solve("test", Now(), &history);
  EXPECT_TRUE(summary.converged) << summary.message;
  EXPECT_LT(summary.cost, before);
  EXPECT_NEAR(Cost(at, 0.3), summary.cost, 1e-9 * summary.cost);
  EXPECT_EQ(history.size(), static_cast<size_t>(summary.iterations) + 1);
  // What a further step of theta would change, the states eliminated.
  std::vector<RunLinearization> runs;
  ASSERT_TRUE(Linearize(*at.problem, at.point, at.Rows(0.3), &runs));
  RowMatrixXd J;
  VectorXd r;
  LinearizePriors(*at.problem, at.point.theta, &J, &r);
  const RowMatrixXd R = EliminateStates(runs, J, r, 1);
  const VectorXd left =
      R.leftCols(2).triangularView<Eigen::Upper>().solve(R.col(2));
  // In standard deviations.
  EXPECT_LT((R.leftCols(2) * left).norm(), 0.01);
}

// Of planar joints, of which no spin is believed that a new stage would move.
TEST(ShootingStage, TakesNoStepWhereNothingIsPromised) {
  const Model model = Shipped("pendulum2_planar");
  EstimationOptions of_problem;
  of_problem.rollout.step = 0.01;
  SimulationOptions simulation;
  simulation.duration = 2.0;
  simulation.noise = 1e-3;
  const ShootingProblem problem(
      model, FreeFrom(model, {{"link1.length", 0.45}, {"link2.length", 0.55}}),
      {Simulate(model, RandomState(model, 0.5, 1), simulation)}, of_problem);
  for (const double defect : {0.01, 0.3, kInfinity}) {
    Solution point = CutPoint(problem, problem.InitialTheta(),
                              {StatesFromData(problem, 0)}, 0.25);
    ShootingStage::Options options = WithDefect(defect);
    options.exact = true;
    std::vector<HistoryEntry> history;
    ShootingStage(problem, options, &point).Solve("first", Now(), &history);
    const StageSummary again = ShootingStage(problem, options, &point)
                                   .Solve("second", Now(), &history);
    EXPECT_TRUE(again.converged) << again.message;
    EXPECT_EQ(again.iterations, 0) << defect;
  }
}

TEST(ShootingStage, LeavesThetaWhereItIsFixed) {
  Problem at;
  const VectorXd theta = at.point.theta;
  ShootingStage::Options options = WithDefect(kInfinity);
  options.fix_theta = true;
  ShootingStage stage(*at.problem, options, &at.point);
  std::vector<HistoryEntry> history;
  const double before = Cost(at, kInfinity);
  const StageSummary summary = stage.Solve("test", Now(), &history);
  EXPECT_TRUE(summary.converged) << summary.message;
  EXPECT_EQ(at.point.theta, theta);
  EXPECT_LT(summary.cost, before);
}

TEST(ShootingStage, LeavesTheStatesWhereTheyAreFixed) {
  Problem at;
  const RowMatrixXd states = at.point.runs[0].states;
  const VectorXd theta = at.point.theta;
  ShootingStage::Options options = WithDefect(1.0);
  options.fix_states = true;
  ShootingStage stage(*at.problem, options, &at.point);
  const double before = Cost(at, 1.0);
  std::vector<HistoryEntry> history;
  const StageSummary summary = stage.Solve("test", Now(), &history);
  EXPECT_TRUE(summary.converged) << summary.message;
  EXPECT_EQ(at.point.runs[0].states, states);
  EXPECT_NE(at.point.theta, theta);
  EXPECT_LT(summary.cost, before);
}

TEST(Linearization, HasNoDefectsWhereSegmentsAreIndependent) {
  const Problem at;
  std::vector<RunLinearization> runs;
  ASSERT_TRUE(Linearize(*at.problem, at.point, at.Rows(kInfinity), &runs));
  for (const RunLinearization& run : runs) {
    for (const SegmentLinearization& segment : run.segments) {
      EXPECT_EQ(segment.J_next.size(), 0);
    }
  }
}

TEST(ShootingStage, GoesOnCountingItsHistory) {
  Problem at;
  std::vector<HistoryEntry> history;
  const double start = Now();
  ShootingStage(*at.problem, WithDefect(10.0), &at.point)
      .Solve("first", start, &history);
  const size_t first = history.size();
  ShootingStage(*at.problem, WithDefect(0.1), &at.point)
      .Solve("second", start, &history);
  ASSERT_GT(history.size(), first);
  for (size_t i = 1; i < history.size(); ++i) {
    EXPECT_EQ(history[i].iteration, history[i - 1].iteration + 1);
    EXPECT_GE(history[i].time_s, history[i - 1].time_s);
  }
}

TEST(DefectSigma, IsTheNoiseAndTheNoiseOverATime) {
  const Problem at;
  const std::vector<double> sigma = DefectSigma(*at.problem);
  ASSERT_EQ(sigma.size(), 12u);
  for (int i = 0; i < 6; ++i) {
    EXPECT_DOUBLE_EQ(sigma[i], 1e-2);
    EXPECT_DOUBLE_EQ(sigma[6 + i], 1e-2 / kDefectTime);
  }
}

}  // namespace
}  // namespace sysid
