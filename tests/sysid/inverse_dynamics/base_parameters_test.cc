#include "sysid/inverse_dynamics/base_parameters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sysid/inverse_dynamics/two_links.h"

namespace sysid {
namespace {

using testing::ElementsAre;

std::vector<std::string> NamesOf(const BaseParameter& base) {
  std::vector<std::string> names;
  for (const BaseParameter::Term& term : base.terms) names.push_back(term.name);
  return names;
}

// Columns a, b, 2 a - b, 0: two combinations, by hand.
TEST(BaseParameters, ADependentColumnIsRegroupedWithThoseBeforeIt) {
  const Model model = Shipped("pendulum2_planar");
  const EquationCoordinates coordinates(
      model,
      FindParameters(model, {"joint2.x", "joint2.y", "joint2.z", "gravity"},
                     "test"));
  RowMatrixXd R(4, 4);
  R << 3, 1, 5, 0,  //
      0, 2, -2, 0,  //
      0, 0, 0, 0,   //
      0, 0, 0, 0;
  const std::vector<BaseParameter> base =
      BaseParameters(coordinates, R, Eigen::Matrix4d::Identity(),
                     Eigen::Vector4d(1, 10, 100, 1000));
  ASSERT_EQ(base.size(), 2u);
  EXPECT_THAT(NamesOf(base[0]), ElementsAre("joint2.x", "joint2.z"));
  EXPECT_NEAR(base[0].terms[1].factor, 2.0, 1e-12);
  EXPECT_NEAR(base[0].value, 1 + 2 * 100, 1e-10);
  EXPECT_NEAR(base[1].terms[1].factor, -1.0, 1e-12);
  EXPECT_NEAR(base[1].value, 10 - 100, 1e-10);
  // (R^T R)^-1 of the two columns that are kept.
  EXPECT_NEAR(base[1].std_error, 0.5, 1e-12);
  EXPECT_NEAR(base[0].std_error, std::sqrt(1.0 / 9 + 1.0 / 36), 1e-12);
}

// What only depends on a combination tells no parameter of it alone.
TEST(EstimatesByRank, TellsSingleParametersFromGroups) {
  const Model model = Shipped("pendulum2_planar");
  std::vector<sysid::Run> runs = {Shaken(model, 0.0, 1, 0.5)};
  const ShootingProblem problem(model,
                                FreeNominal(model, {"link1.mass", "link1.com_z",
                                                    "link2.mass", "gravity"}),
                                runs, {});
  RowMatrixXd A(2, 4);
  A << 1, 0, 2, 0,  //
      0, 4, 0, 0;
  const Estimates estimates = EstimatesByRank(problem, problem.InitialTheta(),
                                              A, Eigen::Matrix2d::Identity());
  EXPECT_FALSE(estimates.parameters[0].identifiable);
  EXPECT_TRUE(estimates.parameters[1].identifiable);
  EXPECT_NEAR(estimates.parameters[1].std_error, 0.25, 1e-12);
  EXPECT_THAT(estimates.not_identifiable,
              ElementsAre(ElementsAre("link1.mass", "link2.mass"),
                          ElementsAre("gravity")));
  EXPECT_TRUE(std::isnan(estimates.parameters[3].std_error));
  // Here theta are the values. What shows in no row does not vary.
  EXPECT_LT((estimates.theta_covariance - estimates.covariance).norm(), 1e-12);
  EXPECT_EQ(estimates.theta_covariance(3, 3), 0.0);
}

}  // namespace
}  // namespace sysid
