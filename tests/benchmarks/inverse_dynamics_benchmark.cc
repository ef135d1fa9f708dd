#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "glog/logging.h"
#include "sysid/estimation/clock.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/segmentation.h"
#include "sysid/estimation/shooting_stage.h"
#include "sysid/inverse_dynamics/filter_choice.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "sysid/io/read_run.h"
#include "sysid/report/svg_plot.h"
#include "tests/benchmarks/reference.h"
#include "tests/support/tracked_arm.h"

// Inverse dynamics as an estimator, of arm7 tracked for 20 s at 500 Hz with all
// inertial parameters and three frictions an axis free: beside NumPy
// (inverse_dynamics_reference.py), and as joints and free parameters grow,
// beside an iteration of Levenberg-Marquardt. `--plot=FILE` draws the curves
// (docs/performance.md).
//
// Counters:
//   reference   the same by NumPy, ms; medians of alternating rounds
//   ratio       their time to ours, by all cores
//   cpu_ratio   the same of processor time
//   free        parameters that are free
//   base        combinations that show
//   iteration   of Levenberg-Marquardt in segments of 0.5 s, ms of CPU

namespace sysid {
namespace {

using Json = nlohmann::json;

constexpr int kRounds = 5;        // of times that scatter by a tenth
constexpr int kIterations = 3;    // of Levenberg-Marquardt
constexpr double kSegment = 0.5;  // s

double Cpu() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// --- Beside NumPy -----------------------------------------------------------

struct Seconds {
  double passed = 0.0, cpu = 0.0;
};

Seconds MedianOf(const std::vector<Seconds>& rounds) {
  std::vector<double> passed, cpu;
  for (const Seconds& s : rounds) {
    passed.push_back(s.passed);
    cpu.push_back(s.cpu);
  }
  return {Median(std::move(passed)), Median(std::move(cpu))};
}

// A folder with the recording, for both.
class Recording {
 public:
  explicit Recording(const TrackedArm& arm)
      : folder_(std::filesystem::temp_directory_path() /
                ("sysid_arm_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
    std::ofstream csv(folder_ / "run.csv"), txt(folder_ / "run.txt");
    csv << std::setprecision(12) << 't';
    txt << std::setprecision(12);
    const Run& run = arm.run;
    for (const Channel& c : run.channels) csv << ',' << c.name << ".q";
    for (const Channel& c : run.channels) csv << ',' << c.name << ".tau";
    csv << '\n';
    for (int k = 0; k < run.size(); ++k) {
      csv << run.t[k];
      txt << run.t[k];
      const auto put = [&](double value) {
        csv << ',' << value;
        txt << ' ' << value;
      };
      for (const Channel& c : run.channels) put(c.values(k, 0));
      for (int v = 0; v < run.effort.cols(); ++v) put(run.effort(k, v));
      csv << '\n';
      txt << '\n';
    }
  }
  ~Recording() { std::filesystem::remove_all(folder_); }

  std::string Csv() const { return folder_ / "run.csv"; }

  // Theirs; nothing where there is no SciPy.
  Seconds Reference(const Model& model, double cut_off, int every) const {
    Json json;
    const MechanismParameters<double>& values = model.nominal();
    json["gravity"] = values.gravity;
    json["cut_off"] = cut_off;
    json["every"] = every;
    for (size_t i = 0; i < model.mechanism().joints.size(); ++i) {
      const Joint& joint = model.mechanism().joints[i];
      if (joint.type == JointType::kFixed) continue;
      Json R = Json::array();
      for (int row = 0; row < 3; ++row) {
        R.push_back(
            {joint.R_PJ(row, 0), joint.R_PJ(row, 1), joint.R_PJ(row, 2)});
      }
      const Eigen::Vector3d& p = values.joint_p[i];
      json["joints"].push_back(
          {{"R", R},
           {"p", {p[0], p[1], p[2]}},
           {"axis", {joint.axis[0], joint.axis[1], joint.axis[2]}}});
    }
    std::ofstream(folder_ / "arm.json") << json;
    const Json said = RunReference(std::string(SYSID_NUMPY_REFERENCE) + " " +
                                   folder_.string());
    if (said.is_null()) return {};
    return {said["seconds"], said["cpu"]};
  }

 private:
  const std::filesystem::path folder_;
};

// Reading and fitting. `every`: of the reference, samples; 0: as many times as
// the estimator takes.
void BesideNumPy(benchmark::State& state, double cut_off, int every) {
  const TrackedArmOptions options;
  const TrackedArm arm = MakeTrackedArm(options);
  const Recording recording(arm);
  EstimationOptions by_all;
  by_all.threads = static_cast<int>(std::thread::hardware_concurrency());
  std::vector<Seconds> ours, theirs;
  size_t base = 0;
  for (auto _ : state) {
    for (int round = 0; round < kRounds; ++round) {
      const double began = Now(), began_cpu = Cpu();
      std::vector<std::string> notices;
      const Run run =
          ReadRun(recording.Csv(), {}, arm.start.mechanism(), &notices);
      const ShootingProblem problem(arm.start, arm.free, {run}, by_all);
      const Fit fit = FitInverseDynamics(problem);
      ours.push_back({Now() - began, Cpu() - began_cpu});
      base = fit.base.size();
      if (every == 0) {
        const double width =
            ChooseFilter(problem.model(), fit.model.nominal(), {&run},
                         FirstFilter({&run}), problem.options().threads)
                .average;
        cut_off = CutOff(width);
        every = std::max(1, static_cast<int>(width * options.rate));
      }
      theirs.push_back(recording.Reference(arm.truth, cut_off, every));
    }
    state.SetIterationTime(MedianOf(ours).passed);
  }
  state.counters["free"] = static_cast<double>(arm.free.size());
  state.counters["base"] = static_cast<double>(base);
  const Seconds our = MedianOf(ours), their = MedianOf(theirs);
  if (their.passed > 0.0) {
    state.counters["reference"] = 1e3 * their.passed;
    state.counters["ratio"] = their.passed / our.passed;
    state.counters["cpu_ratio"] = their.cpu / our.cpu;
  }
}

// --- Growth -----------------------------------------------------------------

struct Growth {
  double ms = 0.0, iteration_ms = 0.0, base = 0.0;
};
// By joints, and by free parameters.
std::map<int, Growth>& ByJoints() {
  static auto& measured = *new std::map<int, Growth>;
  return measured;
}
std::map<int, Growth>& ByFree() {
  static auto& measured = *new std::map<int, Growth>;
  return measured;
}

// Of an arm's parameters the `count` that belong to its last joints and links;
// the others stay at the truth.
std::vector<FreeParameter> LastOf(const TrackedArm& arm, int joints,
                                  int count) {
  std::vector<std::string> order;
  for (int i = joints - 1; i >= 0; --i) {
    for (const Value& value : DriveValues(i, 0.0)) order.push_back(value.name);
    for (const std::string& name : TenOfALink()) {
      order.push_back(LinkName(i) + "." + name);
    }
  }
  order.resize(count);
  std::vector<FreeParameter> free;
  for (const FreeParameter& f : arm.free) {
    if (std::find(order.begin(), order.end(), f.parameter.name) !=
        order.end()) {
      free.push_back(f);
    }
  }
  return free;
}

Growth Measure(int joints, int count) {
  TrackedArmOptions options;
  options.joints = joints;
  const TrackedArm arm = MakeTrackedArm(options);
  const ShootingProblem problem(arm.truth, LastOf(arm, joints, count),
                                {arm.run}, {});
  Growth growth;
  std::vector<double> times;
  Eigen::VectorXd theta = problem.InitialTheta();
  for (int round = 0; round < kRounds; ++round) {
    const double began = Cpu();
    const Fit fit = FitInverseDynamics(problem);
    times.push_back(1e3 * (Cpu() - began));
    growth.base = static_cast<double>(fit.base.size());
    theta = fit.point.theta;
  }
  growth.ms = *std::min_element(times.begin(), times.end());
  Solution point =
      CutPoint(problem, theta, AllStatesFromData(problem), kSegment);
  if (!(point.rollout.step > 0.0)) point.rollout.step = 1.0 / options.rate;
  ShootingStage::Options stage_options;
  stage_options.max_iterations = kIterations;
  stage_options.function_tolerance = 0.0;
  const double began = Cpu();
  std::vector<HistoryEntry> history;
  ShootingStage stage(problem, stage_options, &point);
  const int linearised = stage.Solve("growth", Now(), &history).iterations + 1;
  growth.iteration_ms = 1e3 * (Cpu() - began) / linearised;
  return growth;
}

void Say(const Growth& growth, int count, benchmark::State& state) {
  state.SetIterationTime(1e-3 * growth.ms);
  state.counters["free"] = count;
  state.counters["base"] = growth.base;
  state.counters["iteration"] = growth.iteration_ms;
}

constexpr int kEachJoint = 13;  // parameters

void GrowJoints(benchmark::State& state) {
  const int joints = static_cast<int>(state.range(0));
  for (auto _ : state) {
    const Growth growth = Measure(joints, kEachJoint * joints);
    ByJoints()[joints] = growth;
    Say(growth, kEachJoint * joints, state);
  }
}

void GrowFree(benchmark::State& state) {
  const int count = static_cast<int>(state.range(0));
  for (auto _ : state) {
    const Growth growth = Measure(7, count);
    ByFree()[count] = growth;
    Say(growth, count, state);
  }
}

std::string Plot() {
  std::vector<SvgPanel> panels;
  const auto panel = [&](double x, const std::string& label,
                         const std::map<int, Growth>& measured) {
    std::vector<double> at, ms, iteration;
    double most = 0.0;
    for (const auto& [count, growth] : measured) {
      at.push_back(count);
      ms.push_back(growth.ms);
      iteration.push_back(growth.iteration_ms);
      most = std::max({most, growth.ms, growth.iteration_ms});
    }
    if (at.empty()) return;
    SvgPanel drawn({x, 60, 280, 200}, AxisOver(label, at),
                   PlotAxis{"", 0.0, 1.1 * most}, "ms of CPU");
    for (const auto& [values, colour] :
         {std::pair{ms, "#1f6f8b"}, std::pair{iteration, "#b5523b"}}) {
      drawn.Line(at, values, colour);
      for (size_t i = 0; i < at.size(); ++i) {
        drawn.Marker(at[i], values[i], colour);
      }
    }
    panels.push_back(drawn);
  };
  panel(60, "joints, all parameters free", ByJoints());
  panel(410, "free parameters of seven joints", ByFree());
  return SvgFigure(720, 340, "Growth with joints and free parameters", panels,
                   {{"a fit by inverse dynamics", "#1f6f8b", ""},
                    {"an iteration of Levenberg-Marquardt", "#b5523b", ""}});
}

void Register() {
  const auto once = [](benchmark::internal::Benchmark* added) {
    return added->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
  };
  // 40 Hz and every 8 ms: as people choose them.
  once(benchmark::RegisterBenchmark(
      "numpy/every_8_ms",
      [](benchmark::State& state) { BesideNumPy(state, 40.0, 4); }));
  once(benchmark::RegisterBenchmark(
      "numpy/as_many_times",
      [](benchmark::State& state) { BesideNumPy(state, 0.0, 0); }));
  once(benchmark::RegisterBenchmark("joints", GrowJoints))->DenseRange(1, 7);
  auto* free = once(benchmark::RegisterBenchmark("free", GrowFree));
  for (const int count : {3, 13, 26, 39, 52, 65, 78, 91}) free->Arg(count);
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
  sysid::Register();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  if (!plot.empty()) std::ofstream(plot) << sysid::Plot();
  return 0;
}
