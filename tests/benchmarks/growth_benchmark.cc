#include <benchmark/benchmark.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "glog/logging.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/shooting_stage.h"
#include "sysid/report/svg_plot.h"
#include "tests/support/fit_setup.h"

// What grows with the data: Levenberg-Marquardt over one swing of
// pendulum2_planar at 100 Hz, two lengths, in segments of 0.5 s, from a
// thousand samples to a million; `growth_states` with a presliding friction on
// both joints, so that the state has two numbers more. `--plot=FILE` draws the
// curves of the first (docs/performance.md).
//
// Counters:
//   ns_sample   of CPU for each sample and linearisation (the start and three
//               iterations)
//   B_sample    of the process' peak memory for each sample, the run's own
//               numbers included

namespace sysid {
namespace {

constexpr double kRate = 100.0;   // Hz
constexpr double kSegment = 0.5;  // s
constexpr int kIterations = 3;

struct Growth {
  double ns = 0.0, bytes = 0.0;  // for each sample
};
// Of every line without states, by samples.
std::map<int, Growth>& Measured() {
  static auto& measured = *new std::map<int, Growth>;
  return measured;
}

double Cpu() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Of the process, from now on; 0 where /proc does not say.
void ForgetPeak() { std::ofstream("/proc/self/clear_refs") << "5"; }
double PeakBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    double kilobytes;
    if (std::sscanf(line.c_str(), "VmHWM: %lf kB", &kilobytes) == 1) {
      return 1024.0 * kilobytes;
    }
  }
  return 0.0;
}

Model Swing(bool with_states) {
  if (!with_states) return Shipped("pendulum2_planar");
  std::vector<std::string> effects;
  std::vector<Value> values;
  for (const std::string joint : {"joint1", "joint2"}) {
    effects.push_back("presliding_friction@" + joint);
    values.push_back({joint + ".presliding_friction", 0.002});
    values.push_back({joint + ".presliding_length", 0.05});
  }
  return Shipped("pendulum2_planar", effects, values);
}

Growth Measure(const Model& model, int samples, int rounds) {
  malloc_trim(0);  // what an earlier one has freed
  ForgetPeak();
  const double before = PeakBytes();
  SimulationOptions simulation;
  simulation.duration = samples / kRate;
  simulation.rate = kRate;
  simulation.noise = 1e-3;
  simulation.step = 0.5 / kRate;
  EstimationOptions options;
  options.noise = 1e-3;
  const ShootingProblem problem(
      model, FreeFrom(model, {{"link1.length", 0.52}, {"link2.length", 0.48}}),
      {Simulate(model, RandomState(model, 0.5, 1), simulation)}, options);
  const Solution start = CutPoint(problem, problem.InitialTheta(),
                                  AllStatesFromData(problem), kSegment);
  ShootingStage::Options stage_options;
  stage_options.defect = kMiddleDefect;
  stage_options.max_iterations = kIterations;
  stage_options.function_tolerance = 0.0;
  // Short ones often enough for the clock.
  double best = std::numeric_limits<double>::infinity();
  const int repeats = std::max(1, 20000 / samples);
  for (int round = 0; round < rounds; ++round) {
    const double began = Cpu();
    int linearised = 0;
    for (int i = 0; i < repeats; ++i) {
      Solution point = start;
      std::vector<HistoryEntry> history;
      ShootingStage stage(problem, stage_options, &point);
      linearised += stage.Solve("growth", Now(), &history).iterations + 1;
    }
    best = std::min(best, (Cpu() - began) / linearised);
  }
  return {1e9 * best / samples, (PeakBytes() - before) / samples};
}

void Grow(benchmark::State& state, bool with_states) {
  const int samples = static_cast<int>(state.range(0));
  const Model model = Swing(with_states);
  Growth grown;
  for (auto _ : state) grown = Measure(model, samples, 3);
  state.counters["ns_sample"] = grown.ns;
  state.counters["B_sample"] = grown.bytes;
  if (!with_states) Measured()[samples] = grown;
}

// --- The plot ---------------------------------------------------------------

std::string Plot() {
  std::vector<double> samples, ns, kilobytes;
  for (const auto& [count, growth] : Measured()) {
    samples.push_back(count);
    ns.push_back(1e-3 * growth.ns);
    kilobytes.push_back(1e-3 * growth.bytes);
  }
  const auto upwards = [](const std::string& label,
                          const std::vector<double>& values) {
    return PlotAxis{label, 0.0,
                    1.25 * *std::max_element(values.begin(), values.end())};
  };
  std::vector<SvgPanel> panels;
  const auto panel = [&](double x, const std::string& title,
                         const std::vector<double>& values,
                         const std::string& colour) {
    SvgPanel drawn({x, 60, 280, 200}, AxisOver("samples", samples, true),
                   upwards("", values), title);
    drawn.Line(samples, values, colour);
    for (size_t i = 0; i < samples.size(); ++i) {
      drawn.Marker(samples[i], values[i], colour);
    }
    panels.push_back(drawn);
  };
  panel(60, "microseconds a sample and iteration", ns, "#1f6f8b");
  panel(410, "kB of peak memory a sample", kilobytes, "#b5523b");
  return SvgFigure(720, 320, "Growth from a thousand samples to a million",
                   panels, {});
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  std::string plot;
  for (int i = 1; i < argc; ++i) {
    if (std::strncmp(argv[i], "--plot=", 7) != 0) continue;
    plot = argv[i] + 7;
    std::copy(argv + i + 1, argv + argc, argv + i);
    --argc;
    break;
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  for (const bool with_states : {false, true}) {
    benchmark::RegisterBenchmark(with_states ? "growth_states" : "growth",
                                 sysid::Grow, with_states)
        ->RangeMultiplier(10)
        ->Range(1000, 1000000)
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
    // What a process loads once is not of the data.
    sysid::Measure(sysid::Swing(with_states), 1000, 1);
  }
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  if (!plot.empty()) std::ofstream(plot) << sysid::Plot();
  return 0;
}
