#include <benchmark/benchmark.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "glog/logging.h"
#include "models/hold_joints.h"
#include "models/state.h"
#include "sysid/estimation/initial_states.h"
#include "sysid/estimation/shooting_stage.h"
#include "tests/benchmarks/reference.h"
#include "tests/support/fit_setup.h"
#include "tests/support/mjcf.h"

// What whole fits cost, beside SciPy's least squares over MuJoCo with finite
// differences through as many rollouts (scipy_reference.py), on two threads
// beside one, and of a robot most of whose joints are locked. Seconds differ
// between machines and minutes, ratios hardly do.
//
// The fit is that of three lengths of pendulum3 to 10 s at 100 Hz, headings
// with noise 1e-3, Runge-Kutta of fourth order with two sub-steps a sample.
//
// Counters:
//   reference  ms of CPU that SciPy and MuJoCo take for the same fit
//   ratio      that over ours: how many times faster
//   apart      how far the two estimates are apart at most, in standard errors
//   error      of the lengths at most, in standard errors
//   their_error  the same of the reference

namespace sysid {
namespace {

using Json = nlohmann::json;

constexpr double kDuration = 10.0;  // s
constexpr double kRate = 100.0;     // Hz
constexpr double kStep = 0.005;     // s
constexpr double kNoise = 1e-3;
constexpr double kTilt = 0.3;  // rad
constexpr int kSegments = 20;
constexpr double kLength = 0.5;  // m, of each link in truth
constexpr int kLinks = 3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// CPU of the process: other processes may want its core.
double Cpu() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Run Swing(double duration, int seed) {
  const Model model = Shipped("pendulum3");
  SimulationOptions options;
  options.duration = duration;
  options.rate = kRate;
  options.noise = kNoise;
  options.seed = seed;
  options.step = kStep;
  return Simulate(model, RandomState(model, kTilt, seed), options);
}

std::vector<FreeParameter> Lengths(const Model& model, double factor) {
  std::vector<Value> start;
  for (int link = 1; link <= kLinks; ++link) {
    start.push_back(
        {"link" + std::to_string(link) + ".length", factor * kLength});
  }
  return FreeFrom(model, start);
}

// The lengths of one swing from `factor` times the truth: in one segment whose
// start is known (`defect` 0), or in twenty whose states are estimated, joined
// by `defect` (ShootingStage::Options).
struct Task {
  std::unique_ptr<ShootingProblem> problem;
  Solution point;
  ShootingStage::Options options;
  double factor;

  Task(double off, double defect) : factor(off) {
    const bool single = defect == 0.0;
    const Model model = Shipped("pendulum3");
    EstimationOptions estimation;
    estimation.noise = kNoise;
    estimation.rollout.step = kStep;
    problem = std::make_unique<ShootingProblem>(
        model, Lengths(model, off), std::vector<Run>{Swing(kDuration, 1)},
        estimation);
    const int samples = problem->runs().front()->run.size() - 1;
    point.theta = problem->InitialTheta();
    Solution::Nodes nodes;
    if (single) {
      nodes.samples = {0, samples};
      nodes.states = RandomState(model, kTilt, 1).transpose();
    } else {
      const RowMatrixXd states = StatesFromData(*problem, 0);
      nodes.states.resize(kSegments, states.cols());
      for (int k = 0; k <= kSegments; ++k) {
        nodes.samples.push_back(samples * k / kSegments);
        if (k < kSegments) nodes.states.row(k) = states.row(nodes.samples[k]);
      }
    }
    point.runs = {nodes};
    options.fix_states = single;
    options.defect = single ? kInfinity : defect;
    options.function_tolerance = 1e-6;
  }

  StageSummary Solve(Solution* at) const {
    *at = point;
    std::vector<HistoryEntry> history;
    ShootingStage stage(*problem, options, at);
    return stage.Solve("fit", Now(), &history);
  }
};

#ifdef SYSID_MUJOCO_ROLLOUT
// The same task, by SciPy and MuJoCo.
class Reference {
 public:
  explicit Reference(const Task& task)
      : folder_(std::filesystem::temp_directory_path() /
                ("sysid_benchmark_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
    Write(task);
  }
  ~Reference() { std::filesystem::remove_all(folder_); }

  // Null where there is no SciPy.
  Json Solve() const {
    return RunReference(std::string(SYSID_SCIPY_REFERENCE) + " " +
                        SYSID_MUJOCO_ROLLOUT + " " + folder_.string());
  }

 private:
  void Write(const Task& task) const {
    const Model& model = task.problem->model();
    const RunData& data = *task.problem->runs().front();
    const Solution::Nodes& nodes = task.point.runs.front();
    std::ofstream(folder_ / "model.xml") << ToMjcf(model.mechanism(), {});
    Json json;
    json["samples"] = nodes.samples[1];
    json["steps"] = static_cast<int>(std::lround(1.0 / kRate / kStep));
    json["h"] = kStep;
    json["sigma"] = kNoise;
    json["start"] = std::vector<double>(kLinks, task.factor);
    const Eigen::Vector3d axis = LinkAxis(model.mechanism(), 1);
    json["axis"] = std::vector<double>(axis.begin(), axis.end());
    json["method"] = task.options.fix_states ? "lm" : "trf";
    if (!task.options.fix_states) {
      std::vector<double> sigma = DefectSigma(*task.problem);
      for (double& s : sigma) s *= task.options.defect;
      json["sigma_defect"] = sigma;
      json["sigma_prior"] = StateBelief(*task.problem, 1.0);
    }
    std::ofstream(folder_ / "problem.json") << json;
    std::ofstream states(folder_ / "nodes.txt");
    states.precision(17);
    for (int k = 0; k < nodes.segments(); ++k) {
      for (int j = 0; j < kLinks; ++j) {
        for (const int i : {3, 0, 1, 2}) {  // w first
          states << nodes.states(k, 4 * j + i) << " ";
        }
      }
      for (int i = model.nq(); i < model.state_size(); ++i) {
        states << nodes.states(k, i) << " ";
      }
      states << "\n";
    }
    std::ofstream measured(folder_ / "measured.txt");
    measured.precision(17);
    for (int k = 0; k < data.run.size(); ++k) {
      for (const Channel& channel : data.run.channels) {
        const Eigen::Quaterniond q(channel.values(k, 3), channel.values(k, 0),
                                   channel.values(k, 1), channel.values(k, 2));
        measured << (ToMatrix(q) * axis).transpose() << " ";
      }
      measured << "\n";
    }
  }

  std::filesystem::path folder_;
};
#endif

// Standard errors of the lengths, about: what the rest of the numbers are
// measured in.
Eigen::VectorXd StandardErrors() {
  const Model model = Shipped("pendulum3");
  EstimationOptions options;
  options.noise = kNoise;
  options.rollout.step = kStep;
  const Fit fit =
      FitRuns(model, Lengths(model, 1.0), {Swing(kDuration, 1)}, options);
  Eigen::VectorXd errors(kLinks);
  for (int i = 0; i < kLinks; ++i) errors[i] = fit.parameters[i].std_error;
  return errors;
}

void FitBesideScipy(benchmark::State& state, double factor, double defect) {
  const Task task(factor, defect);
  const Eigen::VectorXd sigma = StandardErrors();
  Solution point;
  StageSummary done;
  const double start = Cpu();
  for (auto _ : state) done = task.Solve(&point);
  const double own = (Cpu() - start) / static_cast<double>(state.iterations());
  if (!done.converged) state.SetLabel("not converged");
  const Eigen::ArrayXd error =
      (point.theta.array() - kLength).abs() / sigma.array();
  state.counters["lm_iterations"] = done.iterations;
  state.counters["error"] = error.maxCoeff();
#ifdef SYSID_MUJOCO_ROLLOUT
  const Json theirs = Reference(task).Solve();
  if (theirs.is_null()) {
    state.SetLabel("the reference failed");
    return;
  }
  double apart = 0.0, their_error = 0.0;
  for (int i = 0; i < kLinks; ++i) {
    const double length = kLength * theirs["scales"][i].get<double>();
    apart = std::max(apart, std::abs(length - point.theta[i]) / sigma[i]);
    their_error = std::max(their_error, std::abs(length - kLength) / sigma[i]);
  }
  const double seconds = theirs["seconds"];
  state.counters["apart"] = apart;
  state.counters["their_error"] = their_error;
  state.counters["their_rollouts"] = theirs["rolled"].get<double>();
  state.counters["reference"] = 1e3 * seconds;
  state.counters["ratio"] = seconds / own;
#else
  benchmark::DoNotOptimize(own);
#endif
}

// --- Threads ----------------------------------------------------------------

// Eight runs of 10 s. Counters: `alone`, ms of wall time on one thread, and
// `speedup`, that over the line's.
void FitOnThreads(benchmark::State& state, int threads) {
  const Model model = Shipped("pendulum3");
  std::vector<Run> runs;
  for (int seed = 1; seed <= 8; ++seed) runs.push_back(Swing(kDuration, seed));
  EstimationOptions options;
  options.noise = kNoise;
  const auto seconds = [&](int count) {
    options.threads = count;
    const double start = Now();
    const Fit fit = FitRuns(model, Lengths(model, 1.1), runs, options);
    CHECK(fit.converged);
    return Now() - start;
  };
  double alone = seconds(1), together = 0.0;
  for (auto _ : state) together += seconds(threads);
  alone = 0.5 * (alone + seconds(1));
  together /= static_cast<double>(state.iterations());
  state.counters["alone"] = 1e3 * alone;
  state.counters["speedup"] = alone / together;
}

// --- Locked joints -----------------------------------------------------------

// A URDF of `joints` links one behind the other, from the link "base".
std::string Chain(const std::string& name, int joints) {
  std::string text, parent = "base";
  for (int i = 1; i <= joints; ++i) {
    const std::string id = name + std::to_string(i);
    text += "<joint name='" + id + "_joint' type='continuous'><parent link='" +
            parent + "'/><child link='" + id + "'/><origin xyz='0 0 0.2'/>" +
            "<axis xyz='" + (i % 2 == 0 ? "0 0 1" : "0 1 0") +
            "'/></joint><link name='" + id +
            "'><inertial><origin xyz='0.02 0.01 0.1'/><mass value='1'/>"
            "<inertia ixx='0.01' iyy='0.01' izz='0.005' ixy='0' ixz='0' "
            "iyz='0'/></inertial></link>";
    parent = id;
  }
  return text;
}

// A robot of 30 joints of which an arm of eight is recorded and the others are
// locked, beside the same arm cut out by hand: damped, driven for 5 s, one
// thread. Counters: `cut_out`, ms of CPU that its fit takes, and
// `over_cut_out`, the line's over that.
void FitOfLockedRobot(benchmark::State& state) {
  const std::string arm =
      "<robot name='r'><link name='base'/>" + Chain("arm", 8);
  const Mechanism cut_out = LoadUrdfText(arm + "</robot>", "arm");
  const Mechanism whole = LoadUrdfText(
      arm + Chain("leg", 11) + Chain("other", 11) + "</robot>", "robot");
  std::map<int, double> held;
  for (size_t j = 0; j < whole.joints.size(); ++j) {
    if (!whole.joints[j].name.starts_with("arm")) held[j] = 0.0;
  }
  CHECK_EQ(held.size(), 22u);
  const Mechanism locked = HoldJoints(whole, held);
  const auto fit_seconds = [](const Mechanism& mechanism) {
    const Catalogue catalogue;
    Model model = MakeModel(mechanism, catalogue);
    for (int i = 1; i <= 8; ++i) {
      const std::string joint = "arm" + std::to_string(i) + "_joint";
      model.AddEffect(
          catalogue.Make("viscous_damping@" + joint, mechanism, "benchmark"));
      Set({{joint + ".damping", 1.0}}, &model);
    }
    SimulationOptions simulation;
    simulation.duration = 5.0;
    simulation.rate = kRate;
    simulation.noise = kNoise;
    simulation.excitation = Excitation::kMultisine;
    EstimationOptions options;
    options.threads = 1;
    const Run run = Simulate(model, RandomState(model, kTilt, 1), simulation);
    const double start = Cpu();
    const Fit fit = FitRuns(
        model, FreeFrom(model, {{"arm3.mass", 1.2}, {"arm6.mass", 0.8}}), {run},
        options);
    CHECK(fit.converged);
    return Cpu() - start;
  };
  double alone = fit_seconds(cut_out), own = 0.0;
  for (auto _ : state) own += fit_seconds(locked);
  alone = 0.5 * (alone + fit_seconds(cut_out));
  own /= static_cast<double>(state.iterations());
  state.counters["cut_out"] = 1e3 * alone;
  state.counters["over_cut_out"] = own / alone;
}

// --- The table --------------------------------------------------------------

void Register() {
  // So often a repetition, with the reference once.
  const auto add = [](const std::string& name, int times, auto... arguments) {
    return benchmark::RegisterBenchmark(name.c_str(), arguments...)
        ->Unit(benchmark::kMillisecond)
        ->Iterations(times);
  };
  add("single_shooting/5%_off", 10, FitBesideScipy, 1.05, 0.0);
  add("single_shooting/20%_off", 5, FitBesideScipy, 1.2, 0.0);
  add("multiple_shooting/10%_off", 5, FitBesideScipy, 1.1, kMiddleDefect);
  add("multiple_shooting/20%_off", 5, FitBesideScipy, 1.2, kMiddleDefect);
  add("multiple_shooting_tight/10%_off", 5, FitBesideScipy, 1.1, kCloseDefect);
  add("multiple_shooting_tight/20%_off", 5, FitBesideScipy, 1.2, kCloseDefect);
  add("threads/2", 1, FitOnThreads, 2)->UseRealTime();
  add("locked/22_of_30", 2, FitOfLockedRobot);
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  sysid::Register();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
