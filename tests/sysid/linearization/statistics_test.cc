#include "sysid/linearization/statistics.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A p-value that is off by a factor of two accepts or refuses effects that it
// should not: against the tables of any textbook.
TEST(FisherTail, IsThatOfTheTables) {
  EXPECT_NEAR(FisherTail(4.9646, 1, 10), 0.05, 1e-5);
  EXPECT_NEAR(FisherTail(3.0984, 3, 20), 0.05, 1e-5);
  EXPECT_NEAR(FisherTail(13.2739, 2, 5), 0.01, 1e-5);
  EXPECT_NEAR(FisherTail(2.364624 * 2.364624, 1, 7), 0.05, 1e-6);  // t^2
}

TEST(FisherTail, OfManySamplesIsChiSquared) {
  EXPECT_NEAR(FisherTail(10.8276, 1, 1e7), 1e-3, 1e-7);
  EXPECT_NEAR(FisherTail(15.0863 / 5, 5, 1e7), 0.01, 1e-6);
}

TEST(FisherTail, OfExtremesIsZeroOrOneAndNeverUnknown) {
  EXPECT_EQ(FisherTail(0.0, 2, 10), 1.0);
  EXPECT_EQ(FisherTail(-1.0, 2, 10), 1.0);
  EXPECT_EQ(FisherTail(std::nan(""), 2, 10), 1.0);
  EXPECT_EQ(FisherTail(kInfinity, 2, 10), 0.0);
  EXPECT_GE(FisherTail(1e9, 1, 1e5), 0.0);
  EXPECT_LT(FisherTail(1e9, 1, 1e5), 1e-300);
}

TEST(NormalQuantile, IsThatOfTheTables) {
  EXPECT_NEAR(NormalQuantile(0.025), 1.959964, 1e-6);
  EXPECT_NEAR(NormalQuantile(0.5), 0.0, 1e-12);
  EXPECT_NEAR(NormalQuantile(0.8), -0.841621, 1e-6);
  EXPECT_NEAR(NormalQuantile(1e-10), 6.361341, 1e-6);
}

// The part of p-values that are at most this.
double PartBelow(const std::vector<double>& p, double level) {
  return static_cast<double>(std::count_if(
             p.begin(), p.end(), [&](double x) { return x <= level; })) /
         static_cast<double>(p.size());
}

// Three standard deviations of such a part.
double Chance(const std::vector<double>& p, double level) {
  return 3.0 * std::sqrt(level * (1.0 - level) / static_cast<double>(p.size()));
}

// A column of a series in which neighbours correlate by rho; unit variance.
VectorXd Series(int rows, double rho, Random* random) {
  VectorXd x(rows);
  double last = random->Normal();
  for (int i = 0; i < rows; ++i) {
    x[i] = last;
    last = rho * last + std::sqrt(1.0 - rho * rho) * random->Normal();
  }
  return x;
}

// A regression of errors on columns that are slow, as those of forces are; the
// errors correlate by rho.
struct Regression {
  int rows = 2000, columns = 2, blocks = 20;
  double rho = 0.0;
  double column_rho = 0.95;
  double planted = 0.0;  // weight of the first column, in standard errors

  WaldTest Test(Random* random) const {
    MatrixXd A(rows, columns);
    for (int c = 0; c < columns; ++c) {
      A.col(c) = Series(rows, column_rho, random);
    }
    const MatrixXd C = A.transpose() * A;
    VectorXd r = Series(rows, rho, random);
    const MatrixXd inverse = C.inverse();
    r -= planted * std::sqrt(inverse(0, 0)) * A.col(0);
    const VectorXd alpha = -inverse * (A.transpose() * r);
    const VectorXd e = r + A * alpha;
    MatrixXd scores(blocks, columns);
    for (int g = 0; g < blocks; ++g) {
      const int begin = rows * g / blocks, end = rows * (g + 1) / blocks;
      scores.row(g) = A.middleRows(begin, end - begin).transpose() *
                      e.segment(begin, end - begin);
    }
    return TestWeights(C, alpha, scores, e.squaredNorm(), rows - columns);
  }

  std::vector<double> PValues(int count) const {
    Random random(7);
    std::vector<double> p;
    for (int i = 0; i < count; ++i) p.push_back(Test(&random).p_value);
    return p;
  }
};

// Where nothing is missing, a p-value may not be small more often than it says;
// and it should not be timid: of white errors, that many are small.
TEST(TestWeights, HasItsLevelUnderWhiteErrors) {
  const Regression white;
  const std::vector<double> p = white.PValues(2000);
  for (const double level : {0.01, 0.05, 0.2, 0.5}) {
    EXPECT_LE(PartBelow(p, level), level + Chance(p, level)) << level;
    EXPECT_GE(PartBelow(p, level), 0.4 * level) << level;
  }
}

// Errors of a wrong model lean the same way for many samples. The test of white
// errors then finds effects everywhere; that by blocks hardly does.
TEST(TestWeights, SurvivesSerialCorrelation) {
  Regression correlated;
  correlated.rho = 0.9;
  const std::vector<double> p = correlated.PValues(2000);
  EXPECT_LE(PartBelow(p, 0.05), 0.075);
  EXPECT_LE(PartBelow(p, 0.01), 0.02);
  correlated.blocks = 0;  // too few for a test by blocks
  const std::vector<double> naive = correlated.PValues(500);
  EXPECT_GE(PartBelow(naive, 0.01), 0.3);
}

// The standard errors that are reported survive it too.
TEST(TestWeights, WidensTheCovarianceUnderSerialCorrelation) {
  Regression correlated;
  correlated.rho = 0.9;
  Random random(8);
  double white = 0.0, clustered = 0.0;
  for (int i = 0; i < 100; ++i) {
    clustered += correlated.Test(&random).covariance.trace();
    Regression naive = correlated;
    naive.blocks = 0;
    white += naive.Test(&random).covariance.trace();
  }
  // Twice the sum of (0.9 * 0.95)^k over all lags, and once for lag 0.
  const double inflation = (1 + 0.9 * 0.95) / (1 - 0.9 * 0.95);
  EXPECT_NEAR(clustered / white, inflation, 0.25 * inflation);
}

// An effect of the size that is told as detectable is found four times in five.
TEST(TestWeights, FindsWhatIsPlanted) {
  Regression planted;
  planted.columns = 1;
  planted.planted = NormalQuantile(0.005) + NormalQuantile(0.2);
  const std::vector<double> p = planted.PValues(1000);
  // A little less: the larger of two p-values, one of 20 blocks, decides.
  EXPECT_GE(PartBelow(p, 0.01), 0.55);
  EXPECT_LE(PartBelow(p, 0.01), 0.85);
  planted.planted *= 2;
  EXPECT_GE(PartBelow(planted.PValues(200), 0.01), 0.99);
}

// Blocks that are few and normal: exactly Hotelling's, so p is uniform. Taking
// the variance of few blocks for the true one would find far too much.
TEST(TestWeights, IsExactForFewNormalBlocks) {
  for (const int k : {1, 2, 3}) {
    SCOPED_TRACE(k);
    constexpr int kBlocks = 6, kCount = 4000;
    Random random(9);
    MatrixXd mix = MatrixXd::Identity(k, k);
    mix.row(0).setConstant(1.5);
    std::vector<double> p;
    for (int i = 0; i < kCount; ++i) {
      MatrixXd x(kBlocks, k);
      for (double& number : x.reshaped()) number = random.Normal();
      x *= mix;
      const VectorXd alpha = -x.colwise().sum().transpose();
      const MatrixXd scores = x.rowwise() - x.colwise().mean().eval();
      // White errors would be sure: the blocks decide.
      p.push_back(
          TestWeights(MatrixXd::Identity(k, k), alpha, scores, 1e-9, 1e6)
              .p_value);
    }
    std::sort(p.begin(), p.end());
    double worst = 0.0;  // Kolmogorov and Smirnov's
    for (int i = 0; i < kCount; ++i) {
      worst = std::max(worst, std::abs(p[i] - (i + 0.5) / kCount));
    }
    EXPECT_LT(worst, 1.95 / std::sqrt(kCount));  // passed by one in 1000
  }
}

// Fewer blocks than directions tell no variance of them: white errors it is.
TEST(TestWeights, OfTooFewBlocksIsThatOfWhiteErrors) {
  const MatrixXd C = MatrixXd::Identity(3, 3);
  const VectorXd alpha = VectorXd::Constant(3, 2.0);
  const WaldTest none = TestWeights(C, alpha, MatrixXd(0, 3), 100.0, 100.0);
  EXPECT_NEAR(none.p_value, FisherTail(4.0, 3, 100), 1e-15);
  EXPECT_LT((none.covariance - C).norm(), 1e-14);
  const WaldTest few =
      TestWeights(C, alpha, MatrixXd::Random(4, 3), 100.0, 100.0);
  EXPECT_EQ(few.p_value, none.p_value);
}

TEST(DeviationsTest, GrowWithWhatWasCompared) {
  EXPECT_NEAR(Deviations(1), std::sqrt(2.0 * std::log(2.0)), 1e-12);
  EXPECT_NEAR(Deviations(100), 3.26, 0.01);
}

}  // namespace
}  // namespace sysid
