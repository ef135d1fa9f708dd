#include "sysid/estimation/data_set.h"

#include <gmock/gmock.h>

#include <string>

#include "models/model.h"
#include "tests/support/fit_setup.h"
#include "tests/support/thread_processes.h"

namespace sysid {
namespace {

using ::testing::ElementsAre;

// Recordings "0", "1", ... of so many samples each, every second one of them
// with twice the noise.
std::vector<Run> Swings(const Model& model, int runs, int samples) {
  std::vector<Run> swings;
  for (int i = 0; i < runs; ++i) {
    SimulationOptions options;
    options.rate = 100.0;
    options.duration = (samples - 1) / options.rate;
    options.noise = i % 2 == 0 ? 1e-3 : 2e-3;
    options.seed = i + 1;
    swings.push_back(Simulate(model, RandomState(model, 0.5, i + 1), options));
    swings.back().name = std::to_string(i);
  }
  return swings;
}

std::vector<std::string> NamesOf(const DataSet& data) {
  std::vector<std::string> names;
  for (const auto& run : data.runs()) names.push_back(run->run.name);
  return names;
}

TEST(DataSetPart, IsOfRunsThatAreSpreadEvenly) {
  const Model model = Shipped("pendulum1");
  const DataSet data(model.mechanism(), Swings(model, 9, 51), {});
  const auto part = data.Part(3 * 51);
  EXPECT_THAT(NamesOf(*part), ElementsAre("0", "3", "6"));
  EXPECT_EQ(part->samples(), 3 * 51);
  EXPECT_EQ(part->run_count(), 3);
  EXPECT_NEAR(part->TotalDuration(), data.TotalDuration() / 3.0, 1e-9);
  // Runs and noise are those of the whole.
  EXPECT_EQ(part->runs()[1], data.runs()[3]);
  EXPECT_EQ(part->PooledNoise(), data.PooledNoise());
  // Never none, and never more than there are.
  EXPECT_THAT(NamesOf(*data.Part(1)), ElementsAre("0"));
  EXPECT_EQ(NamesOf(*data.Part(1e9)), NamesOf(data));
}

TEST(DataSetPart, DoesNotDependOnTheProcesses) {
  const Model model = Shipped("pendulum1");
  const std::vector<sysid::Run> runs = Swings(model, 9, 51);
  const auto whole = DataSet(model.mechanism(), runs, {}).Part(200);
  const std::vector<std::string> expected = NamesOf(*whole);
  ThreadProcesses(3).Run([&](const Processes& all) {
    // The second one has none.
    const std::vector<int> first = {0, 5, 5, 9};
    const std::vector<sysid::Run> own(runs.begin() + first[all.rank()],
                                      runs.begin() + first[all.rank() + 1]);
    MeasurementOptions options;
    options.processes = {std::shared_ptr<void>(), &all};
    const auto part = DataSet(model.mechanism(), own, options).Part(200);
    std::string names;
    for (const std::string& name : NamesOf(*part)) names += name;
    std::string together;
    for (const std::string& of_one : GatherToAll(all, names)) {
      together += of_one;
    }
    std::string wanted;
    for (const std::string& name : expected) wanted += name;
    EXPECT_EQ(together, wanted);
    EXPECT_EQ(part->samples(), whole->samples());
    EXPECT_EQ(part->run_count(), whole->run_count());
    EXPECT_EQ(part->PooledNoise(), whole->PooledNoise());
  });
}

}  // namespace
}  // namespace sysid
