#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"
#include "tests/support/fit_setup.h"

namespace sysid {

// Diagnoses of shipped robots whose recordings have effects that the model
// lacks.

constexpr double kSetupNoise = 1e-3;

// A machine that moves: from a random start, with efforts where it is driven.
struct Recording {
  double duration = 4.0;   // s
  double amplitude = 1.0;  // of the start, rad
  double level = 0.0;      // of the efforts; 0: not driven
  double noise = kSetupNoise;
  int start = 0;  // seed of the start; 0: that of the noise
};

inline Run Record(const Model& truth, std::uint64_t seed,
                  const Recording& recording = {}) {
  SimulationOptions options;
  options.duration = recording.duration;
  options.noise = recording.noise;
  options.seed = seed;
  if (recording.level > 0) {
    options.excitation = Excitation::kMultisine;
    options.excitation_level = recording.level;
  }
  const std::uint64_t start = recording.start > 0 ? recording.start : seed;
  Run run =
      Simulate(truth, RandomState(truth, recording.amplitude, start), options);
  run.name = "run" + std::to_string(seed) + ".csv";
  return run;
}

// The model as it is thought to be, and runs of what it is in truth: the first
// of them held out.
inline DiagnosisProblem MakeProblem(const Model& model,
                                    const std::vector<Value>& free,
                                    std::vector<Run> runs) {
  DiagnosisProblem problem(model);
  problem.free = FreeFrom(model, free);
  problem.options.noise = kSetupNoise;
  problem.SetRuns({runs.begin() + 1, runs.end()}, {runs.front()});
  return problem;
}

inline std::vector<std::shared_ptr<const Effect>> AllCandidates(
    const Model& model) {
  const Catalogue catalogue;
  std::vector<std::shared_ptr<const Effect>> candidates;
  for (const std::string& name : catalogue.Candidates(model.mechanism())) {
    candidates.push_back(catalogue.Make(name, model.mechanism(), "test"));
  }
  return candidates;
}

}  // namespace sysid
