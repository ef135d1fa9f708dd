#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sysid/checks/check.h"
#include "sysid/simulation/simulate.h"
#include "tests/support/fit_setup.h"

namespace sysid {

// A recording of a shipped model that is driven, simulated with noise of 1e-3,
// for tests that spoil it: the run, or the model that the checks are given.
class SimulatedRecording {
 public:
  SimulatedRecording(const std::string& name, std::uint64_t seed,
                     double duration)
      : model_(Shipped(name)) {
    SimulationOptions options;
    options.duration = duration;
    options.noise = 1e-3;
    options.seed = seed;
    options.excitation = Excitation::kMultisine;
    options.excitation_level = 0.5;
    run_ = Simulate(model_, RandomState(model_, 1.0, seed), options);
    run_.name = name + ".csv";
  }

  Model& model() { return model_; }
  Run& run() { return run_; }

  // Nothing is free, as where all values are known. Points into this.
  CheckInput Input() const {
    CheckInput input;
    input.model = &model_;
    input.free = &free_;
    input.runs = {&run_};
    return input;
  }

 private:
  Model model_;
  std::vector<FreeParameter> free_;
  Run run_;
};

}  // namespace sysid
