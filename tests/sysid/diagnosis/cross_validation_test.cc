#include "sysid/diagnosis/cross_validation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "sysid/estimation/holdout.h"
#include "tests/sysid/diagnosis/diagnosis_setup.h"
#include "tests/sysid/diagnosis/stretches.h"

namespace sysid {
namespace {

TEST(CrossValidation, IsTheGeometricMeanOfItsStretches) {
  const CrossValidation cv = Of({1.0, 2.0, 4.0});
  EXPECT_NEAR(cv.error(), 2.0, 1e-12);
  // ln 2 from stretch to stretch.
  EXPECT_NEAR(cv.std_error(), 2.0 * std::log(2.0) / std::sqrt(3.0), 1e-12);
  EXPECT_TRUE(std::isinf(Of({1.0}).std_error()));
  EXPECT_TRUE(std::isinf(CrossValidation().error()));
}

// A pendulum with a friction that the model lacks, fitted in segments of a
// second.
DiagnosisProblem FrictionProblem(int runs) {
  const Model truth = Shipped(
      "pendulum2_planar", {"viscous_damping@joint1", "coulomb_friction@joint2"},
      {{"joint1.damping", 0.02}, {"joint2.friction", 0.01}});
  std::vector<sysid::Run> all;
  for (int seed = 1; seed <= runs + 1; ++seed) {
    all.push_back(Record(truth, seed, {.duration = 6.0}));
  }
  DiagnosisProblem problem = MakeProblem(
      Shipped("pendulum2_planar", {"viscous_damping@joint1"}),
      {{"link1.length", 0.5}, {"link2.length", 0.5}, {"joint1.damping", 0.02}},
      all);
  problem.options.segment = 1.0;
  return problem;
}

// (7.11) is what fits without each run say of it.
TEST(CrossValidate, PredictsEachRunFromTheOthers) {
  constexpr int kRuns = 3;
  const DiagnosisProblem problem = FrictionProblem(kRuns);
  const ShootingProblem posed(problem.model, problem.free, problem.train,
                              problem.options);
  const Fit fit = FitIndependentSegments(posed);
  ASSERT_TRUE(fit.converged);
  const LinearizedFit linearized(posed, fit.point);
  ASSERT_TRUE(linearized.Valid());
  const CrossValidation cv = CrossValidate(linearized);
  ASSERT_EQ(cv.stretches.size() % kRuns, 0u);
  const size_t each = cv.stretches.size() / kRuns;
  for (int left_out = 0; left_out < kRuns; ++left_out) {
    std::vector<sysid::Run> others = RunsOf(*problem.train);
    const sysid::Run run = others[left_out];
    others.erase(others.begin() + left_out);
    const auto data = MakeDataSet(problem.model, others, problem.options);
    const Fit without = FitIndependentSegments(
        ShootingProblem(problem.model, problem.free, data, problem.options));
    const Holdout predicted = EvaluateHoldout(
        OpenHoldout(
            without.model,
            MakeDataSetLike(problem.model, {run}, problem.options, *data),
            problem.options, fit.point.rollout, fit.segment_s),
        nullptr);
    double squares = 0.0;
    for (size_t j = 0; j < each; ++j) {
      squares += cv.stretches[left_out * each + j].squares;
    }
    EXPECT_NEAR(squares, predicted.errors.squares, 0.02 * squares);
    // It is more than a fit of that run too leaves of it.
    double fitted = 0.0;
    for (const SegmentError& segment : fit.train.segments) {
      if (segment.trajectory == run.name) fitted += segment.squares;
    }
    EXPECT_GT(squares, fitted);
  }
}

// The model damps more than the machine does: a drag would have to push.
TEST(CrossValidate, LeavesAtTheirBoundsWhatEndedThere) {
  const Model truth = Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                              {{"joint1.damping", 0.02}});
  DiagnosisProblem problem =
      MakeProblem(Shipped("pendulum2_planar", {"viscous_damping@joint1"},
                          {{"joint1.damping", 0.03}}),
                  {{"link1.length", 0.5}, {"link2.length", 0.5}},
                  {Record(truth, 1), Record(truth, 2), Record(truth, 3)});
  problem.options.segment = 1.0;
  const EvaluatedModel before = EvaluateGiven(problem);
  std::map<std::string, double> start = ValuesOf(before);
  start["joint1.quadratic_drag"] = 0.001;
  const EvaluatedModel after =
      EvaluateFrom(problem, before,
                   {Catalogue().Make("quadratic_drag@joint1",
                                     problem.model.mechanism(), "test")},
                   {}, {start}, 0.0, problem.options);
  ASSERT_TRUE(after.fit.parameters.back().at_bound);
  EXPECT_EQ(after.fit.parameters.back().value, 0.0);
  EXPECT_NEAR(after.cv.error(), before.cv.error(), 1e-3 * before.cv.error());
}

TEST(CrossValidate, CutsOneRunIntoStretches) {
  const DiagnosisProblem problem = FrictionProblem(1);
  const ShootingProblem posed(problem.model, problem.free, problem.train,
                              problem.options);
  const Fit fit = FitIndependentSegments(posed);
  const LinearizedFit linearized(posed, fit.point);
  ASSERT_TRUE(linearized.Valid());
  CrossValidation cv = CrossValidate(linearized);
  int used = 0;
  double squares = 0.0, dof = 0.0;
  for (const CrossValidation::Stretch& stretch : cv.stretches) {
    used += stretch.dof > 0.0;
    squares += stretch.squares;
    dof += stretch.dof;
  }
  EXPECT_EQ(used, fit.point.runs[0].segments());
  EXPECT_EQ(cv.stretches.front().trajectory,
            problem.train->runs()[0]->run.name);
  EXPECT_EQ(cv.stretches.front().t_start, 0.0);
  EXPECT_NEAR(cv.stretches.back().t_end, 6.0, 1e-9);
  EXPECT_EQ(cv.stretches[0].t_end, cv.stretches[1].t_start);
  EXPECT_GT(squares, fit.train.squares);
  EXPECT_LT(squares, 1.5 * fit.train.squares);
  EXPECT_EQ(dof, 2.0 * fit.samples - 4.0 * used);
  // Held-out runs are more of them.
  const size_t before = cv.stretches.size();
  const Holdout held =
      EvaluateHoldout(OpenHoldout(fit.model, problem.holdout, problem.options,
                                  fit.point.rollout, fit.segment_s),
                      nullptr);
  AddHeldOut(*problem.holdout, held.errors, 4.0, &cv);
  EXPECT_GT(cv.stretches.size(), before);
  double more = 0.0;
  for (size_t j = before; j < cv.stretches.size(); ++j) {
    more += cv.stretches[j].squares;
  }
  EXPECT_NEAR(more, held.errors.squares, 1e-9 * more);
}

}  // namespace
}  // namespace sysid
