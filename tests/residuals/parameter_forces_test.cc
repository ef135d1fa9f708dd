#include "residuals/parameter_forces.h"

#include <gmock/gmock.h>

#include <cmath>
#include <memory>

#include "models/effects/catalogue.h"
#include "tests/support/all_joints.h"
#include "tests/support/fit_setup.h"
#include "tests/support/measured_run.h"

namespace sysid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A robot in motion, 0.5 s of it.
struct Motion {
  Model model;
  sysid::Run run;
  Measurements measurements;
  VectorXd x0;

  explicit Motion(const std::string& robot, double rate = 200.0,
                  double level = 0.3)
      : model(Shipped(robot)) {
    if (robot == "arm7") {
      // As a geared arm: a wrist of 1e-4 kg m^2 that nothing holds spins
      // through several detents of a cogging within a sample.
      const Catalogue catalogue;
      for (int joint = 1; joint <= 7; ++joint) {
        const std::string name = "joint" + std::to_string(joint);
        for (const char* kind : {"viscous_damping@", "armature@"}) {
          model.AddEffect(
              catalogue.Make(kind + name, model.mechanism(), "test"));
        }
        model.SetEffectParameter(name + ".damping", 1.0);
        model.SetEffectParameter(name + ".armature", 0.1);
      }
    }
    SimulationOptions options;
    options.duration = 0.5;
    options.rate = rate;
    options.excitation = Excitation::kMultisine;
    options.excitation_level = level;
    options.seed = 3;
    x0 = RandomState(model, 0.7, 5);
    for (int i = 0; i < model.nv(); ++i) {
      x0[model.nq() + i] = 0.3 + 0.2 * i * (i % 2 == 0 ? 1 : -1);
    }
    run = Simulate(model, x0, options);
    // Headings: with the whole rotation the spin of thin rods about their own
    // axes, over a moment of 7.5e-5 kg m^2, would be all that these compare.
    measurements =
        MeasurementsOf(model.mechanism(), run, OrientationResidual::kHeading);
  }
};

// Columns of a segment, by the derivative of the whole rollout and by forces.
class Columns {
 public:
  Columns(const Model& model, const std::vector<std::string>& parameters,
          const Motion& motion, const RolloutOptions& options = {})
      : model_(model),
        map_(model_, FindParameters(model_, parameters, "test"), false),
        theta_(map_.size()),
        rollout_(&model_, &map_, &motion.measurements, 0, motion.run.size() - 1,
                 options) {
    for (int i = 0; i < map_.size(); ++i) {
      theta_[i] = map_.parameters()[i].nominal;
    }
    EXPECT_TRUE(
        LinearizeAlong(rollout_, motion.x0.data(), theta_.data(), &tangent_));
    std::vector<double> errors(rollout_.num_residuals());
    std::vector<double> x_end(model_.state_size());
    RowMatrixXd J, J_end;
    EXPECT_TRUE(rollout_.Linearize(motion.x0.data(), theta_.data(), true,
                                   errors.data(), x_end.data(), &J, &J_end));
    exact_ = J.rightCols(map_.size());
  }

  const MatrixXd& exact() const { return exact_; }
  ParameterForces Forces() const {
    return ForceDerivatives(model_, map_, theta_).Along(rollout_, tangent_);
  }
  MatrixXd ByForces() const { return Respond(Forces()); }
  const SegmentRollout& rollout() const { return rollout_; }

 private:
  // (7.1) rolled along the segment.
  MatrixXd Respond(const ParameterForces& forces) const {
    RowMatrixXd out = forces.direct;
    RowMatrixXd dx =
        RowMatrixXd::Zero(model_.tangent_size(), forces.direct.cols());
    for (int k = rollout_.first(); k <= rollout_.last(); ++k) {
      for (const SegmentRow& row : rollout_.rows()) {
        if (row.sample != k) continue;
        out.middleRows(row.first, row.size) +=
            tangent_.C.middleRows(row.first, row.size) * dx;
      }
      if (k == rollout_.last()) break;
      const int i = k - rollout_.first();
      dx = (tangent_.A[i] * dx + tangent_.B[i] * forces.f[i]).eval();
    }
    return out;
  }

  Model model_;
  ParameterMap map_;
  VectorXd theta_;
  SegmentRollout rollout_;
  SegmentTangent tangent_;
  MatrixXd exact_;
};

Model With(const Model& plain, std::shared_ptr<const Effect> effect,
           const std::vector<double>& values) {
  Model model = plain;
  model.AddEffect(effect);
  for (size_t p = 0; p < values.size(); ++p) {
    model.SetEffectParameter(effect->parameters()[p].name, values[p]);
  }
  return model;
}

class Robots : public testing::TestWithParam<std::string> {};

// What is drawn as the force of an effect must do what the effect does. It is
// held between samples, which is of
// second order in their distance; friction, though, jumps where the motion
// turns, somewhere within a sample.
TEST_P(Robots, ColumnsOfEveryEffectAreThoseOfTheRollout) {
  const Motion motion(GetParam());
  const Catalogue catalogue;
  const Mechanism& mechanism = motion.model.mechanism();
  for (const std::string& name : catalogue.Candidates(mechanism)) {
    if (motion.model.effects().Contains(name)) continue;
    const auto effect = catalogue.Make(name, mechanism, "test");
    for (const ProbeSet& probes : effect->ProbeSets()) {
      for (const Probe& probe : probes) {
        if (probe.secant != 0.0) continue;
        const std::string parameter = effect->parameters()[probe.along].name;
        SCOPED_TRACE(name + " by " + parameter);
        const Model model = With(motion.model, effect, probe.at);
        const Columns columns(model, {parameter}, motion);
        const MatrixXd by_forces = columns.ByForces();
        double scale = columns.exact().norm(), bound = 0.01;
        if (parameter.find("friction") != std::string::npos) bound = 0.05;
        // Of two joints, which turn twice as often.
        if (effect->second_joint() >= 0) bound *= 4.0;
        if (parameter.find("static_friction") != std::string::npos) {
          // A level that holds below some 0.03 rad/s holds for less than a
          // sample where the motion turns: its column may be missed or be twice
          // as long, but never more than what a friction does in that sample.
          const std::string friction = effect->parameters()[0].name;
          scale += Columns(model, {friction}, motion).exact().norm();
        }
        EXPECT_LE((by_forces - columns.exact()).norm(), bound * scale + 1e-12);
      }
    }
  }
}

// Masses, centres of mass and inertias of every link.
TEST_P(Robots, ColumnsOfWrongNominalValuesAreThoseOfTheRollout) {
  const Motion motion(GetParam());
  const Catalogue catalogue;
  const Mechanism& mechanism = motion.model.mechanism();
  int corrections = 0;
  for (const std::string& name : catalogue.Candidates(mechanism)) {
    const auto effect = catalogue.Make(name, mechanism, "test");
    if (effect->adjusts_nominal().empty()) continue;
    SCOPED_TRACE(name);
    ++corrections;
    const Columns columns(motion.model, effect->adjusts_nominal(), motion);
    const MatrixXd by_forces = columns.ByForces();
    for (int c = 0; c < by_forces.cols(); ++c) {
      // Products of inertia turn a thin rod about its own axis, quickly.
      const std::string& parameter = effect->adjusts_nominal()[c];
      const bool spins =
          parameter.ends_with(".ixz") || parameter.ends_with(".iyz");
      EXPECT_LE((by_forces.col(c) - columns.exact().col(c)).norm(),
                (spins ? 0.03 : 0.01) * columns.exact().col(c).norm() +
                    1e-9 * columns.exact().norm())
          << parameter;
    }
  }
  EXPECT_GT(corrections, 0);
}

INSTANTIATE_TEST_SUITE_P(Shipped, Robots,
                         testing::Values("pendulum2", "pendulum2_planar",
                                         "cartpole", "arm7"),
                         [](const auto& info) { return info.param; });

// A mechanism of every joint whose frames are seen from outside.
struct SeenFrames : Motion {
  SeenFrames() : Motion("cartpole") {
    model = Model(AllJoints());
    Random random(4);
    const struct RandomState at(model.mechanism(), &random);
    x0.resize(model.state_size());
    x0 << at.q, at.qd;
    run = sysid::Run();
    run = MeasureEverything(model, x0, 61, 0.005, 0.0, &random);
    for (int k = 1; k < run.size(); ++k) run.effort.row(k) = run.effort.row(0);
    measurements =
        MeasurementsOf(model.mechanism(), run, OrientationResidual::kHeading);
  }
};

// A longer link carries the frames behind it elsewhere, at once and by the
// motion that it makes.
TEST(ParameterForces, MoveTheFramesThatAreSeen) {
  const SeenFrames motion;
  const std::vector<std::string> names{"lower.length", "upper.length",
                                       "hinge.x",      "hinge.z",
                                       "lower.com_x",  "payload.mass"};
  const Columns columns(motion.model, names, motion);
  const MatrixXd by_forces = columns.ByForces();
  const RowMatrixXd direct = columns.Forces().direct;
  for (size_t c = 0; c < names.size(); ++c) {
    SCOPED_TRACE(names[c]);
    EXPECT_LT((by_forces.col(c) - columns.exact().col(c)).norm(),
              0.01 * columns.exact().col(c).norm());
    // At the first sample nothing has moved yet: it is direct, and exact.
    bool moves = false;
    for (const SegmentRow& row : columns.rollout().rows()) {
      if (row.sample != 0) continue;
      const auto part = [&](const auto& of) {
        return VectorXd(of.col(c).segment(row.first, row.size));
      };
      EXPECT_LT((part(direct) - part(columns.exact())).norm(), 1e-12);
      moves |= part(direct).norm() > 0.1;
    }
    EXPECT_EQ(moves, c < 4);  // masses and their centres move nothing at once
  }
}

// Held forces are of second order in the sample period: half of it, a quarter
// of the error. (An end of an interval instead of its middle would be of first
// order, and a detour of 1 % at 200 Hz is one of 4 % at 50 Hz.)
TEST(ParameterForces, AreOfSecondOrderInTheSamplePeriod) {
  const std::vector<std::string> names{
      "joint1.damping", "joint2.stiffness", "joint1.armature", "gravity_tilt_y",
      "link2.mass",     "link2.com_x",      "link1.length"};
  const Catalogue catalogue;
  std::vector<MatrixXd> errors;
  for (const double rate : {100.0, 200.0, 400.0}) {
    const Motion motion("pendulum2_planar", rate, 0.0);
    Model model = motion.model;
    for (const char* effect : {"viscous_damping@joint1", "spring@joint2",
                               "armature@joint1", "gravity_tilt@base"}) {
      model.AddEffect(catalogue.Make(effect, model.mechanism(), "test"));
    }
    // The same steps at every rate: several within a sample at the lowest.
    const Columns columns(model, names, motion,
                          {Integrator::kRungeKutta4, 0.0025});
    const MatrixXd by_forces = columns.ByForces();
    // At the times of the lowest rate.
    const int each = static_cast<int>(std::lround(rate / 100.0));
    MatrixXd error = by_forces - columns.exact();
    int kept = 0;
    for (const SegmentRow& row : columns.rollout().rows()) {
      if (row.sample % each != 0) continue;
      const MatrixXd some = error.middleRows(row.first, row.size);
      error.middleRows(kept, row.size) = some;
      kept += row.size;
    }
    errors.push_back(error.topRows(kept));
  }
  for (size_t c = 0; c < names.size(); ++c) {
    for (int i = 0; i < 2; ++i) {
      EXPECT_NEAR(errors[i].col(c).norm() / errors[i + 1].col(c).norm(), 4.0,
                  0.4)
          << names[c];
    }
  }
}

}  // namespace
}  // namespace sysid
