#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "glog/logging.h"
#include "sysid/estimation/holdout.h"
#include "sysid/inverse_dynamics/inverse_dynamics_fit.h"
#include "tests/support/tracked_arm.h"

// How often the intervals of an arm's base parameters hold the truth: arm7,
// tracked, all inertial parameters and three frictions an axis
// (tests/support/tracked_arm.h).
//
//   arm_coverage inverse_dynamics|lm FIRST LAST [rate, Hz [noise, rad
//   [predict]]]
//
// of the seeds FIRST to LAST. A line a seed: intervals that hold, the worst
// deviation in standard errors, seconds of CPU, and, if asked, the error of
// predictions over segments whose states are estimated, in times the noise.
// Then the coverage, and by parameter the mean and the rms of the deviations.

namespace sysid {
namespace {

constexpr double kInterval = 1.96;  // standard errors, 95 %

double Cpu() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// The standard error of a combination by the covariance of the parameters.
double StandardError(const BaseParameter& base,
                     const EquationCoordinates& coordinates, const Fit& fit,
                     const std::vector<FreeParameter>& free) {
  const int n = static_cast<int>(free.size());
  Eigen::VectorXd gradient(n);
  for (int i = 0; i < n; ++i) {
    const Parameter& p = free[i].parameter;
    const double h = 1e-6 * p.typical_scale;
    double at[2];
    for (const int side : {0, 1}) {
      Model moved = fit.model;
      Set({{p.name, fit.parameters[i].value + (side == 0 ? -h : h)}}, &moved);
      at[side] = CombinationAt(base, coordinates, moved);
    }
    gradient[i] = (at[1] - at[0]) / (2.0 * h);
  }
  return std::sqrt(gradient.dot(fit.covariance * gradient));
}

struct Deviations {
  int intervals = 0, hold = 0;
  double squares = 0.0;
  std::map<std::string, std::vector<double>> by_name;
};

void FitSeed(const TrackedArmOptions& options, bool lm, bool predict,
             Deviations* all) {
  const TrackedArm arm = MakeTrackedArm(options);
  const auto problem = std::make_shared<ShootingProblem>(
      arm.start, arm.free, std::vector<Run>{arm.run}, EstimationOptions{});
  const double began = Cpu();
  Fit fit = FitInverseDynamics(*problem);
  const std::vector<BaseParameter> combinations = fit.base;
  const EquationCoordinates coordinates(problem->model(),
                                        problem->map().parameters());
  if (lm) fit = FitLevenbergMarquardt(StartByInverseDynamics(*problem));
  const double seconds = Cpu() - began;
  int hold = 0;
  double worst = 0.0;
  std::string worst_name;
  for (const BaseParameter& base : combinations) {
    const double error =
        lm ? StandardError(base, coordinates, fit, arm.free) : base.std_error;
    const double deviation = (CombinationAt(base, coordinates, fit.model) -
                              CombinationAt(base, coordinates, arm.truth)) /
                             error;
    hold += std::abs(deviation) < kInterval;
    all->squares += deviation * deviation;
    all->by_name[base.terms[0].name].push_back(deviation);
    if (std::abs(deviation) > std::abs(worst)) {
      worst = deviation;
      worst_name = base.terms[0].name;
    }
  }
  all->hold += hold;
  all->intervals += static_cast<int>(combinations.size());
  std::printf(
      "seed %d%s: %d of %zu, worst %.1f (%s), %d iterations, %.2f s; left, %%:",
      options.seed, fit.converged ? "" : " did not converge", hold,
      combinations.size(), worst, worst_name.c_str(), fit.iterations, seconds);
  for (const EffortError& error : fit.effort) {
    std::printf(" %.2f", error.percent);
  }
  if (predict) {
    const Holdout predicted = EvaluateHoldout(
        OpenHoldout(fit.model, problem->shared_data(), problem->options(),
                    fit.point.rollout, fit.segment_s),
        nullptr);
    std::printf("; predictions %.3f of the noise",
                predicted.errors.total.normalized_rms);
  }
  std::printf("\n");
  std::fflush(stdout);
}

void Say(const Deviations& all) {
  std::printf(
      "%d of %d intervals hold the truth: %.1f %%; deviations of %.2f "
      "standard errors\n",
      all.hold, all.intervals, 100.0 * all.hold / all.intervals,
      std::sqrt(all.squares / all.intervals));
  for (const auto& [name, deviations] : all.by_name) {
    double sum = 0.0, squares = 0.0;
    for (const double d : deviations) {
      sum += d;
      squares += d * d;
    }
    const double n = static_cast<double>(deviations.size());
    std::printf("%-18s mean %6.2f, rms %5.2f\n", name.c_str(), sum / n,
                std::sqrt(squares / n));
  }
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  if (argc < 4) {
    std::fprintf(stderr,
                 "arm_coverage inverse_dynamics|lm FIRST LAST "
                 "[rate [noise [predict]]]\n");
    return 2;
  }
  sysid::TrackedArmOptions options;
  if (argc > 4) options.rate = std::atof(argv[4]);
  if (argc > 5) options.noise = std::atof(argv[5]);
  sysid::Deviations all;
  for (options.seed = std::atoi(argv[2]); options.seed <= std::atoi(argv[3]);
       ++options.seed) {
    sysid::FitSeed(options, std::string(argv[1]) == "lm", argc > 6, &all);
  }
  sysid::Say(all);
  return 0;
}
