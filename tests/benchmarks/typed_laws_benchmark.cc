#include <benchmark/benchmark.h>

#include <ctime>
#include <string>

#include "glog/logging.h"
#include "sysid/estimation/linearization.h"
#include "tests/support/law_twins.h"

// What a law costs that a user types, beside the same law of the catalogue: the
// iterations of a fit of 10 s at 100 Hz, in alternating rounds. At most 1.5 is
// the promise (issue 22).
//
// Counters:
//   shipped_ms, typed_ms   an iteration
//   ratio                  of typed to shipped

namespace sysid {
namespace {

double Cpu() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Seconds an iteration.
double Iteration(const ShootingProblem& problem) {
  const double began = Cpu();
  const Fit fit = FitLevenbergMarquardt(problem);
  CHECK(fit.converged) << fit.termination;
  return (Cpu() - began) / fit.iterations;
}

void Measure(benchmark::State& state, const LawTwin& twin) {
  const Run run = RunOfTwins(twin);
  const ShootingProblem shipped = ProblemOf(twin, false, run);
  const ShootingProblem typed = ProblemOf(twin, true, run);
  double of_shipped = 0.0, of_typed = 0.0;
  int rounds = 0;
  for (auto _ : state) {
    of_shipped += Iteration(shipped);
    of_typed += Iteration(typed);
    ++rounds;
  }
  state.counters["shipped_ms"] = 1e3 * of_shipped / rounds;
  state.counters["typed_ms"] = 1e3 * of_typed / rounds;
  state.counters["ratio"] = of_typed / of_shipped;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  for (const sysid::LawTwin& twin : sysid::LawTwins()) {
    benchmark::RegisterBenchmark(
        (twin.shipped + "/" + twin.typed).c_str(),
        [twin](benchmark::State& state) { sysid::Measure(state, twin); })
        ->Unit(benchmark::kMillisecond)
        ->Iterations(3);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
