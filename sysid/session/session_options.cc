#include "sysid/session/session_options.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

#include "models/error.h"
#include "sysid/io/csv.h"
#include "sysid/stochastic/rollout_gradient.h"

namespace sysid {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string Number(double value) { return ShortestText(value); }

// The flag's number, or else the file's; 0 at "" where neither is given.
Located<double> ChooseNumber(const std::optional<double>& flag,
                             const std::optional<Located<double>>& file,
                             const std::string& name, double lowest,
                             double highest, const std::string& hint) {
  const Located<double> chosen = flag   ? Located<double>{*flag, "--" + name}
                                 : file ? *file
                                        : Located<double>{};
  if (chosen.place.empty()) return chosen;
  if (!(chosen.value > 0 && std::isfinite(chosen.value))) {
    throw InputError(chosen.place,
                     "must be a positive number, not " + Number(chosen.value),
                     hint);
  }
  if (chosen.value < lowest || chosen.value > highest) {
    throw InputError(chosen.place,
                     "cannot be " + Number(chosen.value) +
                         ": it lies between " + Number(lowest) + " and " +
                         Number(highest),
                     hint);
  }
  return chosen;
}

// A step that is longer than the samples are apart ends at each of them.
void FitStepToRuns(const Located<double>& step, const std::vector<Run>& runs,
                   EstimationOptions* options,
                   std::vector<std::string>* notices) {
  constexpr double kMostSteps = 1000;  // between two samples, on average
  options->rollout.step = step.value;
  if (step.place.empty()) return;
  double gap = 0.0;
  for (const Run& run : runs) {
    const double period =
        (run.t.back() - run.t.front()) / std::max(1, run.size() - 1);
    if (period / step.value > kMostSteps) {
      throw InputError(step.place,
                       Number(step.value) +
                           " s makes more than 1000 steps "
                           "from one sample of " +
                           run.name + " to the next",
                       "leave it out: it is then chosen so that its error is "
                       "below the noise");
    }
    for (int k = 1; k < run.size(); ++k) {
      gap = std::max(gap, run.t[k] - run.t[k - 1]);
    }
  }
  if (step.value <= gap * (1 + 1e-9)) return;
  options->rollout.step = gap;
  notices->push_back(step.place + ": " + Number(step.value) +
                     " s is longer than the samples are apart: a step "
                     "ends at every sample");
}

// A run that is shorter than a segment is one segment: a notice names those,
// unless the segment is the whole run as a person rounds its duration.
void FitSegmentToRuns(const Located<double>& segment,
                      const std::vector<Run>& runs, EstimationOptions* options,
                      std::vector<std::string>* notices) {
  options->segment = segment.value;
  if (segment.place.empty()) return;
  double longest = 0.0;
  std::vector<std::string> shorter;
  for (const Run& run : runs) {
    const double duration = run.t.back() - run.t.front();
    const double period = duration / std::max(1, run.size() - 1);
    longest = std::max(longest, duration);
    if (segment.value <= duration + period) continue;
    shorter.push_back(run.name + " (" + RoundedText(duration) + " s)");
  }
  options->segment = std::min(segment.value, longest);
  if (shorter.empty()) return;
  notices->push_back(
      segment.place + ": " + Number(segment.value) + " s is longer than " +
      Join(shorter) + ", which " + (shorter.size() == 1 ? "is" : "are") +
      " fitted in one segment" + (shorter.size() == 1 ? "" : " each"));
}

}  // namespace

std::string ChooseSolver(const FitRequest& request,
                         const FitSpecification& spec) {
  const std::string place = !request.solver.empty() ? "--solver"
                            : spec.solver           ? spec.solver->place
                                                    : "";
  const std::string solver = !request.solver.empty() ? request.solver
                             : spec.solver           ? spec.solver->value
                                                     : "lm";
  const std::vector<std::string>& known = SolverNames();
  if (std::find(known.begin(), known.end(), solver) == known.end()) {
    throw InputError(place, "unknown solver '" + solver + "'",
                     NameHint(solver, known));
  }
  if (solver != "lm" && !request.any_solver) {
    throw InputError(place, "this program has no solver '" + solver + "'",
                     "it fits by lm; sysid_fit has all solvers");
  }
  if (solver != "lm" && !HaveStanMath()) {
    throw InputError(place, "this build has no solver '" + solver + "'",
                     kStanMathHint);
  }
  return solver;
}

void FillOptions(const FitRequest& request, const FitSpecification& spec,
                 EstimationOptions* options) {
  const auto word = [](const std::string& flag,
                       const std::optional<Located<std::string>>& file,
                       const std::string& name,
                       const std::vector<std::string>& known) {
    const std::string value = !flag.empty() ? flag : file ? file->value : "";
    if (!value.empty() &&
        std::find(known.begin(), known.end(), value) == known.end()) {
      throw InputError("--" + name, "unknown " + name + " '" + value + "'",
                       NameHint(value, known));
    }
    return value;
  };
  // Outside of this the squares of whitened errors overflow.
  constexpr double kLeastNoise = 1e-12, kMostNoise = 1e6;
  options->noise =
      ChooseNumber(request.noise, spec.noise, "noise", kLeastNoise, kMostNoise,
                   "give the standard deviation of a measurement, in rad or m; "
                   "left out, it is estimated from the data")
          .value;
  const std::string integrator = word(request.integrator, spec.integrator,
                                      "integrator", IntegratorNames());
  if (!integrator.empty()) {
    options->rollout.integrator = ParseIntegrator(integrator, "--integrator");
  }
  if (word(request.residual, spec.residual, "residual", ResidualNames()) ==
      "rotation") {
    options->orientation = OrientationResidual::kRotation;
  }
  const std::string loss =
      word(request.loss,
           spec.loss ? std::optional<Located<std::string>>(
                           {spec.loss->value.name, spec.loss->place})
                     : std::nullopt,
           "loss", LossNames());
  if (loss == "huber") options->loss = RobustLoss::kHuber;
  if (loss == "cauchy") options->loss = RobustLoss::kCauchy;
  if (spec.loss && spec.loss->value.scale) {
    options->loss_scale = *spec.loss->value.scale;
  }
  if (request.threads < 0) {
    throw InputError("--threads", "must not be negative", "0 means all cores");
  }
  // Each has a stack and buffers of its own.
  constexpr int kMostThreads = 1024;
  if (request.threads > kMostThreads) {
    throw InputError(
        "--threads",
        "cannot be " + std::to_string(request.threads) + ": 1024 are the most",
        "more threads than cores make nothing faster; 0 means all "
        "cores");
  }
  options->threads =
      request.threads > 0
          ? request.threads
          : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void FillLengths(const FitRequest& request, const FitSpecification& spec,
                 const std::vector<Run>& runs, EstimationOptions* options,
                 std::vector<std::string>* notices) {
  const std::string hint = "give seconds, or leave it out: it is then chosen";
  const Located<double> segment = ChooseNumber(request.segment, spec.segment,
                                               "segment", 0.0, kInfinity, hint);
  FitSegmentToRuns(segment, runs, options, notices);
  FitStepToRuns(
      ChooseNumber(request.step, spec.step, "step", 0.0, kInfinity, hint), runs,
      options, notices);
}

}  // namespace sysid
