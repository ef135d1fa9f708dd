#include "models/urdf/write_urdf.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Model Load(const std::string& name) {
  return MakeModel(LoadUrdf(FindModel(name)), Catalogue());
}

Mechanism Reload(const Model& model,
                 const std::vector<std::string>& comments = {}) {
  return LoadUrdfText(WriteUrdf(model, comments), "written.urdf");
}

// Everything equal to the last bit but R_PJ.
void ExpectSame(const Mechanism& a, const Mechanism& b) {
  ASSERT_EQ(a.LinkNames(), b.LinkNames());
  ASSERT_EQ(a.joints.size(), b.joints.size());
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.nq, b.nq);
  EXPECT_EQ(a.nv, b.nv);
  for (size_t i = 0; i < a.joints.size(); ++i) {
    const Joint& s = a.joints[i];
    const Joint& t = b.joints[i];
    EXPECT_EQ(s.name, t.name);
    EXPECT_EQ(s.type, t.type);
    EXPECT_EQ(s.parent_link, t.parent_link);
    EXPECT_LT((s.R_PJ - t.R_PJ).cwiseAbs().maxCoeff(), 1e-15) << s.name;
    if (VelocitySize(s.type) == 1) {
      EXPECT_EQ(s.axis, t.axis) << s.name;
    }
    EXPECT_EQ(s.has_limits, t.has_limits);
    EXPECT_EQ(s.lower, t.lower);
    EXPECT_EQ(s.upper, t.upper);
    EXPECT_EQ(s.effort_limit, t.effort_limit);
    EXPECT_EQ(s.velocity_limit, t.velocity_limit);
    EXPECT_EQ(a.nominal.joint_p[i], b.nominal.joint_p[i]);
  }
  for (size_t i = 0; i < a.links.size(); ++i) {
    const Inertial<double>& s = a.nominal.links[i];
    const Inertial<double>& t = b.nominal.links[i];
    EXPECT_EQ(s.mass, t.mass);
    EXPECT_EQ(s.com, t.com);
    EXPECT_EQ(s.inertia, t.inertia) << a.links[i].name;
  }
}

TEST(WriteUrdf, ShippedRobotsLoadAgainToTheSameNumbers) {
  for (const std::string& name : ShippedModels()) {
    SCOPED_TRACE(name);
    const Model model = Load(name);
    ExpectSame(model.mechanism(), Reload(model));
  }
}

TEST(WriteUrdf, RandomTreesLoadAgainToTheSameNumbers) {
  Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    SCOPED_TRACE(trial);
    const Mechanism mechanism = RandomMechanism(1 + trial % 12, &random);
    ExpectSame(mechanism, Reload(Model(mechanism)));
  }
}

TEST(WriteUrdf, RotationsComeBackAlsoWherePitchIsAQuarterTurn) {
  Random random(1);
  const auto angle = [&] { return random.Uniform(-M_PI, M_PI); };
  for (int trial = 0; trial < 200; ++trial) {
    Mechanism mechanism = Load("pendulum1").mechanism();
    Eigen::Quaterniond q = random.Rotation();
    if (trial % 2) {
      const double pitch =
          (trial % 4 == 1 ? 1 : -1) * (M_PI / 2 - (trial % 8 < 4 ? 0 : 1e-9));
      q = Eigen::AngleAxisd(angle(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angle(), Eigen::Vector3d::UnitX());
    }
    mechanism.joints[0].R_PJ = q.normalized().toRotationMatrix();
    const Eigen::Matrix3d back = Reload(Model(mechanism)).joints[0].R_PJ;
    EXPECT_LT((back - mechanism.joints[0].R_PJ).cwiseAbs().maxCoeff(), 1e-15)
        << "trial " << trial << "\n"
        << mechanism.joints[0].R_PJ;
  }
}

TEST(WriteUrdf, AFittedModelKeepsItsValues) {
  Model model = Load("arm7");
  MechanismParameters<double> fitted = model.nominal();
  Random random(2);
  for (Inertial<double>& body : fitted.links) {
    const double k = random.Uniform(0.9, 1.1);
    body.mass *= k / 3;
    body.com *= k / 7;
    body.inertia *= k * M_PI;
  }
  for (Eigen::Vector3d& p : fitted.joint_p) p *= random.Uniform(0.9, 1.1);
  model.SetNominal(fitted);
  const Mechanism back = Reload(model);
  for (size_t i = 0; i < back.links.size(); ++i) {
    EXPECT_EQ(back.nominal.links[i].mass, fitted.links[i].mass);
    EXPECT_EQ(back.nominal.links[i].com, fitted.links[i].com);
    EXPECT_EQ(back.nominal.links[i].inertia, fitted.links[i].inertia);
  }
  for (size_t i = 0; i < back.joints.size(); ++i) {
    EXPECT_EQ(back.nominal.joint_p[i], fitted.joint_p[i]);
  }
}

TEST(WriteUrdf, DampingAndFrictionBecomeDynamics) {
  Model model = Load("cartpole");
  const Catalogue catalogue;
  model.AddEffect(
      catalogue.Make("viscous_damping@slider", model.mechanism(), "--add"));
  model.AddEffect(
      catalogue.Make("coulomb_friction@hinge", model.mechanism(), "--add"));
  model.SetEffectParameter("slider.damping", 0.1 / 3);
  model.SetEffectParameter("hinge.friction", 2e-3);
  const Model back = MakeModel(Reload(model), catalogue);
  EXPECT_EQ(back.effects().names(), model.effects().names());
  EXPECT_EQ(back.nominal().effects, model.nominal().effects);
  EXPECT_THAT(WriteUrdf(model), Not(HasSubstr("sysid:")));
}

TEST(WriteUrdf, WhatAUrdfCannotSayIsAComment) {
  Model model = Load("cartpole");
  const Catalogue catalogue;
  model.AddEffect(
      catalogue.Make("effort_bias@slider", model.mechanism(), "--add"));
  model.SetEffectParameter("slider.effort_bias", -3.2);
  MechanismParameters<double> nominal = model.nominal();
  nominal.gravity = 1.62;
  model.SetNominal(nominal);
  const std::string text = WriteUrdf(model);
  EXPECT_THAT(text, HasSubstr("<!-- sysid: effort_bias@slider "
                              "slider.effort_bias=-3.2 N -->"));
  EXPECT_THAT(text, HasSubstr("<!-- sysid: gravity=1.62 m/s^2 -->"));
  ExpectSame(model.mechanism(), LoadUrdfText(text, "written.urdf"));
}

TEST(WriteUrdf, CommentsMayHoldDashes) {
  const Model model = Load("pendulum1");
  const std::string text =
      WriteUrdf(model, {"sysid_fit --model x --", "--->", "---"});
  EXPECT_THAT(text, HasSubstr("<!-- sysid_fit - -model x - - -->"));
  ExpectSame(model.mechanism(), LoadUrdfText(text, "written.urdf"));
}

TEST(WriteUrdf, NamesAreEscaped) {
  Mechanism mechanism = Load("pendulum1").mechanism();
  mechanism.name = "a \"b\" <c> & 'd'";
  mechanism.links[1].name = "x&y<z";
  const Mechanism back = Reload(Model(mechanism));
  EXPECT_EQ(back.name, mechanism.name);
  EXPECT_EQ(back.links[1].name, mechanism.links[1].name);
}

}  // namespace
}  // namespace sysid
