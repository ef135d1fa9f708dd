#include <benchmark/benchmark.h>

#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "glog/logging.h"
#include "sysid/estimation/shooting_stage.h"
#include "sysid/linearization/screening.h"
#include "tests/support/fit_setup.h"

// What a screening of every candidate costs, in units of an iteration of the
// Levenberg-Marquardt that made the fit, measured beside it: seconds differ
// between machines and minutes, this ratio hardly does. Screen has what a
// diagnosis tries without being told (at most 3 is the promise, issue 3),
// ScreenAll the whole catalogue but what reads columns that are not there (at
// most 10, issue 22).
//
// Counters:
//   candidates   effects that are screened
//   tests        of them: points of the grids that are searched
//   iteration    ms that one of the fit takes, beside this line
//   ratio        time of a screening over that

namespace sysid {
namespace {

constexpr double kNoise = 1e-3;
constexpr int kIterations = 3;

// The arm's joints are damped, as a real arm's are; without it the wrist spins
// chaotically.
Model Machine(const std::string& name) {
  if (name != "arm7") return Shipped(name);
  std::vector<std::string> effects;
  std::vector<Value> values;
  for (int joint = 1; joint <= 7; ++joint) {
    const std::string joint_name = "joint" + std::to_string(joint);
    effects.push_back("viscous_damping@" + joint_name);
    values.push_back({joint_name + ".damping", joint <= 4 ? 0.5 : 0.01});
  }
  return Shipped(name, effects, values);
}

// As the shipped specifications have it.
std::vector<Value> Free(const std::string& name) {
  std::vector<Value> free;
  const Mechanism mechanism = LoadUrdf(FindModel(name));
  if (name != "arm7") {
    return {{"link1.length", 0.49}, {"link2.length", 0.51}};
  }
  for (int link = 2; link <= 7; ++link) {
    const std::string link_name = "link" + std::to_string(link);
    free.push_back(
        {link_name + ".mass",
         1.02 * mechanism.nominal.links[mechanism.FindLink(link_name)].mass});
  }
  return free;
}

// A fit of two runs of 4 s at 100 Hz.
struct Fitted {
  std::unique_ptr<ShootingProblem> problem;
  Fit fit;
  std::vector<std::shared_ptr<const Effect>> candidates, all;

  explicit Fitted(const std::string& name) : fit(Machine(name)) {
    const Model model = Machine(name);
    SimulationOptions simulation;
    simulation.duration = 4.0;
    simulation.noise = kNoise;
    if (name == "arm7") simulation.excitation = Excitation::kMultisine;
    std::vector<Run> runs;
    for (const int seed : {1, 2}) {
      simulation.seed = seed;
      runs.push_back(
          Simulate(model, RandomState(model, 0.3, seed), simulation));
    }
    EstimationOptions options;
    options.noise = kNoise;
    options.threads = 1;
    problem = std::make_unique<ShootingProblem>(
        model, FreeFrom(model, Free(name)), runs, options);
    fit = FitIndependentSegments(*problem);
    const Catalogue catalogue;
    const Mechanism& mechanism = model.mechanism();
    for (const std::string& candidate : catalogue.Candidates(mechanism)) {
      candidates.push_back(catalogue.Make(candidate, mechanism, "benchmark"));
    }
    for (const std::string& effect : catalogue.Names(mechanism)) {
      all.push_back(catalogue.Make(effect, mechanism, "benchmark"));
      if (!all.back()->inputs().empty()) all.pop_back();
    }
  }

  // Of the process: everything here runs on one thread, and other processes may
  // want its core. Seconds an iteration of the fit's last stage takes, from
  // parameters that are a little off.
  double MeasureIteration() const {
    Solution point = fit.point;
    point.theta *= 1.01;
    ShootingStage::Options options;
    options.defect = fit.defect;
    options.twist_hold = kHeldSpin;
    options.max_iterations = kIterations;
    options.function_tolerance = 0.0;
    std::vector<HistoryEntry> history;
    const std::clock_t start = std::clock();
    ShootingStage stage(*problem, options, &point);
    const StageSummary done = stage.Solve("iterations", Now(), &history);
    const double spent =
        static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    // The start is linearised and evaluated too.
    return spent / (done.iterations + 1);
  }
};

void Screen(benchmark::State& state, const std::string& name, bool all) {
  const Fitted fitted(name);
  const auto& candidates = all ? fitted.all : fitted.candidates;
  if (!fitted.fit.converged) state.SetLabel("not converged");
  fitted.MeasureIteration();  // warm
  double iteration = 0.5 * fitted.MeasureIteration();
  Screening screening;
  const std::clock_t start = std::clock();
  for (auto _ : state) {
    const LinearizedFit linearized(*fitted.problem, fitted.fit.point);
    CHECK(linearized.Valid());
    screening = ScreenEffects(linearized, fitted.fit.model, candidates);
  }
  const double own = static_cast<double>(std::clock() - start) /
                     CLOCKS_PER_SEC / static_cast<double>(state.iterations());
  iteration += 0.5 * fitted.MeasureIteration();
  state.counters["candidates"] = static_cast<double>(screening.effects.size());
  state.counters["tests"] = screening.tests;
  state.counters["iteration"] = 1e3 * iteration;
  state.counters["ratio"] = own / iteration;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  for (const std::string name : {"pendulum2_planar", "pendulum2", "arm7"}) {
    benchmark::RegisterBenchmark((name + "/Screen").c_str(), sysid::Screen,
                                 name, false)
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark((name + "/ScreenAll").c_str(), sysid::Screen,
                                 name, true)
        ->Unit(benchmark::kMillisecond);
  }
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
