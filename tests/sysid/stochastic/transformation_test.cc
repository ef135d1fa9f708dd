#include "sysid/stochastic/transformation.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/sysid/stochastic/stochastic_setup.h"

namespace sysid {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Bounds {
  double initial, lower, upper;
};

constexpr Bounds kOfEachKind[] = {{1.0, 0.05, 10.0},
                                  {1.0, 0.05, kInfinity},
                                  {1.0, -kInfinity, 1.5},
                                  {1.0, -kInfinity, kInfinity}};

// The transformation of one parameter with these bounds; its typical size is
// 0.5 m.
Transformation Of(const Bounds& bounds, std::string name = "link1.length") {
  const Model model = Shipped("pendulum2");
  std::vector<FreeParameter> free = FreeFrom(model, {{name, bounds.initial}});
  free[0].lower = bounds.lower;
  free[0].upper = bounds.upper;
  return Transformation(*AnyRunOf(model, free));
}

double ThetaAt(const Transformation& transformation, double v) {
  return transformation.Theta(Eigen::VectorXd::Constant(1, v))[0];
}

TEST(Transformation, StaysWithinItsBoundsWhereverVGoes) {
  for (const Bounds& bounds :
       {Bounds{1.0, 0.05, 10.0}, Bounds{1.0, 0.05, kInfinity},
        Bounds{1.0, -kInfinity, 1.5}, Bounds{1.0, 0.999, 1.001}}) {
    const Transformation transformation = Of(bounds);
    EXPECT_NEAR(ThetaAt(transformation, 0.0), 1.0, 1e-14);
    double before = ThetaAt(transformation, -30.0);
    for (double v = -30.0; v <= 30.0; v += 0.37) {
      const double theta = ThetaAt(transformation, v);
      EXPECT_GE(theta, bounds.lower);
      EXPECT_LE(theta, bounds.upper);
      EXPECT_GE(theta, before);
      before = theta;
    }
  }
}

TEST(Transformation, MovesByItsOwnSizePerUnitAtTheStart) {
  // Ends of a length's bounds that are far away do not matter.
  EXPECT_NEAR(Of({1.0, 0.05, 100.0}).Slope(Eigen::VectorXd::Zero(1))[0], 1.0,
              0.1);
  EXPECT_NEAR(
      Of({1.0, -kInfinity, kInfinity}).Slope(Eigen::VectorXd::Zero(1))[0], 1.0,
      1e-12);
  // A value that is small beside its range: by the typical size, 0.5 m.
  EXPECT_NEAR(
      Of({0.0, -50.0, 50.0}, "link1.com_x").Slope(Eigen::VectorXd::Zero(1))[0],
      0.5, 1e-12);
}

TEST(Transformation, SlopeIsItsDerivative) {
  for (const Bounds& bounds : kOfEachKind) {
    const Transformation transformation = Of(bounds);
    for (const double v : {-1.0, 0.0, 0.7}) {
      constexpr double kStep = 1e-6;
      const double slope = (ThetaAt(transformation, v + kStep) -
                            ThetaAt(transformation, v - kStep)) /
                           (2 * kStep);
      EXPECT_NEAR(transformation.Slope(Eigen::VectorXd::Constant(1, v))[0],
                  slope, 1e-8);
    }
  }
}

TEST(Transformation, InverseUndoesIt) {
  for (const Bounds& bounds : kOfEachKind) {
    const Transformation transformation = Of(bounds);
    for (const double v : {-1.0, 0.0, 0.7}) {
      const Eigen::VectorXd theta =
          transformation.Theta(Eigen::VectorXd::Constant(1, v));
      EXPECT_NEAR(transformation.Inverse(theta)[0], v, 1e-12);
    }
    for (const double bound : {bounds.lower, bounds.upper}) {
      if (!std::isfinite(bound)) continue;
      const Eigen::VectorXd v =
          transformation.Inverse(Eigen::VectorXd::Constant(1, bound));
      EXPECT_TRUE(v.allFinite());
      EXPECT_EQ(transformation.Theta(v)[0], bound);
    }
  }
}

TEST(Transformation, MovesAStartAtItsBoundInsideAndSaysSo) {
  const Transformation low = Of({0.05, 0.05, 10.0});
  EXPECT_THAT(low.moved(), testing::ElementsAre(0));
  EXPECT_NEAR(ThetaAt(low, 0.0), 0.55, 1e-12);
  EXPECT_EQ(low.start()[0], 0.55);
  const Transformation high = Of({10.0, 0.05, 10.0});
  EXPECT_THAT(high.moved(), testing::ElementsAre(0));
  EXPECT_NEAR(ThetaAt(high, 0.0), 9.5, 1e-12);
  EXPECT_THAT(Of({1.0, 0.05, 10.0}).moved(), testing::IsEmpty());
}

}  // namespace
}  // namespace sysid
