// own_effect: three physical effects that the toolkit does not know, a spring
// that hardens, an oil that warms up and a rubber that creeps, added to its
// catalogue, planted in simulations and found again by fits. docs/effects.md
// explains them.
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "models/error.h"
#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/estimation/fit.h"
#include "sysid/simulation/simulate.h"

// tau = -k q^3 on a joint of one degree of freedom, k in N m/rad^3 (N/m^3 on a
// slide): a rubber buffer.
class CubicSpring : public sysid::EffectOf<CubicSpring> {
 public:
  static constexpr char kName[] = "cubic_spring";
  static constexpr sysid::TargetKind kTarget = sysid::TargetKind::kJoint;
  static constexpr char kShowsIn[] = "wide motion of the joint";
  static constexpr char kLaw[] = "-k q^3";

  CubicSpring(const sysid::Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, sysid::kEffortHook, mechanism, joint) {
    AddParameter(joint + ".cubic_stiffness", "{effort}/{position}^3", 1.0, 0.0,
                 std::numeric_limits<double>::infinity());
  }

  static bool Applies(sysid::JointType type) {
    return type != sysid::JointType::kSpherical;
  }

  template <typename T>
  void AddEffort(const sysid::JointState<T>& joint, const T* p, T* tau) const {
    const T& q = joint.q[0];
    tau[0] -= p[0] * q * q * q;
  }
};

// A hydraulic coupling of the joint to joint2, whose damping falls with the
// temperature of the oil, by 2 % a kelvin:
//   tau = -d exp(-0.02 (temperature - 20)) (qd - qd_2),
// d in N m s/rad, that at 20 deg C.
class OilDamping : public sysid::EffectOf<OilDamping> {
 public:
  static constexpr char kName[] = "oil_damping";
  static constexpr sysid::TargetKind kTarget = sysid::TargetKind::kJoint;
  static constexpr char kShowsIn[] =
      "motion while cold beside motion while hot";

  OilDamping(const sysid::Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, sysid::kEffortHook, mechanism, joint) {
    AddParameter(joint + ".oil_damping", "{effort} s/{position}", 0.01, 0.0,
                 std::numeric_limits<double>::infinity());
    ReadsInput(joint + ".temperature", "deg C");
    const int other = mechanism.FindJoint("joint2");
    ReadsJoint(other);
    other_ = mechanism.joints[other].v_index;
  }

  static bool Applies(sysid::JointType type) {
    return type != sysid::JointType::kSpherical;
  }

  template <typename T>
  void AddEffort(const sysid::JointState<T>& joint, const T* p, T* tau) const {
    using std::exp;
    const T viscosity = exp(-0.02 * (joint.inputs[0] - 20.0));
    tau[0] -= p[0] * viscosity * (joint.qd[0] - joint.all_qd[other_]);
  }

 private:
  int other_ = 0;
};

// A rubber that creeps: a spring in series with a damper (Maxwell's element),
//   tau = -k (q - z),   T z' = q - z,
// k in N m/rad. z is where the damper has crept to, which is a state.
class RubberCreep : public sysid::EffectOf<RubberCreep> {
 public:
  static constexpr char kName[] = "rubber_creep";
  static constexpr sysid::TargetKind kTarget = sysid::TargetKind::kJoint;
  static constexpr char kShowsIn[] = "motion about as fast as it creeps";

  RubberCreep(const sysid::Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, sysid::kEffortHook | sysid::kStateRateHook, mechanism,
                 joint) {
    AddParameter(joint + ".rubber_stiffness", "{effort}/{position}", 0.1, 0.0,
                 std::numeric_limits<double>::infinity());
    AddSearchedParameter(joint + ".creep_time", "s", 0.3, {0.1, 0.3, 1.0}, 1e-3,
                         1e3);
    AddState(joint + ".crept", "{position}", 0.5);
  }

  static bool Applies(sysid::JointType type) {
    return type != sysid::JointType::kSpherical;
  }

  template <typename T>
  void AddEffort(const sysid::JointState<T>& joint, const T* p, T* tau) const {
    tau[0] -= p[0] * (joint.q[0] - joint.z[0]);
  }
  template <typename T>
  void StateRate(const sysid::JointState<T>& joint, const T* p, T* rate) const {
    rate[0] = (joint.q[0] - joint.z[0]) / p[1];
  }
  template <typename T>
  void StartState(const sysid::JointState<T>& joint, const T*, T* z) const {
    z[0] = joint.q[0];  // it has rested there
  }
};

namespace {

using namespace sysid;

// The model with an effect in it, off: its parameter is zero.
Model ModelWith(const Catalogue& catalogue, const std::string& effect) {
  Model model = MakeModel(LoadUrdf(FindModel("pendulum2_planar")), catalogue);
  model.AddEffect(catalogue.Make(effect, model.mechanism(), "here"));
  return model;
}

// Fits the first link's length and the parameter of an effect to the runs, from
// their values in the model, and prints them. Whether what was planted is
// found.
bool FitAndPrint(const Model& model, std::vector<Run> runs,
                 const std::string& parameter, double planted) {
  std::vector<FreeParameter> free;
  for (const Parameter& found :
       FindParameters(model, {"link1.length", parameter}, "here")) {
    FreeParameter wanted;
    wanted.parameter = found;
    wanted.initial = found.nominal;
    wanted.lower = found.lower;
    wanted.upper = found.upper;
    free.push_back(wanted);
  }
  EstimationOptions options;
  options.threads = 2;
  ShootingProblem problem(model, free, std::move(runs), options);
  const Fit fit = FitLevenbergMarquardt(problem);
  for (const ParameterEstimate& p : fit.parameters) {
    std::printf("%s = %.5f +- %.5f %s (95 %%)\n", p.name.c_str(), p.value,
                1.96 * p.std_error, p.unit.c_str());
  }
  std::printf("planted: %.5f; error %.2f times the noise\n", planted,
              fit.train.total.normalized_rms);
  const ParameterEstimate& found = fit.parameters.back();
  const bool recovered =
      std::abs(found.value - planted) < 4.0 * found.std_error;
  return fit.converged && recovered;
}

// Simulates a mechanism that has the effect, and fits the model to that.
// `inputs`: what the effect reads beside, or null.
bool PlantAndFind(const Model& model, const std::string& parameter,
                  double planted, std::shared_ptr<const Run> inputs) {
  Model truth = model;
  truth.SetEffectParameter(parameter, planted);
  SimulationOptions simulation;
  simulation.noise = 1e-3;  // rad
  simulation.inputs = std::move(inputs);
  std::vector<Run> runs;
  runs.push_back(Simulate(truth, RandomState(truth, 0.6, 1), simulation));
  return FitAndPrint(model, std::move(runs), parameter, planted);
}

// The column joint1.temperature of a file: it warms up.
std::shared_ptr<const Run> Temperature() {
  const auto measured = std::make_shared<Run>();
  measured->inputs = {{"joint1.temperature", false, {}}};
  for (double t = 0.0; t < 10.5; t += 0.5) {
    measured->t.push_back(t);
    measured->inputs[0].values.push_back(15.0 + 3.0 * t);
  }
  return measured;
}

}  // namespace

int main() {
  try {
    Catalogue catalogue;
    catalogue.Add<CubicSpring>();
    catalogue.Add<OilDamping>();
    catalogue.Add<RubberCreep>();
    const bool spring =
        PlantAndFind(ModelWith(catalogue, "cubic_spring@joint1"),
                     "joint1.cubic_stiffness", 2.0, nullptr);
    const bool oil = PlantAndFind(ModelWith(catalogue, "oil_damping@joint1"),
                                  "joint1.oil_damping", 0.1, Temperature());
    const bool rubber =
        PlantAndFind(ModelWith(catalogue, "rubber_creep@joint1"),
                     "joint1.rubber_stiffness", 2.0, nullptr);
    return spring && oil && rubber ? 0 : 1;
  } catch (const InputError& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
  }
}
