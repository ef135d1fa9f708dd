#include "tools/stochastic_flags.h"

#include <cmath>
#include <limits>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/stochastic/solvers.h"
#include "tools/program.h"

DEFINE_double(learning_rate, 0.1, "Adam's, in parts of a parameter's size");
DEFINE_string(schedule, "cosine", "constant, exponential or cosine");
DEFINE_int32(epochs, 150, "steps of Adam");
DEFINE_double(huber, 0, "threshold of the Huber loss, rad or m");
DEFINE_bool(from_rest, false, "every run starts at rest");
DEFINE_int32(kernels, 3, "of the mixture");
DEFINE_int32(draws, 16, "of the mixture, an epoch");
DEFINE_double(spread, 0.3, "of the mixture at its start, in parts of a size");
DEFINE_bool(online, false, "rollouts arrive in 10 portions, 15 epochs each");
DECLARE_uint64(seed);

namespace sysid {
namespace {

// What both solvers have.
void ReadDescent(AdamFitOptions* options) {
  CheckPositive("learning_rate", FLAGS_learning_rate, 10.0);
  CheckPositive("epochs", FLAGS_epochs, 1e6);
  options->adam.learning_rate = FLAGS_learning_rate;
  options->adam.schedule = ParseSchedule(FLAGS_schedule, "--schedule");
  options->adam.epochs = FLAGS_epochs;
  if (FlagGiven("huber")) {
    CheckPositive("huber", FLAGS_huber,
                  std::numeric_limits<double>::infinity());
    options->huber = FLAGS_huber;
  }
  options->from_rest = FLAGS_from_rest;
}

}  // namespace

AdamFitOptions AdamOptionsFromFlags() {
  AdamFitOptions options;
  ReadDescent(&options);
  return options;
}

MixtureOptions MixtureOptionsFromFlags() {
  MixtureOptions options;
  ReadDescent(&options);
  CheckPositive("kernels", FLAGS_kernels, 100);
  CheckPositive("draws", FLAGS_draws, 10000);
  CheckPositive("spread", FLAGS_spread, 3.0);
  options.kernels = FLAGS_kernels;
  options.draws = FLAGS_draws;
  options.spread = FLAGS_spread;
  options.online = FLAGS_online;
  // A rate that falls would hear little of what arrives last.
  if (FLAGS_online && !FlagGiven("schedule")) {
    options.adam.schedule = Schedule::kConstant;
  }
  options.seed = FLAGS_seed;
  if (FLAGS_online && FlagGiven("epochs")) {
    throw InputError("--epochs", "has no meaning with --online",
                     "online are 10 portions of 15 epochs");
  }
  return options;
}

void CheckSolverFlags(const std::string& solver) {
  const auto refuse = [&](const char* flag, const std::string& owners) {
    if (!FlagGiven(flag)) return;
    throw InputError(std::string("--") + flag,
                     "has no meaning for --solver " + solver,
                     "it belongs to " + owners);
  };
  if (FindSolver(solver).kind != SolverKind::kStochastic) {
    for (const char* flag :
         {"learning_rate", "schedule", "epochs", "huber", "from_rest"}) {
      refuse(flag, "--solver adam and gmm");
    }
  }
  if (solver == "gmm") return;
  for (const char* flag : {"kernels", "draws", "spread", "online"}) {
    refuse(flag, "--solver gmm");
  }
}

}  // namespace sysid
