#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "glog/logging.h"
#include "models/stepper.h"
#include "tests/benchmarks/engine.h"
#include "tests/support/fit_setup.h"

// What the physics cost, from one evaluation of the dynamics to a whole fit,
// in units of MuJoCo's mj_forward (contacts off) measured around each of them:
// seconds differ between machines and minutes, this ratio hardly does.
// scripts/benchmark prints the table.
//
// Counters:
//   evaluations  of the forward dynamics that the line contains; 0 where it is
//                not fixed (a fit)
//   mj_forward   ns that MuJoCo takes for one, beside this line: the newest
//   that
//                is there, whose version is in the context of the results
//   ratio        time per evaluation over mj_forward
//   debian       ns that Debian's MuJoCo takes, where a newer one is there
//   over_plain   time over that of the same rollout without derivatives

namespace sysid {
namespace {

constexpr double kDuration = 10.0;  // s
// An arm that falls freely whirls after some seconds; whether steps of 10 ms
// follow it then hangs on a processor's last bits.
constexpr double kFall = 1.0;     // s
constexpr double kRate = 100.0;   // Hz
constexpr double kSegment = 0.5;  // s
constexpr double kNoise = 1e-3;
constexpr double kOff = 1.2;  // lengths and masses of the start over the truth
constexpr int kSeed = 1;
constexpr int kStages = 4;  // evaluations of a Runge-Kutta step

struct State {
  Eigen::VectorXd x, tau;  // x: nq + nv
};

// In motion, with efforts: nothing is accidentally zero.
State Moving(const Model& model) {
  State state{RandomState(model, 0.6, kSeed), Eigen::VectorXd(model.nv())};
  for (int i = 0; i < model.nv(); ++i) {
    state.x[model.nq() + i] = 0.5 + 0.1 * i;
    state.tau[i] = 0.02 * (i + 1);
  }
  return state;
}

// Of the process: everything here runs on one thread, and other processes may
// want its core.
double NanosecondsSince(std::clock_t start) {
  return 1e9 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// mj_forward at the moving state of a model.
class Reference {
 public:
  Reference(const Model& model, const char* module)
      : engine_(LoadEngine(module, model.mechanism())),
        nq_(model.nq()),
        state_(Moving(model)),
        qdd_(model.nv()) {}
  void Forward() {
    engine_->ForwardDynamics(state_.x.data(), state_.x.data() + nq_,
                             state_.tau.data(), qdd_.data());
  }
  // Nanoseconds, the mean over some milliseconds.
  double Measure() {
    constexpr int kTimes = 4000;
    const std::clock_t start = std::clock();
    for (int i = 0; i < kTimes; ++i) Forward();
    return NanosecondsSince(start) / kTimes;
  }
  std::string Version() const { return engine_->Version(); }

 private:
  std::unique_ptr<Engine> engine_;
  int nq_;
  State state_;
  Eigen::VectorXd qdd_;
};

// The MuJoCos that are there, the newest first: what the counters call it.
struct Module {
  const char *counter, *path;
};
const std::vector<Module>& Modules() {
  static const auto& modules = *new std::vector<Module>{
#ifdef SYSID_MUJOCO_ENGINE
      {"mj_forward", SYSID_MUJOCO_ENGINE},
#endif
#ifdef SYSID_DEBIAN_MUJOCO_ENGINE
      {"debian", SYSID_DEBIAN_MUJOCO_ENGINE},
#endif
  };
  return modules;
}

// Runs `work` as often as the benchmark asks for, with the references before
// and after.
template <class Work>
void MeasureBeside(benchmark::State& state, const Model& model, int evaluations,
                   Work work) {
  std::vector<Reference> references;
  for (const Module& module : Modules()) {
    references.emplace_back(model, module.path).Measure();  // warm
  }
  std::vector<double> beside;
  for (Reference& reference : references) {
    beside.push_back(0.5 * reference.Measure());
  }
  const std::clock_t start = std::clock();
  for (auto _ : state) work();
  const double own = NanosecondsSince(start) / state.iterations();
  for (size_t i = 0; i < references.size(); ++i) {
    beside[i] += 0.5 * references[i].Measure();
    state.counters[Modules()[i].counter] = beside[i];
  }
  state.counters["evaluations"] = evaluations;
  if (!beside.empty()) {
    state.counters["ratio"] = own / std::max(evaluations, 1) / beside[0];
  }
}

// --- One evaluation ---------------------------------------------------------

// A number that carries derivatives where T has them.
template <typename T>
T Seeded(double value, int column) {
  if constexpr (std::is_same_v<T, double>) {
    return value;
  } else {
    return T(value, column % T::DIMENSION);
  }
}

template <typename T>
void ForwardDynamicsOf(benchmark::State& state, const std::string& name) {
  const Model model = Shipped(name);
  const State moving = Moving(model);
  std::vector<T> x, tau, qdd(model.nv());
  for (int i = 0; i < moving.x.size(); ++i) {
    x.push_back(Seeded<T>(moving.x[i], i));
  }
  for (int i = 0; i < model.nv(); ++i) {
    tau.push_back(Seeded<T>(moving.tau[i], i));
  }
  Workspace<T> ws(model);
  MeasureBeside(state, model, 1, [&] {
    CHECK(ForwardDynamics<T>(&ws, x.data(), x.data() + model.nq(), tau.data(),
                             qdd.data()));
    benchmark::ClobberMemory();
  });
}

// --- Rollouts ---------------------------------------------------------------

void Rollout(benchmark::State& state, const std::string& name) {
  const Model model = Shipped(name);
  const Eigen::VectorXd x0 = RandomState(model, 0.3, kSeed);
  const std::vector<double> tau(model.nv(), 0.0);
  Workspace<double> ws(model);
  Stepper<double> stepper(Integrator::kRungeKutta4, &ws);
  const int steps = static_cast<int>(kFall * kRate);
  MeasureBeside(state, model, kStages * steps, [&] {
    Eigen::VectorXd x = x0;
    for (int k = 0; k < steps; ++k) {
      CHECK(stepper.Step(1.0 / kRate, tau.data(), x.data()));
    }
    benchmark::DoNotOptimize(x.data());
  });
}

// Twenty-four columns of a rollout of half a second, by the state and by the
// first parameters of the model, over the rollout without them: the counter
// `over_plain`. Nothing is measured.
void Columns24(benchmark::State& state, const std::string& name,
               LinearizationPath path) {
  constexpr int kColumns = 24;
  const Model model = Shipped(name);
  std::vector<Parameter> parameters = AllParameters(model);
  parameters.resize(kColumns - model.tangent_size());
  const ParameterMap map(model, parameters, false);
  std::vector<double> theta;
  for (const Parameter& parameter : parameters) {
    theta.push_back(parameter.nominal);
  }
  const int samples = static_cast<int>(kSegment * kRate);
  Run run;
  for (int k = 0; k <= samples; ++k) run.t.push_back(k / kRate);
  run.effort.setZero(samples + 1, model.nv());
  const Measurements measurements{&run, {}};
  RolloutOptions options;
  options.linearization = path;
  const SegmentRollout segment(&model, &map, &measurements, 0, samples,
                               options);
  const Eigen::VectorXd x0 = RandomState(model, 0.3, kSeed);
  Eigen::VectorXd x_end(model.state_size());
  double* no_errors = nullptr;
  RowMatrixXd J, J_end;
  const auto plain = [&] {
    constexpr int kTimes = 40;
    const std::clock_t start = std::clock();
    for (int i = 0; i < kTimes; ++i) {
      CHECK(segment(x0.data(), theta.data(), no_errors, x_end.data()));
    }
    return NanosecondsSince(start) / kTimes;
  };
  plain();  // warm
  double one = 0.5 * plain();
  const std::clock_t start = std::clock();
  for (auto _ : state) {
    CHECK(segment.Linearize(x0.data(), theta.data(), true, no_errors,
                            x_end.data(), &J, &J_end));
    benchmark::ClobberMemory();
  }
  const double own = NanosecondsSince(start) / state.iterations();
  one += 0.5 * plain();
  CHECK_EQ(J_end.cols(), kColumns);
  state.counters["over_plain"] = own / one;
}

void Columns24Jets(benchmark::State& state, const std::string& name) {
  Columns24(state, name, LinearizationPath::kJets);
}

void Columns24Structured(benchmark::State& state, const std::string& name) {
  Columns24(state, name, LinearizationPath::kStructured);
}

// What is fitted: the lengths of a pendulum, two masses of the arm.
std::vector<Value> Truth(const std::string& name) {
  if (name != "arm7") {
    return {
        {"link1.length", 0.5}, {"link2.length", 0.5}, {"link3.length", 0.5}};
  }
  const Mechanism mechanism = LoadUrdf(FindModel(name));
  std::vector<Value> masses;
  for (const int link : {4, 7}) {
    masses.push_back(
        {"link" + std::to_string(link) + ".mass",
         mechanism.nominal
             .links[mechanism.FindLink("link" + std::to_string(link))]
             .mass});
  }
  return masses;
}

std::vector<Value> Start(const std::string& name) {
  std::vector<Value> start = Truth(name);
  for (Value& value : start) value.value *= kOff;
  return start;
}

// A pendulum as it is shipped. The arm's joints are damped, as a real arm's
// are; without it the wrist spins chaotically.
Model Machine(const std::string& name, const std::vector<Value>& values = {}) {
  if (name != "arm7") return Shipped(name, {}, values);
  std::vector<std::string> effects;
  std::vector<Value> all = values;
  for (int joint = 1; joint <= 7; ++joint) {
    const std::string joint_name = "joint" + std::to_string(joint);
    effects.push_back("viscous_damping@" + joint_name);
    all.push_back({joint_name + ".damping", joint <= 4 ? 0.5 : 0.01});
  }
  return Shipped(name, effects, all);
}

// A swing of a pendulum; the arm moves under efforts, or its masses would not
// show.
Run Recorded(const std::string& name) {
  const Model model = Machine(name, Truth(name));
  SimulationOptions options;
  options.duration = kDuration;
  options.rate = kRate;
  options.noise = kNoise;
  options.seed = kSeed;
  if (name == "arm7") options.excitation = Excitation::kMultisine;
  return Simulate(model, RandomState(model, 0.3, kSeed), options);
}

void LinearizeSegment(benchmark::State& state, const std::string& name) {
  const Model model = Machine(name);
  EstimationOptions options;
  options.noise = kNoise;
  const ShootingProblem problem(model, FreeFrom(model, Start(name)),
                                {Recorded(name)}, options);
  const RunData& data = *problem.runs().front();
  const int samples = static_cast<int>(kSegment * kRate);
  const SegmentRollout segment(&problem.model(), &problem.map(),
                               &data.measurements, 0, samples, {});
  const Eigen::VectorXd x0 = FirstState(model, data.run);
  const Eigen::VectorXd theta = problem.InitialTheta();
  Eigen::VectorXd errors(segment.num_residuals()), x_end(model.state_size());
  RowMatrixXd J, J_end;
  MeasureBeside(state, model, kStages * samples, [&] {
    CHECK(segment.Linearize(x0.data(), theta.data(), true, errors.data(),
                            x_end.data(), &J, &J_end));
    benchmark::ClobberMemory();
  });
  state.counters["columns"] = static_cast<double>(J.cols());
}

// --- A whole fit ------------------------------------------------------------

void WholeFit(benchmark::State& state, const std::string& name) {
  const Model model = Machine(name);
  const Run run = Recorded(name);
  const std::vector<FreeParameter> free = FreeFrom(model, Start(name));
  EstimationOptions options;
  options.threads = 1;
  options.max_iterations = 60;
  int iterations = 0;
  MeasureBeside(state, model, 0, [&] {
    const Fit fit = FitRuns(model, free, {run}, options);
    if (!fit.converged) state.SetLabel("not converged");
    iterations = fit.iterations;
  });
  state.counters["iterations"] = iterations;
}

// --- The table --------------------------------------------------------------

void Register() {
  for (const std::string name : {"pendulum3", "pendulum3_planar", "arm7"}) {
    const auto add = [&](const std::string& what, auto function) {
      return benchmark::RegisterBenchmark((name + "/" + what).c_str(), function,
                                          name);
    };
    add("ForwardDynamics<double>", ForwardDynamicsOf<double>);
    add("ForwardDynamics<Jet8>", ForwardDynamicsOf<Jet8>);
    add("ForwardDynamics<Jet16>", ForwardDynamicsOf<Jet16>);
    add("ForwardDynamics<Jet24>", ForwardDynamicsOf<Jet24>);
    add("Rollout10s", Rollout)->Unit(benchmark::kMicrosecond);
    add("Columns24Jets", Columns24Jets)->Unit(benchmark::kMicrosecond);
    add("Columns24Structured", Columns24Structured)
        ->Unit(benchmark::kMicrosecond);
    add("Linearize0.5s", LinearizeSegment)->Unit(benchmark::kMicrosecond);
    add("Fit10s", WholeFit)->Unit(benchmark::kMillisecond);
  }
}

// Of repetitions only the median.
class MedianReporter : public benchmark::ConsoleReporter {
 public:
  MedianReporter() : ConsoleReporter(OO_Tabular) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    std::vector<Run> kept;
    for (const Run& run : runs) {
      const bool aggregate = run.run_type == Run::RT_Aggregate;
      if (run.error_occurred || run.repetitions <= 1 ||
          (aggregate && run.aggregate_name == "median")) {
        kept.push_back(run);
      }
    }
    if (!kept.empty()) ConsoleReporter::ReportRuns(kept);
  }
};

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  for (const sysid::Module& module : sysid::Modules()) {
    benchmark::AddCustomContext(
        module.counter,
        sysid::Reference(sysid::Shipped("arm7"), module.path).Version());
  }
  sysid::Register();
  sysid::MedianReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();
  return 0;
}
