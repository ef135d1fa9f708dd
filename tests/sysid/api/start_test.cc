// What is known of how a recording begins: --start.

#include <gmock/gmock.h>

#include <random>

#include "sysid/api/identify.h"
#include "sysid/estimation/run_parts.h"
#include "tests/support/error_text.h"
#include "tests/sysid/api/api_test_case.h"

namespace sysid {
namespace {

using ::testing::HasSubstr;

constexpr double kDamping[] = {0.05, 0.02};  // N m s/rad
constexpr double kNoise = 4e-3;              // rad

// Two seconds from rest, as the simulation has it, with noise from the second
// row on; the first row says the velocities as well.
Run FromRest(std::uint64_t seed) {
  Model truth = PlanarPendulum();
  for (int j = 0; j < 2; ++j) {
    const std::string joint = "joint" + std::to_string(j + 1);
    truth.AddEffect(Catalogue().Make("viscous_damping@" + joint,
                                     truth.mechanism(), "here"));
    truth.SetEffectParameter(joint + ".damping", kDamping[j]);
  }
  SimulationOptions options;
  options.duration = 2.0;
  Run run = Simulate(truth, RandomState(truth, 0.9, 4), options);
  run.name = "";
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, kNoise);
  std::vector<Channel> velocities;
  for (Channel& channel : run.channels) {
    for (int k = 1; k < run.size(); ++k) channel.values(k, 0) += normal(random);
    Channel velocity = channel;
    velocity.kind = ChannelKind::kVelocity;
    velocity.name += ".qd";
    velocity.values.setConstant(std::nan(""));
    velocity.values(0, 0) = 0.0;
    velocities.push_back(velocity);
  }
  run.channels.insert(run.channels.end(), velocities.begin(), velocities.end());
  return run;
}

IdentifyRequest RequestFor(RunStart start, const Run& run) {
  IdentifyRequest request;
  request.model_in_memory = std::make_shared<const Model>(PlanarPendulum());
  request.runs = {run};
  request.add = {"viscous_damping@*"};
  request.free_none = true;
  request.noise = kNoise;
  request.check = CheckLevel::kNone;
  request.threads = 1;
  request.start = start;
  return request;
}

struct Coverage {
  int covered = 0;
  double width = 0.0;  // mean standard error
  int contradicted = 0;
};

Coverage CoverageOf(RunStart start, int seeds, double off = 0.0) {
  Coverage coverage;
  for (int seed = 1; seed <= seeds; ++seed) {
    Run run = FromRest(seed);
    run.channels[0].values(0, 0) += off;
    if (start != RunStart::kKnown) run.channels.resize(2);  // positions
    const IdentifyResult result = Identify(RequestFor(start, run));
    EXPECT_TRUE(result.fit().converged);
    const ParameterEstimate& damping = result.fit().parameters[0];
    constexpr double kInterval = 1.96;  // 95 %
    coverage.covered +=
        std::abs(damping.value - kDamping[0]) < kInterval * damping.std_error;
    coverage.width += damping.std_error / seeds;
    for (const std::string& notice : result.session.notices) {
      coverage.contradicted +=
          notice.find("contradict --start") != std::string::npos;
    }
  }
  return coverage;
}

TEST(Start, NarrowsIntervalsThatStillCover) {
  constexpr int kSeeds = 40;
  const Coverage own = CoverageOf(RunStart::kEstimated, kSeeds);
  const Coverage rest = CoverageOf(RunStart::kRest, kSeeds);
  const Coverage known = CoverageOf(RunStart::kKnown, kSeeds);
  EXPECT_LT(rest.width, 0.95 * own.width);
  EXPECT_LT(known.width, 0.95 * rest.width);
  // 38 on the average, two standard deviations below.
  EXPECT_GE(rest.covered, 35);
  EXPECT_GE(known.covered, 35);
  EXPECT_LE(rest.contradicted + known.contradicted, 1);
}

TEST(Start, IsNotBelievedAgainstTheData) {
  // Five times the noise off, in a row that is said to be exact.
  const Coverage known = CoverageOf(RunStart::kKnown, 10, 5.0 * kNoise);
  EXPECT_EQ(known.contradicted, 10);
  EXPECT_GE(known.covered, 7);
}

TEST(Start, OfAllThatMovesMustBeInTheFirstRow) {
  sysid::Run run = FromRest(1);
  run.channels.pop_back();
  EXPECT_THAT(ErrorText([&] { Identify(RequestFor(RunStart::kKnown, run)); }),
              HasSubstr("has no velocity of joint2"));
  EXPECT_TRUE(Identify(RequestFor(RunStart::kRest, run)).fit().converged);
}

TEST(Start, IsOfTheRunsThatBeginThere) {
  // The last quarter of a run, which judges, begins in the middle.
  std::vector<sysid::Run> runs = {FromRest(1)};
  runs[0].start = RunStart::kKnown;
  const std::vector<sysid::Run> ends = HoldOutLastQuarter(&runs);
  EXPECT_EQ(runs[0].start, RunStart::kKnown);
  EXPECT_EQ(ends[0].start, RunStart::kEstimated);
  EXPECT_EQ(JoinEnds(runs, ends)[0].start, RunStart::kKnown);
}

}  // namespace
}  // namespace sysid
