#include "sysid/checks/inertia.h"

#include <gtest/gtest.h>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"

namespace sysid {
namespace {

// A rod of 2 kg and 0.6 m that hangs from its end: m l^2 / 12 about its centre,
// m l^2 / 3 about the joint.
Inertial<double> Rod() {
  Inertial<double> rod;
  rod.mass = 2.0;
  rod.com = Eigen::Vector3d(0, 0, -0.3);
  rod.inertia = Eigen::Vector3d(0.06, 0.06, 0.001).asDiagonal();
  return rod;
}

TEST(InertiaTest, ParallelAxesComeBack) {
  Inertial<double> about_joint = Rod();
  about_joint.inertia(0, 0) = about_joint.inertia(1, 1) = 0.24;
  EXPECT_TRUE(AboutCentre(about_joint).isApprox(Rod().inertia, 1e-14));
}

TEST(InertiaTest, ARodIsNotTakenForOneAboutItsJointAndTheOtherIs) {
  EXPECT_FALSE(CouldBeAboutJoint(Rod(), kPossible));
  Inertial<double> about_joint = Rod();
  about_joint.inertia(0, 0) = about_joint.inertia(1, 1) = 0.24;
  EXPECT_TRUE(CouldBeAboutJoint(about_joint, kPlain));
}

TEST(InertiaTest, ALineIsThatOfAUrdf) {
  Inertial<double> body;
  body.mass = 0.15;
  body.inertia << 2, 0.5, 0, 0.5, 3, -1e-5, 0, -1e-5, 4;
  EXPECT_EQ(InertialLine(body, "arm", "robot.urdf"),
            "in robot.urdf, link arm: <mass value=\"0.15\"/> <inertia "
            "ixx=\"2\" ixy=\"0.5\" ixz=\"0\" iyy=\"3\" iyz=\"-1e-05\" "
            "izz=\"4\"/>");
}

TEST(InertiaTest, NoLinkOfTheShippedRobotsIsSuspected) {
  for (const std::string& name : ShippedModels()) {
    const Mechanism mechanism = LoadUrdf(FindModel(name));
    for (size_t i = 1; i < mechanism.links.size(); ++i) {
      const Inertial<double>& body = mechanism.nominal.links[i];
      if (body.mass <= 0.0) continue;
      EXPECT_FALSE(CouldBeAboutJoint(body, kPlain))
          << name << " " << mechanism.links[i].name;
    }
  }
}

}  // namespace
}  // namespace sysid
