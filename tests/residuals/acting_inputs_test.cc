#include "residuals/acting_inputs.h"

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
  VectorXd tau(model.held_size());
  ActingInputs<double>(run, ws, sample, t, h, tau.data());
  return tau;
}

TEST(ActingInputs, IsTheRowsWithoutDelay) {
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

TEST(ActingInputs, IsTheMeanOfTheRowsBeforeByTheDelay) {
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
TEST(ActingInputs, IsARowThatManySamplesAgo) {
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

TEST(ActingInputs, HasTheDerivativeOfDifferencesByTheDelay) {
  const sysid::Run run = UnevenRun(Model(AllJoints()).nv());
  const auto jets = [&](double delay, int k, double t, double h) {
    const Model model = Delayed(delay);
    Workspace<Jet8> ws(model);
    MechanismParameters<Jet8> values = ws.parameters();
    values.effects[0] = Jet8(delay, 0);
    ws.SetParameters(values);
    std::vector<Jet8> tau(model.nv());
    ActingInputs<Jet8>(run, ws, k, t, h, tau.data());
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
TEST(ActingInputs, ChangesByTheSecantOfAProbe) {
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

TEST(ActingInputs, IsDelayedAndThenMultipliedInWhateverOrder) {
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

// lag y' = u - y by definition: many small steps.
double LaggedByDefinition(const sysid::Run& run, int column, double lag,
                          double from, double to) {
  constexpr int kParts = 4000000;
  const double begin = run.t.front() - 40 * lag;
  double y = run.effort(0, column), mean = 0.0;
  const double dt = (to - begin) / kParts;
  for (int i = 0; i < kParts; ++i) {
    const double time = begin + (i + 0.5) * dt;
    int row = 0;
    while (row + 1 < run.size() && run.t[row + 1] <= time) ++row;
    const double next = run.effort(row, column) +
                        (y - run.effort(row, column)) * std::exp(-dt / lag);
    if (time > from) mean += 0.5 * (y + next) * dt;
    y = next;
  }
  return mean / (to - from);
}

TEST(ActingInputs, AreLowPassedByALag) {
  Model model(AllJoints());
  model.AddEffect(
      Catalogue().Make("actuator_lag@hinge", model.mechanism(), ""));
  const int v =
      model.mechanism().joints[model.mechanism().FindJoint("hinge")].v_index;
  const sysid::Run run = UnevenRun(model.nv());
  for (const double lag : {0.002, 0.01, 0.3}) {
    model.SetEffectParameter("hinge.actuator_lag", lag);
    EXPECT_NEAR(Acting(model, run, 3, 1.04, 0.02)[v],
                LaggedByDefinition(run, v, lag, 1.04, 1.06), 2e-4);
  }
}

// Of lag and delay together, at null too.
TEST(ActingInputs, HasTheDerivativeOfDifferencesByTheLag) {
  for (const double lag : {0.0, 1e-5, 0.004, 0.05}) {
    Model model = Delayed(0.0013, {"effort_delay@base", "actuator_lag@hinge"});
    model.SetEffectParameter("hinge.actuator_lag", lag);
    const sysid::Run run = UnevenRun(model.nv());
    const auto at = [&](double delay, double value) {
      Model moved = model;
      moved.SetEffectParameter("effort_delay", delay);
      moved.SetEffectParameter("hinge.actuator_lag", value);
      return Acting(moved, run, 3, 1.04, 0.005);
    };
    MechanismParameters<Jet8> values;
    model.nominal().CastTo(&values);
    for (int i = 0; i < 2; ++i) values.effects[i].v[i] = 1.0;
    Workspace<Jet8> ws(model);
    ws.SetParameters(values);
    std::vector<Jet8> held(model.held_size());
    ActingInputs<Jet8>(run, ws, 3, 1.04, 0.005, held.data());
    const double h = lag == 0.0 ? 1e-9 : 1e-6 * (lag + 1e-3);
    const VectorXd by_delay =
        (at(0.0013 + 1e-7, lag) - at(0.0013 - 1e-7, lag)) / 2e-7;
    const VectorXd by_lag =
        lag == 0.0
            ? VectorXd((at(0.0013, h) - at(0.0013, 0)) / h)
            : VectorXd((at(0.0013, lag + h) - at(0.0013, lag - h)) / (2 * h));
    for (int v = 0; v < model.nv(); ++v) {
      EXPECT_NEAR(held[v].v[0], by_delay[v], 1e-3 + 1e-4 * by_delay.norm());
      EXPECT_NEAR(held[v].v[1], by_lag[v], 1e-3 + 1e-4 * by_lag.norm());
    }
  }
}

// A command holds, a temperature is linear, the time is that of the middle; the
// command acts later by the effect's own delay.
TEST(ActingInputs, FillsInWhatEffectsRead) {
  Model model(AllJoints());
  const Catalogue catalogue;
  for (const char* name : {"position_drive@hinge", "thermal_friction@slide",
                           "custom@wheel: k*t*hinge.cmd"}) {
    model.AddEffect(catalogue.Make(name, model.mechanism(), "test"));
  }
  sysid::Run run = UnevenRun(model.nv());
  run.inputs = {{"slide.temperature", false, {20, 21, 23, 24, 25, 30, 31}},
                {"hinge.cmd", true, {0, 1, 2, 3, 4, 5, 6}}};
  const int nv = model.nv();
  VectorXd held(model.held_size());
  ASSERT_EQ(held.size(), nv + 4);
  const auto fill = [&] {
    const Workspace<double> ws(model);
    ActingInputs<double>(run, ws, 1, 1.01, 0.01, held.data());
  };
  fill();
  EXPECT_NEAR(held[nv], 1.0, 1e-12);
  EXPECT_NEAR(held[nv + 1], 21.5, 1e-12);
  EXPECT_NEAR(held[nv + 2], 1.015, 1e-12);
  EXPECT_NEAR(held[nv + 3], 1.0, 1e-12);
  model.SetEffectParameter("hinge.drive_delay", 0.0025);
  fill();
  EXPECT_NEAR(held[nv], 0.75, 1e-12);
  EXPECT_NEAR(held[nv + 3], 1.0, 1e-12);
}

}  // namespace
}  // namespace sysid
