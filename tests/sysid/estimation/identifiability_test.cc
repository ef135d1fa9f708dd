#include "sysid/estimation/identifiability.h"

#include <gmock/gmock.h>

#include <Eigen/QR>

#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// The factor of what rows of measurements say, each with a standard deviation
// of 1, spread over 50 random mixtures of them.
RowMatrixXd Factor(const MatrixXd& rows, Random* random) {
  MatrixXd mixed(50, rows.rows());
  for (double& entry : mixed.reshaped()) entry = random->Normal();
  const MatrixXd J = mixed * rows;
  const Eigen::HouseholderQR<MatrixXd> qr(J);
  return qr.matrixQR().topRows(rows.cols()).triangularView<Eigen::Upper>();
}

TEST(AnalyseIdentifiability, FindsNothingWrongWithAFullRank) {
  Random random(1);
  const RowMatrixXd R = Factor(100.0 * MatrixXd::Identity(4, 4), &random);
  const Identifiability result = AnalyseIdentifiability(R, VectorXd::Ones(4));
  EXPECT_THAT(result.identifiable, testing::Each(true));
  EXPECT_THAT(result.groups, IsEmpty());
  EXPECT_THAT(result.without_influence, IsEmpty());
  const MatrixXd expected = (R.transpose() * R).inverse();
  EXPECT_LT((result.covariance - expected).norm(), 1e-10 * expected.norm());
}

TEST(AnalyseIdentifiability, DoesNotMixIndependentGroups) {
  Random random(2);
  // theta_0 + theta_3, theta_1 - 2 theta_4 + theta_5, theta_2, theta_1 +
  // theta_4: null directions (1, -1) of {0, 3} and one of {1, 4, 5}.
  MatrixXd rows = MatrixXd::Zero(4, 6);
  rows(0, 0) = rows(0, 3) = 300.0;
  rows(1, 1) = 200.0, rows(1, 4) = -400.0, rows(1, 5) = 200.0;
  rows(2, 2) = 100.0;
  rows(3, 1) = rows(3, 4) = 150.0;
  const RowMatrixXd R = Factor(rows, &random);
  const Identifiability result = AnalyseIdentifiability(R, VectorXd::Ones(6));
  EXPECT_THAT(result.groups,
              ElementsAre(ElementsAre(0, 3), ElementsAre(1, 4, 5)));
  EXPECT_THAT(result.identifiable,
              ElementsAre(false, false, true, false, false, false));
  EXPECT_THAT(result.without_influence, IsEmpty());
  // What is determined keeps its standard error.
  double information = 0.0;
  const MatrixXd J = R;
  information = J.col(2).squaredNorm();
  MatrixXd others(J.rows(), 3);
  others << J.col(0), J.col(1) - 2 * J.col(4) + J.col(5), J.col(1) + J.col(4);
  const VectorXd fitted = others * others.colPivHouseholderQr().solve(J.col(2));
  information = (J.col(2) - fitted).squaredNorm();
  EXPECT_NEAR(result.covariance(2, 2), 1.0 / information, 1e-6 / information);
}

TEST(AnalyseIdentifiability, JoinsWhatTwoDirectionsShare) {
  Random random(3);
  // Only theta_0 + theta_1 + theta_2 shows: two null directions, one group.
  MatrixXd rows = MatrixXd::Zero(2, 4);
  rows.row(0).head(3).setConstant(100.0);
  rows(1, 3) = 100.0;
  const Identifiability result =
      AnalyseIdentifiability(Factor(rows, &random), VectorXd::Ones(4));
  EXPECT_THAT(result.groups, ElementsAre(ElementsAre(0, 1, 2)));
  EXPECT_TRUE(result.identifiable[3]);
}

TEST(AnalyseIdentifiability, NamesWhatHasNoInfluence) {
  Random random(4);
  MatrixXd rows = MatrixXd::Zero(2, 4);
  rows(0, 0) = rows(1, 2) = 100.0;
  const Identifiability result =
      AnalyseIdentifiability(Factor(rows, &random), VectorXd::Ones(4));
  EXPECT_THAT(result.without_influence, ElementsAre(1, 3));
  EXPECT_THAT(result.groups, ElementsAre(ElementsAre(1), ElementsAre(3)));
  EXPECT_TRUE(result.identifiable[0]);
  EXPECT_TRUE(result.identifiable[2]);
}

TEST(AnalyseIdentifiability, NamesWhatIsKnownWorseThanAPartOfItsSize) {
  const VectorXd scale = Eigen::Vector3d(1.0, 1e-3, 1e3);
  const double known = 0.8 * kUndetermined, unknown = 1.2 * kUndetermined;
  const RowMatrixXd R =
      Eigen::Vector3d(1 / known, 1e3 / unknown, 1e-3 / known).asDiagonal();
  const Identifiability result = AnalyseIdentifiability(R, scale);
  EXPECT_THAT(result.identifiable, ElementsAre(true, false, true));
  EXPECT_THAT(result.groups, ElementsAre(ElementsAre(1)));
  EXPECT_THAT(result.without_influence, IsEmpty());
}

TEST(AnalyseIdentifiability, MindsTheParametersSizes) {
  Random random(5);
  // A mass of 1 kg and one of 1e-3 kg whose ratio alone shows.
  MatrixXd rows = MatrixXd::Zero(2, 3);
  rows(0, 0) = 100.0, rows(0, 1) = -1e5;
  rows(1, 2) = 100.0;
  const Identifiability result = AnalyseIdentifiability(
      Factor(rows, &random), Eigen::Vector3d(1.0, 1e-3, 1.0));
  EXPECT_THAT(result.groups, ElementsAre(ElementsAre(0, 1)));
  EXPECT_TRUE(result.identifiable[2]);
}

TEST(AnalyseIdentifiability, OfNothingIsNothing) {
  const Identifiability result =
      AnalyseIdentifiability(RowMatrixXd(0, 0), VectorXd(0));
  EXPECT_THAT(result.identifiable, IsEmpty());
}

TEST(AnalyseIdentifiability, OfNoDataNamesEverything) {
  const Identifiability result =
      AnalyseIdentifiability(RowMatrixXd::Zero(2, 2), VectorXd::Ones(2));
  EXPECT_THAT(result.identifiable, ElementsAre(false, false));
  EXPECT_THAT(result.without_influence, ElementsAre(0, 1));
}

}  // namespace
}  // namespace sysid
