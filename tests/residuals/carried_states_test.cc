#include "residuals/carried_states.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "models/effects/catalogue.h"
#include "residuals/parameter_forces.h"
#include "tests/support/fit_setup.h"
#include "tests/support/measured_run.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Model With(const Model& plain, const std::string& effect,
           const std::vector<double>& values) {
  Model model = plain;
  const auto made = Catalogue().Make(effect, plain.mechanism(), "test");
  model.AddEffect(made);
  for (size_t p = 0; p < values.size(); ++p) {
    model.SetEffectParameter(made->parameters()[p].name, values[p]);
  }
  return model;
}

// The bend of an elastic drive after a time at an effort of 1 N m, its joint at
// rest, in steps of h.
double BendAfter(double time, double h, double stiffness, double damping,
                 double inertia) {
  const Model plain = Shipped("pendulum2_planar");
  const Model model =
      With(plain, "joint_elasticity@joint1", {stiffness, damping, inertia});
  Workspace<double> ws(model);
  CarriedStates<double> carried(plain, &ws);
  const VectorXd rest = VectorXd::Zero(plain.state_size());
  VectorXd held = VectorXd::Zero(model.held_size());
  held[0] = 1.0;
  std::vector<double> x(model.state_size()), middle = x, next = x;
  carried.Start(rest.data(), x.data());
  for (int i = 0; i < std::lround(time / h); ++i) {
    carried.Carry(x.data(), rest.data(), rest.data(), h, held.data(),
                  middle.data(), next.data());
    x.swap(next);
  }
  return x[model.layout().z()];
}

TEST(CarriedStates, FollowAnElasticDriveToSecondOrder) {
  const double k = 30.0, d = 0.2, I = 0.03, time = 0.5;
  // z'' + (d / I) z' + (k / I) z = 1 / I from rest.
  const double decay = 0.5 * d / I, w = std::sqrt(k / I - decay * decay);
  const double exact =
      (1.0 - std::exp(-decay * time) *
                 (std::cos(w * time) + decay / w * std::sin(w * time))) /
      k;
  const double coarse = BendAfter(time, 0.005, k, d, I) - exact;
  const double fine = BendAfter(time, 0.0025, k, d, I) - exact;
  EXPECT_LE(std::abs(fine), 0.01 * exact);
  EXPECT_GE(std::abs(coarse / fine), 3.5);
}

// 4 million times as stiff as the step: it is where the effort holds it.
TEST(CarriedStates, FollowAStiffDriveInLongSteps) {
  const double k = 1e6;
  EXPECT_NEAR(BendAfter(0.2, 0.01, k, 1.0, 0.003), 1.0 / k, 1e-3 / k);
}

// What effects with states do to a motion that was computed without them, by
// forces and by rollouts with them.
class OfAMotion : public testing::Test {
 protected:
  OfAMotion() : plain_(Shipped("pendulum2_planar")) {
    SimulationOptions options;
    options.duration = 0.5;
    options.rate = 200.0;
    options.excitation = Excitation::kMultisine;
    options.excitation_level = 0.3;
    options.seed = 3;
    x0_ = RandomState(plain_, 0.7, 5);
    run_ = Simulate(plain_, x0_, options);
    measurements_ =
        MeasurementsOf(plain_.mechanism(), run_, OrientationResidual::kHeading);
    nothing_ = std::make_unique<ParameterMap>(plain_, std::vector<Parameter>());
    rollout_ = std::make_unique<SegmentRollout>(
        &plain_, nothing_.get(), &measurements_, 0, run_.size() - 1,
        RolloutOptions());
    EXPECT_TRUE(LinearizeAlong(*rollout_, x0_.data(), nullptr, &tangent_));
  }

  // Errors of a rollout of this model, less those without its effect.
  VectorXd ByRollout(const Model& model, double step = 0.0) const {
    const ParameterMap nothing(model, {});
    RolloutOptions options;
    options.step = step;
    const SegmentRollout rollout(&model, &nothing, &measurements_, 0,
                                 run_.size() - 1, options);
    VectorXd errors(rollout.num_residuals());
    std::vector<double> x_end(model.state_size());
    const VectorXd x0 = AdoptState(plain_, x0_.data(), model);
    EXPECT_TRUE(rollout(x0.data(), static_cast<const double*>(nullptr),
                        errors.data(), x_end.data()));
    return errors - tangent_.r;
  }

  // (7.1).
  VectorXd Respond(const ParameterForces& forces) const {
    VectorXd out = forces.direct.col(0);
    VectorXd dx = VectorXd::Zero(plain_.tangent_size());
    for (int k = 0; k < run_.size(); ++k) {
      for (const SegmentRow& row : rollout_->rows()) {
        if (row.sample != k) continue;
        out.segment(row.first, row.size) +=
            tangent_.C.middleRows(row.first, row.size) * dx;
      }
      if (k + 1 == run_.size()) break;
      dx = (tangent_.A[k] * dx + tangent_.B[k] * forces.f[k].col(0)).eval();
    }
    return out;
  }

  VectorXd ByForces(const Model& model, const std::string& parameter,
                    double to) const {
    const ParameterMap map(model, FindParameters(model, {parameter}, "test"),
                           false);
    const VectorXd theta = VectorXd::Constant(1, to);
    return Respond(
        ForceDifference(plain_, model, map, theta).Along(*rollout_, tangent_));
  }

  Model plain_;
  VectorXd x0_;
  sysid::Run run_;
  Measurements measurements_;
  std::unique_ptr<ParameterMap> nothing_;
  std::unique_ptr<SegmentRollout> rollout_;
  SegmentTangent tangent_;
};

TEST_F(OfAMotion, PreslidingFrictionDoesWhatItsRolloutDoes) {
  const double friction = 1e-4;
  const Model on = With(plain_, "presliding_friction@joint1", {friction, 0.01});
  const VectorXd exact = ByRollout(on);
  ASSERT_GT(exact.norm(), 0.0);
  const VectorXd by_forces =
      ByForces(on, "joint1.presliding_friction", friction);
  EXPECT_LE((by_forces - exact).norm(), 0.05 * exact.norm());
}

// A motor of a hundredth of the link's inertia: what it takes from the effort
// hardly depends on what that changes.
TEST_F(OfAMotion, AnElasticDriveDoesWhatItsRolloutDoes) {
  const double stiffness = 1.0, inertia = 1e-4;
  for (const std::string kind : {"joint_elasticity", "backlash"}) {
    SCOPED_TRACE(kind);
    std::vector<double> values = {stiffness, 0.002, inertia};
    if (kind == "backlash") values.push_back(0.01);
    const Model on = With(plain_, kind + "@joint1", values);
    const VectorXd exact = ByRollout(on, 1e-4);
    ASSERT_GT(exact.norm(), 0.0);
    const VectorXd by_forces =
        ByForces(on, "joint1.drive_stiffness", stiffness);
    EXPECT_LE((by_forces - exact).norm(), 0.25 * exact.norm());
  }
}

// Derivatives of parameters of different joints, taken together.
TEST_F(OfAMotion, JointsThatAreAloneShareALane) {
  Model model = plain_;
  std::vector<std::string> names;
  std::vector<int> alone;
  const Mechanism& mechanism = plain_.mechanism();
  for (const std::string joint : {"joint1", "joint2"}) {
    for (const std::string kind :
         {"viscous_damping", "spring", "effort_bias", "sensor_offset"}) {
      const auto effect =
          Catalogue().Make(kind + "@" + joint, mechanism, "test");
      model.AddEffect(effect);
      for (const EffectParameter& own : effect->parameters()) {
        names.push_back(own.name);
        alone.push_back(mechanism.FindJoint(joint));
      }
    }
  }
  const ParameterMap map(model, FindParameters(model, names, "test"), false);
  VectorXd theta(map.size());
  for (int i = 0; i < map.size(); ++i) theta[i] = map.parameters()[i].nominal;
  const ParameterForces each =
      ForceDerivatives(model, map, theta).Along(*rollout_, tangent_);
  const ParameterForces together =
      ForceDerivatives(model, map, theta, alone).Along(*rollout_, tangent_);
  ASSERT_EQ(each.f.size(), together.f.size());
  double largest = 0.0;
  for (size_t i = 0; i < each.f.size(); ++i) {
    largest = std::max(largest, each.f[i].norm());
    EXPECT_EQ(each.f[i], together.f[i]);
  }
  EXPECT_GT(largest, 0.0);
  EXPECT_GT(each.direct.norm(), 0.0);
  EXPECT_EQ(each.direct, together.direct);
}

// The same of a difference: each joint's part of it.
TEST_F(OfAMotion, DifferencesOfJointsThatAreAloneAreTakenTogether) {
  Model both = plain_;
  for (const std::string joint : {"joint1", "joint2"}) {
    both.AddEffect(
        Catalogue().Make("spring@" + joint, plain_.mechanism(), "test"));
  }
  const std::vector<std::string> names = {"joint1.stiffness",
                                          "joint2.stiffness"};
  const ParameterMap map(both, FindParameters(both, names, "test"), false);
  const VectorXd to = VectorXd::Constant(2, 0.1);
  const Mechanism& mechanism = plain_.mechanism();
  ParameterForces together = ParameterForces::Zero(*rollout_, 3);
  ForceDifference(plain_, both, map, to)
      .Write(*rollout_, tangent_,
             {mechanism.FindJoint("joint2"), mechanism.FindJoint("joint1")},
             {2, 0}, to, &together);
  for (const int joint : {0, 1}) {
    const Model one = With(plain_, "spring@" + names[joint].substr(0, 6), {});
    const ParameterMap own(one, FindParameters(one, {names[joint]}, "test"),
                           false);
    const ParameterForces alone = ForceDerivatives(one, own, VectorXd::Zero(1))
                                      .Along(*rollout_, tangent_);
    for (size_t i = 0; i < alone.f.size(); ++i) {
      EXPECT_LE(
          (together.f[i].col(joint == 0 ? 0 : 2) - alone.f[i].col(0)).norm(),
          1e-9);
      EXPECT_TRUE(together.f[i].col(1).isZero(0));
    }
  }
}

}  // namespace
}  // namespace sysid
