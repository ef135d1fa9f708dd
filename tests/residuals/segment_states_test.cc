#include <gmock/gmock.h>

#include <cmath>

#include "models/effects/catalogue.h"
#include "models/state.h"
#include "residuals/costs.h"
#include "residuals/segment.h"
#include "residuals/segment_tangent.h"
#include "tests/support/all_joints.h"
#include "tests/support/measured_run.h"
#include "tests/support/ridders.h"

// Segments of a model whose effects remember: derivatives by what they remember
// at the start, and of it at the end.

namespace sysid {
namespace {

using Eigen::VectorXd;

class SegmentStates : public ::testing::TestWithParam<LinearizationPath> {
 protected:
  SegmentStates() : model_(AllJoints()) {
    for (const char* name :
         {"presliding_friction@hinge", "joint_elasticity@slide",
          "backlash@wheel", "coulomb_friction@hinge", "sensor_gain@slide.motor",
          "sensor_delay@slide.motor", "sensor_offset@wheel.motor",
          "sensor_delay@hinge.motor"}) {
      model_.AddEffect(Catalogue().Make(name, model_.mechanism(), "test"));
    }
    const std::vector<std::pair<std::string, double>> values = {
        {"hinge.presliding_friction", 0.5},
        {"hinge.presliding_length", 0.2},
        {"slide.drive_stiffness", 300.0},
        {"slide.drive_damping", 2.0},
        {"slide.motor_inertia", 0.7},
        {"wheel.drive_stiffness", 200.0},
        {"wheel.drive_damping", 1.0},
        {"wheel.motor_inertia", 0.1},
        {"wheel.backlash", 0.1},
        {"hinge.friction", 0.2},
        {"slide.motor.sensor_gain", 0.02},
        {"wheel.motor.sensor_offset", 0.1},
        {"slide.motor.sensor_delay", 0.01},
        {"hinge.motor.sensor_delay", 0.02}};
    for (const auto& [name, value] : values) {
      names_.push_back(name);
      model_.SetEffectParameter(name, value);
    }
    map_.emplace(model_, FindParameters(model_, names_, "test"));
    for (const Parameter& parameter : map_->parameters()) {
      theta_.push_back(parameter.nominal);
    }
    Random random(2);
    const RandomState at(model_.mechanism(), &random);
    x0_ = VectorXd::Zero(model_.state_size());
    x0_.head(model_.nq()) = at.q;
    for (int i = 0; i < model_.nv(); ++i) {
      // None turns back: there the derivatives jump.
      x0_[model_.nq() + i] = at.qd[i] + std::copysign(2.0, at.qd[i]);
    }
    x0_.tail(5) << 0.2, 0.02, 1.5, 0.08, -1.0;
    run_ = MeasureEverything(model_, x0_, 6, 0.02, 0.1, &random);
    for (const char* joint : {"slide", "wheel", "hinge"}) {
      const int j = model_.mechanism().FindJoint(joint);
      Channel motor;
      for (const Channel& own : run_.channels) {
        if (own.kind == ChannelKind::kPosition && own.target == j) motor = own;
      }
      motor.kind = ChannelKind::kMotorPosition;
      motor.name += ".motor_q";
      run_.channels.push_back(motor);
    }
    measurements_ = MeasurementsOf(model_.mechanism(), run_,
                                   OrientationResidual::kRotation);
  }
  SegmentRollout Rollout(int last = 5) const {
    return SegmentRollout(&model_, &*map_, &measurements_, 0, last,
                          {Integrator::kRungeKutta4, 0.01, GetParam()});
  }

  Model model_;
  std::vector<std::string> names_;  // of theta
  std::optional<ParameterMap> map_;
  std::vector<double> theta_;
  VectorXd x0_;
  sysid::Run run_;
  Measurements measurements_;
};

TEST_P(SegmentStates, LinearizesAsDifferencesSay) {
  const SegmentRollout rollout = Rollout();
  EXPECT_EQ(rollout.linearization(), GetParam());
  const int tangent = model_.tangent_size(), columns = tangent + map_->size();
  VectorXd errors(rollout.num_residuals()), x_end(model_.state_size());
  RowMatrixXd J, J_end;
  ASSERT_TRUE(rollout.Linearize(x0_.data(), theta_.data(), true, errors.data(),
                                x_end.data(), &J, &J_end));
  ASSERT_EQ(J.cols(), columns);
  ASSERT_EQ(J_end.rows(), tangent);
  for (int column = 0; column < columns; ++column) {
    const auto moved = [&](double h) {
      VectorXd x = x0_;
      std::vector<double> theta = theta_;
      if (column < tangent) {
        const VectorXd dx = h * VectorXd::Unit(tangent, column);
        BoxPlus<double>(model_, x0_.data(), dx.data(), x.data());
      } else {
        theta[column - tangent] *= 1.0 + h;
      }
      VectorXd out(errors.size() + tangent), end(x_end.size());
      EXPECT_TRUE(rollout(x.data(), theta.data(), out.data(), end.data()));
      BoxMinus<double>(model_, end.data(), x_end.data(),
                       out.data() + errors.size());
      return out;
    };
    const auto difference = RiddersDifference(moved, 2e-3);
    VectorXd by_jets(errors.size() + tangent);
    by_jets << J.col(column), J_end.col(column);
    if (column >= tangent) by_jets *= theta_[column - tangent];
    ASSERT_TRUE(by_jets.allFinite());
    EXPECT_GT(by_jets.norm(), 1e-6);
    EXPECT_LT((by_jets - difference.value).norm(),
              1e-7 * (1.0 + by_jets.norm()))
        << (column < tangent ? "tangent " + std::to_string(column)
                             : names_[column - tangent]);
  }
}

// Interval by interval as over one interval alone.
TEST_P(SegmentStates, LinearizesAlongAsItDoesAtOnce) {
  const SegmentRollout one = Rollout(1), all = Rollout();
  VectorXd errors(one.num_residuals()), x_end(model_.state_size());
  RowMatrixXd J, J_end;
  ASSERT_TRUE(one.Linearize(x0_.data(), theta_.data(), false, errors.data(),
                            x_end.data(), &J, &J_end));
  SegmentTangent along;
  ASSERT_TRUE(LinearizeAlong(all, x0_.data(), theta_.data(), &along));
  EXPECT_LT((along.A[0] - J_end).norm(), 1e-12 * J_end.norm());
  EXPECT_LT((along.states.row(1).transpose() - x_end).norm(),
            1e-12 * x_end.norm());
}

TEST_P(SegmentStates, HaveAManifoldWithWhatIsRemembered) {
  const StateManifold manifold(&model_);
  const int size = model_.state_size(), tangent = model_.tangent_size();
  VectorXd dx = VectorXd::LinSpaced(tangent, 0.01, 0.2), x(size), back(tangent);
  ASSERT_TRUE(manifold.Plus(x0_.data(), dx.data(), x.data()));
  ASSERT_TRUE(manifold.Minus(x.data(), x0_.data(), back.data()));
  EXPECT_LT((back - dx).norm(), 1e-12);
  RowMatrixXd plus(size, tangent), minus(tangent, size);
  ASSERT_TRUE(manifold.PlusJacobian(x0_.data(), plus.data()));
  ASSERT_TRUE(manifold.MinusJacobian(x0_.data(), minus.data()));
  EXPECT_LT((minus * plus - RowMatrixXd::Identity(tangent, tangent)).norm(),
            1e-12);
}

INSTANTIATE_TEST_SUITE_P(Paths, SegmentStates,
                         ::testing::Values(LinearizationPath::kStructured,
                                           LinearizationPath::kJets),
                         [](const auto& info) { return ToString(info.param); });

}  // namespace
}  // namespace sysid
