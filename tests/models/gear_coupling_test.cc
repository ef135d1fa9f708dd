#include "models/effects/gear_coupling.h"

#include <gmock/gmock.h>

#include "models/dynamics.h"
#include "models/effects/catalogue.h"
#include "tests/support/all_joints.h"
#include "tests/support/error_text.h"
#include "tests/support/random_mechanism.h"

namespace sysid {
namespace {

using Eigen::VectorXd;
using ::testing::ElementsAre;

// Three hinges on each other.
Mechanism Arm() {
  Mechanism mechanism;
  mechanism.AddRoot("root");
  for (int i = 0; i < 3; ++i) {
    AddSomeJoint("j" + std::to_string(i + 1), JointType::kRevolute, i,
                 "l" + std::to_string(i + 1), SomeBody(), &mechanism);
  }
  return mechanism;
}

Model Coupled(double sign) {
  Model model(Arm());
  model.AddEffect(
      Catalogue().Make("gear_coupling@j2,j3", model.mechanism(), "test"));
  model.SetEffectParameter("j3.coupling_armature", 0.3);
  model.SetEffectParameter("j3.coupling_damping", 0.7);
  model.SetEffectParameter("j3.coupling_friction", 0.2);
  model.SetEffectParameter("j3.coupling_sign", sign);
  return model;
}

VectorXd Needed(const Model& model, const RandomState& at) {
  Workspace<double> ws(model);
  VectorXd tau(model.nv());
  InverseDynamics<double>(&ws, at.q.data(), at.qd.data(), at.qdd.data(),
                          tau.data());
  return tau;
}

TEST(GearCoupling, TakesFromBothDrivesWhatItsMotorNeeds) {
  for (const double sign : {1.0, -1.0}) {
    const Model model = Coupled(sign);
    Random random(3);
    const RandomState at(model.mechanism(), &random);
    const VectorXd extra = Needed(model, at) - Needed(Model(Arm()), at);
    const double zd = at.qd[1] + sign * at.qd[2];
    const double zdd = at.qdd[1] + sign * at.qdd[2];
    const double needed =
        0.3 * zdd + 0.7 * zd + 0.2 * zd / std::hypot(zd, 5e-3);
    EXPECT_NEAR(extra[0], 0.0, 1e-12);
    EXPECT_NEAR(extra[1], needed, 1e-12);
    EXPECT_NEAR(extra[2], sign * needed, 1e-12);
  }
}

TEST(GearCoupling, ForwardDynamicsInvertItsInverseDynamics) {
  const Model model = Coupled(-1.0);
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const RandomState at(model.mechanism(), &random);
    const VectorXd tau = Needed(model, at);
    Workspace<double> ws(model);
    VectorXd qdd(model.nv());
    ASSERT_TRUE(ForwardDynamics<double>(&ws, at.q.data(), at.qd.data(),
                                        tau.data(), qdd.data()));
    EXPECT_LT((qdd - at.qdd).norm(), 1e-10 * at.qdd.norm());
  }
}

// (2.35) by rank-one changes, (2.28) by solving with M: two pairs that share a
// joint, beside joints of other types and rotors, and one that friction holds.
TEST(GearCoupling, RankOneChangesSolveTheDenseEquations) {
  Mechanism mechanism = Arm();
  AddSomeJoint("ball", JointType::kSpherical, 3, "l4", SomeBody(), &mechanism);
  AddSomeJoint("slide", JointType::kPrismatic, 4, "l5", SomeBody(), &mechanism);
  Model model(mechanism);
  const Catalogue catalogue;
  for (const char* name :
       {"gear_coupling@j1,j2", "gear_coupling@j2,j3", "armature@ball"}) {
    model.AddEffect(catalogue.Make(name, mechanism, "test"));
  }
  MechanismParameters<double> values = model.nominal();
  for (double& value : values.effects) value = 0.4;
  model.SetNominal(values);
  model.SetEffectParameter("j3.coupling_sign", -1.0);
  Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    RandomState at(mechanism, &random);
    at.qdd.setZero();
    const VectorXd force = at.tau - Needed(model, at);
    MatrixX<double> M;
    Workspace<double> ws(model);
    MassMatrix<double>(&ws, at.q.data(), &M);
    for (const int held : {-1, 0, 2}) {  // joint j1 or j3
      MatrixX<double> A = M;
      VectorXd wanted = force;
      for (BodyData<double>& body : ws.bodies) body.dry = DryMode::kSmoothed;
      if (held >= 0) {
        ws.bodies[held].dry = DryMode::kRests;
        A.row(held).setZero();
        A.col(held).setZero();
        A(held, held) = 1.0;
        wanted[held] = 0.0;
      }
      wanted = A.ldlt().solve(wanted);
      VectorXd qdd(model.nv());
      ASSERT_TRUE(ForwardDynamics<double>(&ws, at.q.data(), at.qd.data(),
                                          at.tau.data(), qdd.data()));
      EXPECT_LT((qdd - wanted).norm(), 1e-9 * wanted.norm());
      if (held < 0) continue;
      const double holds = force[held] - M.row(held).dot(wanted);
      EXPECT_NEAR(ws.bodies[held].u, holds, 1e-9 * force.norm());
    }
  }
}

// The inverse dynamics are linear in the accelerations by the mass matrix.
TEST(GearCoupling, IsInTheMassMatrix) {
  const Model model = Coupled(1.0);
  Random random(5);
  RandomState at(model.mechanism(), &random);
  const VectorXd qdd = at.qdd;
  const VectorXd tau = Needed(model, at);
  at.qdd.setZero();
  MatrixX<double> M;
  Workspace<double> ws(model);
  MassMatrix<double>(&ws, at.q.data(), &M);
  EXPECT_LT((M * qdd - (tau - Needed(model, at))).norm(), 1e-12);
}

TEST(GearCoupling, IsOnNeighboursOfOneKind) {
  const Catalogue catalogue;
  std::vector<std::string> pairs;
  for (const std::string& name : catalogue.Names(Arm())) {
    if (name.starts_with("gear_coupling")) pairs.push_back(name);
  }
  EXPECT_THAT(pairs, ElementsAre("gear_coupling@j1,j2", "gear_coupling@j2,j3"));
  EXPECT_EQ(catalogue.Make("gear_coupling@j2+j3", Arm(), "test")->name(),
            "gear_coupling@j2,j3");
  EXPECT_THAT(
      ErrorText([&] { catalogue.Make("gear_coupling@j1,j3", Arm(), "--add"); }),
      ::testing::HasSubstr("gear_coupling"));
}

}  // namespace
}  // namespace sysid
