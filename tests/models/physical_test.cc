#include "models/physical.h"

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>

#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Inertial<double> Body(double mass, const Eigen::Vector3d& com,
                      const Eigen::Vector3d& moments) {
  Inertial<double> body;
  body.mass = mass;
  body.com = com;
  body.inertia = moments.asDiagonal();
  return body;
}

int Add(Mechanism* mechanism, const std::string& name, JointType type,
        const std::string& parent, const Eigen::Vector3d& p_PJ,
        const Inertial<double>& body) {
  Joint joint;
  joint.name = name + "_joint";
  joint.type = type;
  joint.parent_link = mechanism->FindLink(parent);
  return mechanism->AddJoint(joint, name, p_PJ, body);
}

std::vector<std::string> Texts(const Mechanism& mechanism) {
  std::vector<std::string> texts;
  for (const PhysicalFault& fault :
       PhysicalFaults(mechanism, mechanism.nominal)) {
    texts.push_back(mechanism.links[fault.link].name + ": " + fault.text);
  }
  return texts;
}

TEST(PhysicalFaults, AreNoneInRealBodiesAndInTheirLimits) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  // A rod without thickness and a plate without thickness.
  Add(&mechanism, "rod", JointType::kRevolute, "root", {0, 0, 0},
      Body(1.0, {0, 0, 0}, {0.0, 0.2, 0.2}));
  Add(&mechanism, "plate", JointType::kRevolute, "root", {0, 0, 0},
      Body(1.0, {0, 0, 0}, {0.1, 0.2, 0.3}));
  EXPECT_THAT(Texts(mechanism), IsEmpty());
}

TEST(PhysicalFaults, NamesEveryBadLinkWithItsNumbers) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  Add(&mechanism, "light", JointType::kRevolute, "root", {0, 0, 0},
      Body(-1.5, {0, 0, 0}, {1, 1, 1}));
  Add(&mechanism, "good", JointType::kRevolute, "root", {0, 0, 0},
      Body(1.0, {0, 0, 0}, {1, 1, 1}));
  Add(&mechanism, "inside_out", JointType::kRevolute, "root", {0, 0, 0},
      Body(1.0, {0, 0, 0}, {2, -1, 1}));
  Add(&mechanism, "long", JointType::kRevolute, "root", {0, 0, 0},
      Body(1.0, {0, 0, 0}, {0.3, 0.1, 0.1}));
  EXPECT_THAT(Texts(mechanism),
              ElementsAre("light: mass -1.5 kg is negative",
                          "inside_out: principal moments -1, 1, 2 kg m^2 are "
                          "not all positive",
                          "long: principal moments 0.1, 0.1, 0.3 kg m^2 "
                          "violate the triangle inequality"));
}

TEST(PhysicalFaults, LooksAtPrincipalMomentsAndNotAtTheDiagonal) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  Inertial<double> body = Body(1.0, {0, 0, 0}, {1, 1, 1});
  body.inertia(0, 1) = body.inertia(1, 0) = 0.5;  // moments 0.5, 1, 1.5
  Add(&mechanism, "limit", JointType::kRevolute, "root", {0, 0, 0}, body);
  body.inertia(0, 1) = body.inertia(1, 0) = 0.6;  // moments 0.4, 1, 1.6
  Add(&mechanism, "beyond", JointType::kRevolute, "root", {0, 0, 0}, body);
  EXPECT_THAT(Texts(mechanism),
              ElementsAre("beyond: principal moments 0.4, 1, 1.6 kg "
                          "m^2 violate the triangle inequality"));
}

TEST(PhysicalFaults, SaysNothingAboutTheRootThatCannotMove) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  mechanism.nominal.links[0].mass = -1.0;
  EXPECT_THAT(Texts(mechanism), IsEmpty());
}

Eigen::Vector3d SecondMomentsOf(const Eigen::Matrix3d& inertia) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(
             SecondMoments<double>(inertia))
      .eigenvalues();
}

TEST(NearestPossible, IsInsideAndNearerThanOthers) {
  Random random(4);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Matrix3d R = random.Rotation().toRotationMatrix();
    const Eigen::Vector3d s(-random.Uniform(0.01, 1), random.Uniform(-1, 1),
                            random.Uniform(0, 1));
    const Eigen::Matrix3d S = R * s.asDiagonal() * R.transpose();
    const Eigen::Matrix3d inertia = S.trace() * Eigen::Matrix3d::Identity() - S;
    const Eigen::Matrix3d nearest = NearestPossible(inertia);
    EXPECT_FALSE(CanStart(inertia));
    EXPECT_TRUE(CanStart(nearest));
    const double least = 1e-3 * s.cwiseAbs().sum();
    EXPECT_NEAR(SecondMomentsOf(nearest)[0], least, 1e-12);
    // No other one with such second moments is nearer.
    const double distance = (SecondMoments<double>(nearest) - S).norm();
    for (int other = 0; other < 20; ++other) {
      const Eigen::Matrix3d A = R * Eigen::Matrix3d::Identity() +
                                0.3 * random.Rotation().toRotationMatrix();
      Eigen::Matrix3d T = SecondMoments<double>(nearest);
      T += 0.1 * random.Uniform(0, 1) * A * A.transpose();
      EXPECT_GE((T - S).norm(), distance);
    }
  }
}

TEST(StartingInertia, KeepsWhatIsPossibleAndGivesABallToWhatHasNone) {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  Add(&mechanism, "rod", JointType::kRevolute, "root", {0, 0, 0},
      Body(2.0, {0, 0, -0.3}, {0.1, 0.1, 0.0}));
  Add(&mechanism, "point", JointType::kRevolute, "rod", {0, 0, -0.6},
      Body(0.5, {0, 0, -0.2}, {0, 0, 0}));
  Add(&mechanism, "frame", JointType::kRevolute, "point", {0, 0, -0.4},
      Inertial<double>());
  const auto start = [&](const std::string& link) {
    return StartingInertia(mechanism, mechanism.nominal,
                           mechanism.FindLink(link));
  };
  EXPECT_EQ(start("rod"), mechanism.nominal.links[1].inertia);
  EXPECT_TRUE(
      start("point").isApprox(0.4 * 0.5 * 0.04 * Eigen::Matrix3d::Identity()));
  EXPECT_TRUE(CanStart(start("frame")));
  EXPECT_EQ(StartingMass(mechanism, mechanism.nominal), 0.5);
}

}  // namespace
}  // namespace sysid
