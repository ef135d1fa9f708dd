#include "sysid/session/session_options.h"

#include <gmock/gmock.h>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/stochastic/rollout_gradient.h"
#include "tests/support/error_text.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

sysid::Run RunOf(const std::string& name, int samples, double period) {
  sysid::Run run;
  run.name = name;
  for (int k = 0; k < samples; ++k) run.t.push_back(period * k);
  return run;
}

Session EmptySession() {
  return Session(MakeModel(LoadUrdf(FindModel("pendulum1")), Catalogue()));
}

// What FillLengths makes of flags, with its notices.
struct Lengths {
  Lengths(const FitRequest& request, const std::vector<sysid::Run>& runs,
          const FitSpecification& spec = {}) {
    Session session = EmptySession();
    session.runs = runs;
    FillLengths(request, spec, &session);
    options = session.options;
    notices = session.notices;
  }
  EstimationOptions options;
  std::vector<std::string> notices;
};

FitRequest Segment(double length) {
  FitRequest request;
  request.segment = length;
  return request;
}

FitRequest Step(double length) {
  FitRequest request;
  request.step = length;
  return request;
}

// 109.995 s at 200 Hz, which its user calls 110 s.
TEST(FillLengths, TakesARoundedDurationForTheWholeRun) {
  const std::vector<sysid::Run> runs{RunOf("emps.csv", 22000, 0.005)};
  ASSERT_LT(runs[0].t.back(), 110.0);
  const Lengths lengths(Segment(110.0), runs);
  EXPECT_EQ(lengths.options.segment, runs[0].t.back());
  EXPECT_THAT(lengths.notices, IsEmpty());
}

TEST(FillLengths, TakesALongerSegmentForTheWholeRunAndSaysSo) {
  const std::vector<sysid::Run> runs{RunOf("emps.csv", 22000, 0.005)};
  const Lengths lengths(Segment(200.0), runs);
  EXPECT_EQ(lengths.options.segment, runs[0].t.back());
  EXPECT_THAT(lengths.notices,
              ElementsAre("--segment: 200 s is longer than emps.csv (109.995 "
                          "s), which is fitted in one segment"));
}

TEST(FillLengths, NamesTheRunsThatAreShorterThanASegment) {
  const std::vector<sysid::Run> runs{RunOf("a.csv", 101, 0.01),
                                     RunOf("b.csv", 1001, 0.01),
                                     RunOf("c.csv", 151, 0.02)};
  const Lengths some(Segment(5.0), runs);
  EXPECT_EQ(some.options.segment, 5.0);
  EXPECT_THAT(some.notices,
              ElementsAre("--segment: 5 s is longer than a.csv (1 s), c.csv (3 "
                          "s), which are fitted in one segment each"));
  FitSpecification spec;
  spec.segment = Located<double>{20.0, "fit.yaml:3:10"};
  const Lengths all({}, runs, spec);
  EXPECT_EQ(all.options.segment, runs[1].t.back());
  ASSERT_EQ(all.notices.size(), 1u);
  EXPECT_THAT(all.notices[0], HasSubstr("fit.yaml:3:10: 20 s is longer than "
                                        "a.csv (1 s), b.csv (10 s), c.csv"));
  // The flag wins.
  EXPECT_EQ(Lengths(Segment(0.5), runs, spec).options.segment, 0.5);
  EXPECT_EQ(Lengths({}, runs).options.segment, 0.0);
}

TEST(FillLengths, RefusesLengthsThatAreNotPositive) {
  const std::vector<sysid::Run> runs{RunOf("a.csv", 101, 0.01)};
  EXPECT_EQ(ErrorText([&] { Lengths(Segment(-1.0), runs); }),
            "--segment: must be a positive number, not -1\n"
            "  hint: give seconds, or leave it out: it is then chosen");
  EXPECT_EQ(ErrorText([&] { Lengths(Step(0.0), runs); }),
            "--step: must be a positive number, not 0\n"
            "  hint: give seconds, or leave it out: it is then chosen");
}

TEST(FillLengths, CutsAStepToTheLongestGap) {
  sysid::Run run = RunOf("a.csv", 101, 0.01);
  run.t.back() += 0.02;
  const Lengths lengths(Step(0.5), {run});
  EXPECT_NEAR(lengths.options.rollout.step, 0.03, 1e-12);
  EXPECT_THAT(lengths.notices,
              ElementsAre("--step: 0.5 s is longer than the samples are apart: "
                          "a step ends at every sample"));
  EXPECT_EQ(Lengths(Step(0.004), {run}).options.rollout.step, 0.004);
}

TEST(FillLengths, RefusesAStepThatTakesForever) {
  EXPECT_EQ(ErrorText([] { Lengths(Step(1e-6), {RunOf("a.csv", 101, 0.01)}); }),
            "--step: 1e-06 s makes more than 1000 steps from one sample of "
            "a.csv to the next\n"
            "  hint: leave it out: it is then chosen so that its error is "
            "below the noise");
}

std::string OptionsError(const FitRequest& request,
                         const FitSpecification& spec = {}) {
  Session session = EmptySession();
  return ErrorText([&] { FillOptions(request, spec, &session); });
}

TEST(FillOptions, RefusesNoiseWhoseSquaresOverflow) {
  FitRequest request;
  request.noise = 1e7;
  EXPECT_EQ(OptionsError(request),
            "--noise: cannot be 1e+07: it lies between 1e-12 and 1e+06\n"
            "  hint: give the standard deviation of a measurement, in rad or "
            "m; left out, it is estimated from the data");
}

TEST(Words, AreRefusedThatThereAreNot) {
  EXPECT_EQ(ErrorText([] { ParseOrientation("angle"); }),
            "--residual: unknown residual 'angle'\n"
            "  hint: known: heading, rotation");
  EXPECT_EQ(ErrorText([] { ParseLoss("hubert"); }),
            "--loss: unknown loss 'hubert'\n  hint: did you mean 'huber'?");
  EXPECT_EQ(ErrorText([] { ParseCheckLevel("number"); }),
            "--check: cannot be 'number'\n  hint: did you mean 'numbers'?");
}

TEST(FillOptions, RefusesCountsOfThreadsThatNoMachineHas) {
  FitRequest request;
  request.threads = -1;
  EXPECT_EQ(OptionsError(request),
            "--threads: must not be negative\n  hint: 0 means all cores");
  request.threads = 1025;
  EXPECT_EQ(OptionsError(request),
            "--threads: cannot be 1025: 1024 are the most\n"
            "  hint: more threads than cores make nothing faster; 0 means all "
            "cores");
}

TEST(FillOptions, LetsFlagsWinOverTheSpecification) {
  FitSpecification spec;
  spec.noise = Located<double>{0.1, "fit.yaml:1:1"};
  spec.loss = Located<std::string>{"cauchy", "fit.yaml:2:1"};
  spec.loss_scale = 2.5;
  spec.residual = Located<std::string>{"rotation", "fit.yaml:3:1"};
  Session session = EmptySession();
  const EstimationOptions& options = session.options;
  FillOptions({}, spec, &session);
  EXPECT_EQ(options.noise, 0.1);
  EXPECT_EQ(options.loss, RobustLoss::kCauchy);
  EXPECT_EQ(options.loss_scale, 2.5);
  EXPECT_EQ(options.orientation, OrientationResidual::kRotation);
  EXPECT_GE(options.threads, 1);
  FitRequest request;
  request.noise = 0.2;
  request.loss = RobustLoss::kHuber;
  request.threads = 3;
  FillOptions(request, spec, &session);
  EXPECT_EQ(options.noise, 0.2);
  EXPECT_EQ(options.loss, RobustLoss::kHuber);
  EXPECT_EQ(options.threads, 3);
}

TEST(FillOptions, RefusesSolversThatThereAreNot) {
  Session session = EmptySession();
  FillOptions({}, {}, &session);
  EXPECT_EQ(session.solver, "lm");
  FitRequest request;
  request.solver = "adm";
  EXPECT_EQ(OptionsError(request),
            "--solver: unknown solver 'adm'\n  hint: did you mean 'adam'?");
  FitSpecification spec;
  spec.solver = Located<std::string>{"adam", "fit.yaml:2:9"};
  EXPECT_EQ(OptionsError({}, spec),
            "fit.yaml:2:9: this program has no solver 'adam'\n"
            "  hint: it fits by lm; sysid_fit has all solvers");
  // The flag wins.
  request.solver = "gmm";
  EXPECT_EQ(OptionsError(request, spec),
            "--solver: this program has no solver 'gmm'\n"
            "  hint: it fits by lm; sysid_fit has all solvers");
}

// Theirs would be another loss, and nobody would know.
TEST(FillOptions, RefusesLossesOfOtherSolvers) {
  if (!HaveStanMath()) GTEST_SKIP() << "no Stan Math";
  FitRequest request;
  request.any_solver = true;
  request.solver = "adam";
  FitSpecification spec;
  spec.loss = Located<std::string>{"huber", "fit.yaml:3:7"};
  EXPECT_THAT(OptionsError(request, spec),
              StartsWith("fit.yaml:3:7: has no meaning for --solver adam\n"));
  request.loss = RobustLoss::kNone;
  Session session = EmptySession();
  FillOptions(request, spec, &session);
  EXPECT_EQ(session.solver, "adam");
}

}  // namespace
}  // namespace sysid
