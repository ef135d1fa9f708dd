#include "residuals/acting_effort.h"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/all_joints.h"
#include "tests/support/measured_run.h"

namespace sysid {
namespace {

using Eigen::VectorXd;
using ::testing::ElementsAre;

// Efforts at uneven times, so that no window is like another.
sysid::Run UnevenRun(int nv) {
  sysid::Run run;
  run.t = {1.0, 1.01, 1.03, 1.035, 1.06, 1.1, 1.11};
  run.effort.resize(run.size(), nv);
  Random random(1);
  for (double& effort : run.effort.reshaped()) effort = random.Normal();
  return run;
}

// The definition: u(s) by going through the rows, the mean by many small parts.
double MeanByDefinition(const sysid::Run& run, int column, double from,
                        double to) {
  constexpr int kParts = 100000;
  double sum = 0.0;
  for (int i = 0; i < kParts; ++i) {
    const double time = from + (to - from) * (i + 0.5) / kParts;
    int row = 0;
    while (row + 1 < run.size() && run.t[row + 1] <= time) ++row;
    sum += run.effort(row, column);
  }
  return sum / kParts;
}

Model Delayed(double delay, const std::vector<std::string>& more = {}) {
  Model model(AllJoints());
  const Catalogue catalogue;
  std::vector<std::string> names = more;
  if (names.empty()) names.push_back("effort_delay@base");
  for (const std::string& name : names) {
    model.AddEffect(catalogue.Make(name, model.mechanism(), "test"));
  }
  model.SetEffectParameter("effort_delay", delay);
  return model;
}

VectorXd Acting(const Model& model, const sysid::Run& run, int sample, double t,
                double h) {
  const Workspace<double> ws(model);
  VectorXd tau(model.nv());
  ActingEffort<double>(run, ws, sample, t, h, tau.data());
  return tau;
}

TEST(ActingEffort, IsTheRowsWithoutDelay) {
  const sysid::Run run = UnevenRun(Model(AllJoints()).nv());
  for (const Model& model : {Model(AllJoints()), Delayed(0.0)}) {
    for (int k = 0; k + 1 < run.size(); ++k) {
      const double dt = run.t[k + 1] - run.t[k];
      for (int s = 0; s < 3; ++s) {
        EXPECT_EQ(Acting(model, run, k, run.t[k] + dt * s / 3, dt / 3),
                  VectorXd(run.effort.row(k).transpose()));
      }
    }
  }
}

TEST(ActingEffort, IsTheMeanOfTheRowsBeforeByTheDelay) {
  const sysid::Run run = UnevenRun(Model(AllJoints()).nv());
  // Within a sample, a whole one, several, and to before the first row.
  for (const double delay : {0.003, 0.01, 0.025, 0.047, 0.09, 0.5}) {
    const Model model = Delayed(delay);
    for (int k = 0; k + 1 < run.size(); ++k) {
      const double h = 0.5 * (run.t[k + 1] - run.t[k]);
      const VectorXd tau = Acting(model, run, k, run.t[k] + h, h);
      for (int i = 0; i < tau.size(); ++i) {
        EXPECT_NEAR(tau[i],
                    MeanByDefinition(run, i, run.t[k] + h - delay,
                                     run.t[k] + 2 * h - delay),
                    1e-4);
      }
    }
  }
}

// A delay by whole samples shifts the rows and smears nothing, in spite of the
// rounding of times.
TEST(ActingEffort, IsARowThatManySamplesAgo) {
  sysid::Run run;
  const Model model = Delayed(0.03);
  for (int k = 0; k < 200; ++k) run.t.push_back(100.0 + k / 100.0);
  run.effort.resize(run.size(), model.nv());
  Random random(2);
  for (double& effort : run.effort.reshaped()) effort = random.Normal();
  for (int k = 3; k + 1 < run.size(); ++k) {
    const VectorXd tau =
        Acting(model, run, k, run.t[k], run.t[k + 1] - run.t[k]);
    EXPECT_LT((tau - run.effort.row(k - 3).transpose()).norm(), 1e-10) << k;
  }
}

TEST(ActingEffort, HasTheDerivativeOfDifferencesByTheDelay) {
  const sysid::Run run = UnevenRun(Model(AllJoints()).nv());
  const auto jets = [&](double delay, int k, double t, double h) {
    const Model model = Delayed(delay);
    Workspace<Jet8> ws(model);
    MechanismParameters<Jet8> values = ws.parameters();
    values.effects[0] = Jet8(delay, 0);
    ws.SetParameters(values);
    std::vector<Jet8> tau(model.nv());
    ActingEffort<Jet8>(run, ws, k, t, h, tau.data());
    return tau;
  };
  for (int k = 0; k + 1 < run.size(); ++k) {
    const double h = 0.5 * (run.t[k + 1] - run.t[k]), t = run.t[k] + h;
    for (const double delay : {0.0, 0.0013, 0.0171, 0.0337}) {
      // Less than to the next row: the law is linear there. Where the effect
      // is off, towards more of it.
      const double step = 1e-5;
      const double below = delay > 0.0 ? delay - step : 0.0;
      const VectorXd slope = (Acting(Delayed(delay + step), run, k, t, h) -
                              Acting(Delayed(below), run, k, t, h)) /
                             (delay + step - below);
      const std::vector<Jet8> tau = jets(delay, k, t, h);
      for (int i = 0; i < slope.size(); ++i) {
        EXPECT_NEAR(tau[i].v[0], slope[i], 1e-8) << delay << " at " << k;
      }
    }
  }
}

// What the probes with a secant stand for.
TEST(ActingEffort, ChangesByTheSecantOfAProbe) {
  const sysid::Run run = UnevenRun(Model(AllJoints()).nv());
  const auto effect =
      Catalogue().Make("effort_delay@base", AllJoints(), "test");
  int secants = 0;
  for (const ProbeSet& probes : effect->ProbeSets()) {
    const double secant = probes.front().secant;
    if (secant == 0.0) continue;
    ++secants;
    const double h = run.t[5] - run.t[4];
    const VectorXd change = Acting(Delayed(secant), run, 4, run.t[4], h) -
                            Acting(Delayed(0.0), run, 4, run.t[4], h);
    for (int i = 0; i < change.size(); ++i) {
      EXPECT_NEAR(
          change[i],
          MeanByDefinition(run, i, run.t[4] - secant, run.t[5] - secant) -
              run.effort(4, i),
          1e-4);
    }
  }
  EXPECT_GE(secants, 3);
}

TEST(ActingEffort, IsDelayedAndThenMultipliedInWhateverOrder) {
  const sysid::Run run = UnevenRun(Model(AllJoints()).nv());
  const double h = run.t[5] - run.t[4];
  const VectorXd late = Acting(Delayed(0.02), run, 4, run.t[4], h);
  const std::vector<std::string> effects{"effort_delay@base",
                                         "effort_gain@ball"};
  for (const auto& names :
       {effects, std::vector<std::string>(effects.rbegin(), effects.rend())}) {
    Model model = Delayed(0.02, names);
    model.SetEffectParameter("ball.effort_gain", 0.5);
    VectorXd expected = late;
    const Joint& ball =
        model.mechanism().joints[model.mechanism().FindJoint("ball")];
    expected.segment<3>(ball.v_index) *= 1.5;
    EXPECT_LT((Acting(model, run, 4, run.t[4], h) - expected).norm(), 1e-15);
  }
}

TEST(RowBefore, HoldsFromARowToTheNext) {
  const sysid::Run run = UnevenRun(1);
  const auto rows = [&](const std::vector<double>& times) {
    std::vector<int> found;
    for (const double time : times) found.push_back(RowBefore(run, time));
    return found;
  };
  EXPECT_THAT(rows({0.0, 1.0, 1.005, 1.01, 1.011, 1.11, 9.0}),
              ElementsAre(0, 0, 0, 0, 1, 5, 6));
}

}  // namespace
}  // namespace sysid
