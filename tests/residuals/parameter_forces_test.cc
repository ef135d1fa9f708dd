#include "residuals/parameter_forces.h"

#include <gmock/gmock.h>

#include <cmath>

#include "models/effects/catalogue.h"
#include "tests/support/fit_setup.h"

namespace sysid {
namespace {

// The response of a segment's errors to forces: (7.1) rolled along it.
Eigen::MatrixXd Respond(const SegmentRollout& rollout,
                        const SegmentTangent& tangent,
                        const ParameterForces& forces) {
  RowMatrixXd out = forces.direct;
  RowMatrixXd dx = RowMatrixXd::Zero(rollout.model().tangent_size(),
                                     forces.direct.cols());
  for (int k = rollout.first(); k <= rollout.last(); ++k) {
    for (const SegmentRow& row : rollout.rows()) {
      if (row.sample != k) continue;
      out.middleRows(row.first, row.size) +=
          tangent.C.middleRows(row.first, row.size) * dx;
    }
    if (k == rollout.last()) break;
    const int i = k - rollout.first();
    dx = (tangent.A[i] * dx + tangent.B[i] * forces.f[i]).eval();
  }
  return out;
}

class Robots : public testing::TestWithParam<std::string> {};

// A model in motion, 0.5 s of it.
struct Motion {
  Model model;
  sysid::Run run;
  Measurements measurements;
  Eigen::VectorXd x0;

  explicit Motion(const std::string& robot) : model(Shipped(robot)) {
    SimulationOptions options;
    options.duration = 0.5;
    options.rate = 200.0;
    options.excitation = Excitation::kMultisine;
    options.seed = 3;
    x0 = RandomState(model, 0.7, 5);
    for (int i = 0; i < model.nv(); ++i) {
      x0[model.nq() + i] = 0.3 + 0.2 * i * (i % 2 == 0 ? 1 : -1);
    }
    run = Simulate(model, x0, options);
    measurements.run = &run;
    for (const Channel& channel : run.channels) {
      measurements.residuals.push_back(
          MakeChannelResidual(model.mechanism(), channel,
                              OrientationResidual::kRotation));
    }
  }
};

// Every candidate's column by the forces (7.2) against the derivative of the
// whole rollout by Jets.
TEST_P(Robots, ColumnsOfEveryEffectAreThoseOfTheRollout) {
  const Motion motion(GetParam());
  const Catalogue catalogue;
  const Mechanism& mechanism = motion.model.mechanism();
  for (const std::string& name : catalogue.Candidates(mechanism)) {
    const auto effect = catalogue.Make(name, mechanism, "test");
    for (const ProbeSet& probes : effect->ProbeSets()) {
      for (const Probe& probe : probes) {
        if (probe.secant != 0.0) continue;
        const std::string parameter =
            effect->parameters()[probe.along].name;
        SCOPED_TRACE(name + " by " + parameter);
        Model model = motion.model;
        model.AddEffect(effect);
        for (size_t p = 0; p < probe.at.size(); ++p) {
          model.SetEffectParameter(effect->parameters()[p].name, probe.at[p]);
        }
        const ParameterMap map(model, FindParameters(model, {parameter}, ""));
        const Eigen::VectorXd theta =
            Eigen::VectorXd::Constant(1, probe.at[probe.along]);
        const SegmentRollout rollout(&model, &map, &motion.measurements, 0,
                                     motion.run.size() - 1, {});
        SegmentTangent tangent;
        ASSERT_TRUE(LinearizeAlong(rollout, motion.x0.data(), theta.data(),
                                   &tangent));
        std::vector<double> errors(rollout.num_residuals());
        std::vector<double> x_end(model.state_size());
        RowMatrixXd J, J_end;
        ASSERT_TRUE(rollout.Linearize(motion.x0.data(), theta.data(), true,
                                      errors.data(), x_end.data(), &J, &J_end));
        const Eigen::VectorXd exact = J.col(model.tangent_size());
        ParameterForces forces = ParameterForces::Zero(rollout, 2);
        AddParameterForces(model, map, theta, rollout, tangent, 0, &forces);
        if (effect->hooks() == kEffortHook) {
          AddEffortForces(model, *effect, probe, tangent, 1, &forces);
        }
        const Eigen::MatrixXd columns = Respond(rollout, tangent, forces);
        // The force is held between samples: of second order in their distance,
        // but for friction, which jumps where the motion turns.
        const double scale = exact.norm() + 1e-12;
        const bool jumps = name.find("friction") != std::string::npos;
        EXPECT_LT((columns.col(0) - exact).norm(), (jumps ? 0.05 : 0.01) * scale);
        if (effect->hooks() == kEffortHook) {
          EXPECT_LT((columns.col(1) - columns.col(0)).norm(), 1e-9 * scale);
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shipped, Robots,
                         testing::Values("pendulum2", "pendulum2_planar",
                                         "cartpole", "arm7"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace sysid
