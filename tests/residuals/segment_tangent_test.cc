#include "residuals/segment_tangent.h"

#include <gmock/gmock.h>

#include <memory>
#include <tuple>

#include "models/state.h"
#include "models/stepper.h"
#include "tests/support/all_joints.h"
#include "tests/support/measured_run.h"
#include "tests/support/ridders.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A model on its way, with odd times between its samples and some that are
// missing, and several steps in each.
struct Motion {
  Model model;
  std::unique_ptr<ParameterMap> map;
  VectorXd theta, x0;
  sysid::Run run;
  Measurements measurements;
  std::unique_ptr<SegmentRollout> rollout;

  Motion(const Model& m, std::vector<Parameter> parameters,
         OrientationResidual orientation, double step,
         LinearizationPath path = LinearizationPath::kStructured)
      : model(m) {
    map = std::make_unique<ParameterMap>(model, std::move(parameters));
    VectorXd values(map->size());
    for (int i = 0; i < map->size(); ++i) {
      values[i] = map->parameters()[i].nominal;
    }
    EXPECT_TRUE(map->ThetaOf(values, &theta));
    Random random(2);
    const RandomState at(model.mechanism(), &random);
    x0.resize(model.state_size());
    x0 << at.q, at.qd;
    run = MeasureEverything(model, x0, 9, 0.01, 0.05, &random);
    double t = 0.5;
    for (double& time : run.t) {
      time = t;
      t += random.Uniform(0.004, 0.013);
    }
    run.channels.front().values.row(4).setConstant(std::nan(""));
    measurements = MeasurementsOf(model.mechanism(), run, orientation);
    rollout = std::make_unique<SegmentRollout>(
        &model, map.get(), &measurements, 1, 8,
        RolloutOptions{Integrator::kRungeKutta4, step, path});
    x0 = StatesOf(model, run, x0, rollout->options()).row(1).transpose();
  }
};

Model WithEveryEffect(const Mechanism& mechanism) {
  Model model(mechanism);
  Random random(1);
  AddEveryEffect(Catalogue(), &random, &model);
  return model;
}

// What everything of a diagnosis is computed from: composed, the steps must be
// the segment's own Jacobian, to the last digit that its length leaves.
void ExpectComposesToTheRollout(const Motion& motion) {
  const SegmentRollout& rollout = *motion.rollout;
  const int n = motion.model.tangent_size();
  SegmentTangent tangent;
  ASSERT_TRUE(
      LinearizeAlong(rollout, motion.x0.data(), motion.theta.data(), &tangent));
  VectorXd errors(rollout.num_residuals()), x_end(motion.model.state_size());
  RowMatrixXd J, J_end;
  RolloutOptions by_jets = rollout.options();
  by_jets.linearization = LinearizationPath::kJets;
  const SegmentRollout whole(&motion.model, motion.map.get(),
                             &motion.measurements, rollout.first(),
                             rollout.last(), by_jets);
  ASSERT_TRUE(whole.Linearize(motion.x0.data(), motion.theta.data(), false,
                              errors.data(), x_end.data(), &J, &J_end));
  const int count = rollout.last() - rollout.first();
  ASSERT_EQ(static_cast<int>(tangent.A.size()), count);
  ASSERT_EQ(static_cast<int>(tangent.B.size()), count);
  EXPECT_LT((tangent.r - errors).norm(), 1e-12 * errors.norm());
  EXPECT_LT((tangent.states.row(count).transpose() - x_end).norm(),
            1e-12 * x_end.norm());
  MatrixXd phi = MatrixXd::Identity(n, n);
  MatrixXd rows(rollout.num_residuals(), n);
  for (int k = rollout.first(); k <= rollout.last(); ++k) {
    for (const SegmentRow& row : rollout.rows()) {
      if (row.sample != k) continue;
      rows.middleRows(row.first, row.size) =
          tangent.C.middleRows(row.first, row.size) * phi;
    }
    if (k < rollout.last()) phi = tangent.A[k - rollout.first()] * phi;
  }
  EXPECT_LT((phi - J_end).norm(), 1e-10 * J_end.norm());
  EXPECT_LT((rows - J).norm(), 1e-10 * J.norm());
}

class Orientations : public testing::TestWithParam<
                         std::tuple<OrientationResidual, LinearizationPath>> {};

TEST_P(Orientations, ComposeToTheRolloutOfEveryJointAndEffect) {
  const Model model = WithEveryEffect(AllJoints());
  // At theta, not at the model's own values.
  std::vector<Parameter> some =
      FindParameters(model, {"lower.mass", "gravity"}, "test");
  for (Parameter& parameter : some) parameter.nominal *= 1.1;
  const auto [orientation, path] = GetParam();
  ExpectComposesToTheRollout({model, some, orientation, 0.003, path});
}

INSTANTIATE_TEST_SUITE_P(
    All, Orientations,
    testing::Combine(testing::Values(OrientationResidual::kHeading,
                                     OrientationResidual::kRotation),
                     testing::Values(LinearizationPath::kStructured,
                                     LinearizationPath::kJets)));

// One pass of 8, 16 or 24 columns, or several.
TEST(SegmentTangent, ComposesToTheRolloutOfTreesOfAnySize) {
  for (const int joints : {1, 2, 4, 6, 9, 14}) {
    SCOPED_TRACE(joints);
    Random random(joints);
    const Model model(RandomMechanism(joints, &random));
    for (const LinearizationPath path :
         {LinearizationPath::kStructured, LinearizationPath::kJets}) {
      SCOPED_TRACE(ToString(path));
      ExpectComposesToTheRollout(
          {model, {}, OrientationResidual::kRotation, 0.0, path});
    }
  }
}

// A force is one that acts beside the efforts: where nothing changes those, the
// same as a change of them.
TEST(SegmentTangent, ForcesActAsEfforts) {
  for (const double step : {0.0, 0.003}) {
    SCOPED_TRACE(step);
    Random random(3);
    const Motion motion(Model(AllJoints()), {}, OrientationResidual::kRotation,
                        step);
    SegmentTangent tangent;
    ASSERT_TRUE(LinearizeAlong(*motion.rollout, motion.x0.data(),
                               motion.theta.data(), &tangent));
    const int nv = motion.model.nv(), n = motion.model.tangent_size();
    for (size_t i = 0; i < tangent.B.size(); ++i) {
      for (int s = 0; s < nv; ++s) {
        const auto moved = [&](double h) {
          sysid::Run run = motion.run;
          const int k = motion.rollout->first() + static_cast<int>(i);
          run.effort(k, s) += h;
          run.channels.clear();
          const Measurements nothing{&run, {}};
          const SegmentRollout one(&motion.model, motion.map.get(), &nothing, k,
                                   k + 1, motion.rollout->options());
          VectorXd x_end(motion.model.state_size()), dx(n);
          double* no_errors = nullptr;
          EXPECT_TRUE(one(tangent.states.row(i).data(), motion.theta.data(),
                          no_errors, x_end.data()));
          BoxMinus<double>(motion.model, x_end.data(),
                           tangent.states.row(i + 1).data(), dx.data());
          return dx;
        };
        const VectorXd difference = RiddersDifference(moved, 0.1).value;
        EXPECT_LT((tangent.B[i].col(s) - difference).norm(),
                  1e-8 * tangent.B[i].col(s).norm())
            << "interval " << i << ", velocity " << s;
      }
    }
  }
}

// Where the forces of parameters are taken: on the motion halfway to the next
// sample, with the acceleration there. (Efforts that are held are the same
// halfway, but those that act later are not: no delay.)
TEST(SegmentTangent, HasTheMotionHalfway) {
  const Mechanism mechanism = AllJoints();
  Model model(mechanism);
  const Catalogue catalogue;
  for (const char* effect :
       {"effort_gain@hinge", "gravity_tilt@base", "viscous_damping@ball"}) {
    model.AddEffect(catalogue.Make(effect, mechanism, "test"));
  }
  model.SetEffectParameter("hinge.effort_gain", 0.0);
  model.SetEffectParameter("gravity_tilt_x", 0.1);
  model.SetEffectParameter("ball.damping", 0.1);
  const Motion motion(model, {}, OrientationResidual::kHeading, 0.0);
  SegmentTangent tangent;
  ASSERT_TRUE(LinearizeAlong(*motion.rollout, motion.x0.data(),
                             motion.theta.data(), &tangent));
  const int nq = model.nq(), nv = model.nv();
  Workspace<double> ws(model);
  Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
  for (int i = 0; i < tangent.middle.rows(); ++i) {
    const int k = motion.rollout->first() + i;
    const double* effort = motion.run.effort.row(k).data();
    VectorXd x = tangent.states.row(i).transpose();
    ASSERT_TRUE(stepper.Step(0.5 * (motion.run.t[k + 1] - motion.run.t[k]),
                             effort, x.data()));
    EXPECT_LT((x - tangent.middle.row(i).transpose()).norm(), 1e-12 * x.norm());
    constexpr double kInstant = 1e-6;
    const VectorXd before = x.tail(nv);
    ASSERT_TRUE(stepper.Step(kInstant, effort, x.data()));
    const VectorXd acceleration = (x.tail(nv) - before) / kInstant;
    EXPECT_LT((acceleration - tangent.acceleration.row(i).transpose()).norm(),
              1e-3 * acceleration.norm());
    ASSERT_EQ(x.size(), nq + nv);
  }
}

TEST(SegmentTangent, FailsWhereTheDynamicsDo) {
  Mechanism mechanism;
  mechanism.AddRoot("base");
  AddSomeJoint("hinge", JointType::kRevolute, 0, "link", {}, &mechanism);
  const Model model(mechanism);
  sysid::Run run;
  run.t = {0.0, 0.1};
  run.effort.setZero(2, 1);
  const ParameterMap map(model, {});
  const Measurements measurements{&run, {}};
  const SegmentRollout rollout(&model, &map, &measurements, 0, 1, {});
  const double x0[] = {0.1, 0.0};
  const double* no_theta = nullptr;
  SegmentTangent tangent;
  EXPECT_FALSE(LinearizeAlong(rollout, x0, no_theta, &tangent));
}

}  // namespace
}  // namespace sysid
