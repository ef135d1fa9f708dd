#include "models/joint_part.h"

#include <gtest/gtest.h>

#include <vector>

#include "models/dynamics.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

using Jets = std::vector<Jet8>;

Model Driven() {
  return Shipped(
      "pendulum2_planar",
      {"viscous_damping@joint1", "coulomb_friction@joint2", "armature@joint2"},
      {{"joint1.damping", 0.02},
       {"joint2.friction", 0.1},
       {"joint2.armature", 0.03}});
}

TEST(JointPart, HasTheDerivativesOfTheInverseDynamicsByEffects) {
  const Model model = Driven();
  MechanismParameters<Jet8> values;
  model.nominal().CastTo(&values);
  for (size_t i = 0; i < values.effects.size(); ++i) {
    values.effects[i].v[i] = 1.0;
  }
  Workspace<Jet8> ws(model);
  ws.SetParameters(values);
  ASSERT_TRUE(OnlyJointPartVaries(ws));
  const Jets q = {Jet8(0.3), Jet8(-0.7)}, qd = {Jet8(1.2), Jet8(-0.4)},
             qdd = {Jet8(-2.0), Jet8(3.0)};
  Jets whole(2), part(2);
  for (const DryMode mode : {DryMode::kSmoothed, DryMode::kBackward}) {
    for (const int i : ws.dry_bodies) ws.bodies[i].dry = mode;
    InverseDynamics<Jet8>(&ws, q.data(), qd.data(), qdd.data(), whole.data());
    JointPart<Jet8>(&ws, q.data(), qd.data(), qdd.data(), nullptr, part.data());
    for (int v = 0; v < 2; ++v) {
      EXPECT_FALSE(whole[v].v.isZero(0.0));
      EXPECT_LT((whole[v].v - part[v].v).norm(), 1e-14);
    }
  }
}

TEST(JointPart, IsNotAllThatVariesWithMassesOriginsAndGravity) {
  const Model model = Driven();
  const int joint = model.bodies()[1].joint;
  const int link = model.mechanism().joints[joint].child_link;
  MechanismParameters<Jet8> values;
  for (int what = 0; what < 3; ++what) {
    model.nominal().CastTo(&values);
    Jet8& varied = what == 0   ? values.gravity
                   : what == 1 ? values.links[link].mass
                               : values.joint_p[joint][2];
    varied.v[0] = 1.0;
    Workspace<Jet8> ws(model);
    ws.SetParameters(values);
    EXPECT_FALSE(OnlyJointPartVaries(ws)) << what;
  }
}

}  // namespace
}  // namespace sysid
