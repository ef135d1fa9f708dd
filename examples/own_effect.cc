// own_effect: a physical effect that the toolkit does not know, a spring that
// hardens, added to its catalogue, planted in a simulation and found again by
// a fit. docs/effects.md explains it line by line.
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
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

int main() {
  using namespace sysid;
  constexpr double kTruth = 2.0;  // N m/rad^3
  try {
    Catalogue catalogue;
    catalogue.Add<CubicSpring>();

    // The model with the effect in it, off: its parameter is zero.
    Model model = MakeModel(LoadUrdf(FindModel("pendulum2_planar")), catalogue);
    model.AddEffect(
        catalogue.Make("cubic_spring@joint1", model.mechanism(), "here"));

    // A recording of a mechanism that has it.
    Model truth = model;
    truth.SetEffectParameter("joint1.cubic_stiffness", kTruth);
    SimulationOptions simulation;
    simulation.noise = 1e-3;  // rad
    std::vector<Run> runs;
    runs.push_back(Simulate(truth, RandomState(truth, 0.6, 1), simulation));

    // Fitted like any other parameter.
    std::vector<FreeParameter> free;
    for (const Parameter& parameter : FindParameters(
             model, {"link1.length", "joint1.cubic_stiffness"}, "here")) {
      FreeParameter wanted;
      wanted.parameter = parameter;
      wanted.initial = parameter.nominal;
      wanted.lower = parameter.lower;
      wanted.upper = parameter.upper;
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
    std::printf("planted: %.5f; error %.2f times the noise\n", kTruth,
                fit.train.total.normalized_rms);
    const ParameterEstimate& found = fit.parameters.back();
    const bool recovered =
        std::abs(found.value - kTruth) < 4.0 * found.std_error;
    return fit.converged && recovered ? 0 : 1;
  } catch (const InputError& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
  }
}
