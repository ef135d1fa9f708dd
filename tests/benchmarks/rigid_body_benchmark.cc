#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "glog/logging.h"
#include "models/dynamics_tangent.h"
#include "models/inertial_columns.h"
#include "tests/benchmarks/engine.h"
#include "tests/support/fit_setup.h"

// One evaluation each of what the dynamics of rigid bodies have, beside
// Pinocchio as `pip install pin` brings it, called from C++ (without Pinocchio:
// alone). That both say the same is checked first.
//
// Counters:
//   pinocchio   ns that it takes, measured before and after
//   ratio       that over ours: how many times faster

namespace sysid {
namespace {

constexpr double kTolerance = 1e-9;  // of results, relative
constexpr double kTilt = 0.6;        // rad
constexpr int kSeed = 1;

// Everything here runs on one thread, and other processes may want its core.
double NanosecondsSince(std::clock_t start) {
  return 1e9 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// In motion, with efforts: nothing is accidentally zero.
struct Point {
  const Model model;
  Eigen::VectorXd q, qd, qdd, tau;

  explicit Point(const std::string& name)
      : model(Shipped(name)), qd(model.nv()), qdd(model.nv()), tau(model.nv()) {
    q = RandomState(model, kTilt, kSeed).head(model.nq());
    for (int i = 0; i < model.nv(); ++i) {
      qd[i] = 0.5 + 0.1 * i;
      tau[i] = 0.02 * (i + 1);
      qdd[i] = 0.3 - 0.2 * i;
    }
  }
};

// One evaluation: ours, theirs, and where the results are.
class Task {
 public:
  explicit Task(const Point& point)
      : at_(point), ws_(point.model), nv_(point.model.nv()) {}
  virtual ~Task() = default;
  virtual void Own() = 0;
  virtual void Theirs(Engine* engine) = 0;
  double Apart() const {
    return (own_ - theirs_).norm() / std::max(1.0, theirs_.norm());
  }

 protected:
  void Size(int rows, int columns) {
    own_.setZero(rows, columns);
    theirs_.setZero(rows, columns);
  }

  const Point& at_;
  Workspace<double> ws_;
  const int nv_;
  RowMatrixXd own_, theirs_;
};

class Forward final : public Task {
 public:
  explicit Forward(const Point& point) : Task(point) { Size(nv_, 1); }
  void Own() override {
    CHECK(ForwardDynamics<double>(&ws_, at_.q.data(), at_.qd.data(),
                                  at_.tau.data(), own_.data()));
  }
  void Theirs(Engine* engine) override {
    engine->ForwardDynamics(at_.q.data(), at_.qd.data(), at_.tau.data(),
                            theirs_.data());
  }
};

class Inverse final : public Task {
 public:
  explicit Inverse(const Point& point) : Task(point) { Size(nv_, 1); }
  void Own() override {
    InverseDynamics<double>(&ws_, at_.q.data(), at_.qd.data(), at_.qdd.data(),
                            own_.data());
  }
  void Theirs(Engine* engine) override {
    engine->InverseDynamics(at_.q.data(), at_.qd.data(), at_.qdd.data(),
                            theirs_.data());
  }
};

class Mass final : public Task {
 public:
  explicit Mass(const Point& point) : Task(point), M_(nv_, nv_) {
    Size(nv_, nv_);
  }
  void Own() override {
    MassMatrix<double>(&ws_, at_.q.data(), &M_);
    own_ = M_;
  }
  void Theirs(Engine* engine) override {
    engine->MassMatrix(at_.q.data(), theirs_.data());
  }

 private:
  MatrixX<double> M_;
};

// All columns of the regressor, and their product with the parameters.
class Regressor final : public Task {
 public:
  explicit Regressor(const Point& point) : Task(point), tau_(nv_) {
    Size(nv_, 1);
    const Mechanism& mechanism = point.model.mechanism();
    for (const Joint& joint : mechanism.joints) {
      if (joint.type != JointType::kFixed) links_.push_back(joint.child_link);
    }
    const int n = static_cast<int>(links_.size());
    columns_.setZero(nv_, 10 * n);
    parameters_.setZero(10 * n);
    for (int i = 0; i < n; ++i) {
      const Inertial<double>& body = mechanism.nominal.links[links_[i]];
      const Eigen::Matrix3d I =
          body.inertia +
          body.mass * (body.com.squaredNorm() * Eigen::Matrix3d::Identity() -
                       body.com * body.com.transpose());
      parameters_.segment<10>(10 * i) << body.mass, body.mass * body.com,
          I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2);
    }
  }
  void Own() override {
    InverseDynamics<double>(&ws_, at_.q.data(), at_.qd.data(), at_.qdd.data(),
                            tau_.data());
    for (size_t i = 0; i < links_.size(); ++i) {
      InertialColumns(ws_, links_[i], columns_.middleCols<10>(10 * i));
    }
    own_.noalias() = columns_ * parameters_;
  }
  void Theirs(Engine* engine) override {
    engine->Regressor(at_.q.data(), at_.qd.data(), at_.qdd.data(),
                      theirs_.data());
  }

 private:
  std::vector<int> links_;
  RowMatrixXd columns_;
  Eigen::VectorXd parameters_, tau_;
};

// The accelerations and their derivatives by q, qd and tau.
class Derivatives final : public Task {
 public:
  explicit Derivatives(const Point& point)
      : Task(point),
        theta_(point.model),
        tangent_(point.model),
        qdd_(nv_),
        dq_(nv_),
        dqd_(nv_),
        dtau_(nv_),
        dqdd_(nv_) {
    Size(3 * nv_, nv_);  // one block below the other
  }
  void Own() override {
    CHECK(ForwardDynamics<double>(&ws_, at_.q.data(), at_.qd.data(),
                                  at_.tau.data(), qdd_.data()));
    tangent_.SetPoint(ws_, at_.q.data(), at_.qd.data(), qdd_.data());
    const int columns = 3 * nv_;
    for (int first = 0; first < columns; first += kLanes) {
      for (int i = 0; i < nv_; ++i) {
        dq_[i] = UnitLanes(i - first);
        dqd_[i] = UnitLanes(nv_ + i - first);
        dtau_[i] = UnitLanes(2 * nv_ + i - first);
      }
      const bool moves_tau = first + kLanes > 2 * nv_;
      tangent_.Columns(theta_,
                       {dq_.data(), dqd_.data(),
                        moves_tau ? dtau_.data() : nullptr, nullptr},
                       dqdd_.data());
      double lanes[kLanes];
      for (int i = 0; i < nv_; ++i) {
        StoreLanes(dqdd_[i], lanes);
        for (int k = 0; k < kLanes && first + k < columns; ++k) {
          const int column = first + k;
          own_(column / nv_ * nv_ + i, column % nv_) = lanes[k];
        }
      }
    }
  }
  void Theirs(Engine* engine) override {
    double* by_q = theirs_.data();
    const int block = nv_ * nv_;
    engine->Derivatives(at_.q.data(), at_.qd.data(), at_.tau.data(), by_q,
                        by_q + block, by_q + 2 * block);
  }

 private:
  ParameterColumns theta_;
  DynamicsTangent tangent_;
  Eigen::VectorXd qdd_;
  std::vector<Lanes> dq_, dqd_, dtau_, dqdd_;
};

// Where it is built and installed.
const char* PinocchioModule() {
#ifdef SYSID_PINOCCHIO_ENGINE
  if (std::filesystem::exists(SYSID_PINOCCHIO_ENGINE)) {
    return SYSID_PINOCCHIO_ENGINE;
  }
#endif
  return nullptr;
}

template <class Work>
double Nanoseconds(Work work) {
  constexpr int kTimes = 4000;
  const std::clock_t start = std::clock();
  for (int i = 0; i < kTimes; ++i) work();
  return NanosecondsSince(start) / kTimes;
}

template <class OfKind>
void Measure(benchmark::State& state, const std::string& name) {
  const Point point(name);
  OfKind task(point);
  const auto own = [&] {
    task.Own();
    benchmark::ClobberMemory();
  };
  const char* module = PinocchioModule();
  std::unique_ptr<Engine> engine;
  const auto theirs = [&] { task.Theirs(engine.get()); };
  double beside = 0.0;
  if (module != nullptr) {
    engine = LoadEngine(module, point.model.mechanism());
    own();
    theirs();
    CHECK_LT(task.Apart(), kTolerance) << name;
    Nanoseconds(theirs);  // warm
    beside = 0.5 * Nanoseconds(theirs);
  }
  const std::clock_t start = std::clock();
  for (auto _ : state) own();
  const double took = NanosecondsSince(start) / state.iterations();
  if (module == nullptr) return;
  beside += 0.5 * Nanoseconds(theirs);
  state.counters["pinocchio"] = beside;
  state.counters["ratio"] = beside / took;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  if (const char* module = sysid::PinocchioModule(); module != nullptr) {
    benchmark::AddCustomContext(
        "pinocchio",
        sysid::LoadEngine(module, sysid::Shipped("arm7").mechanism())
            ->Version());
  }
  for (const std::string name : {"pendulum3", "pendulum3_planar", "arm7"}) {
    const auto add = [&](const std::string& what, auto function) {
      benchmark::RegisterBenchmark((name + "/" + what).c_str(), function, name);
    };
    add("ForwardDynamics", sysid::Measure<sysid::Forward>);
    add("InverseDynamics", sysid::Measure<sysid::Inverse>);
    add("MassMatrix", sysid::Measure<sysid::Mass>);
    add("Regressor", sysid::Measure<sysid::Regressor>);
    add("Derivatives", sysid::Measure<sysid::Derivatives>);
  }
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
