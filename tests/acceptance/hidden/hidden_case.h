#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "residuals/run.h"
#include "tests/acceptance/hidden/planted_effect.h"
#include "tests/acceptance/hidden/test_mechanism.h"

namespace sysid {

// One experiment of the suite "data with a hidden effect": recordings of a
// mechanism that has effects which the model does not have.
struct HiddenCase {
  std::string name;       // "cartpole/effort_delay@base/mujoco/3e-4/1"
  std::string mechanism;  // one of TestMechanismNames()
  std::string engine;     // "sysid" or "mujoco"
  std::vector<std::string> planted;  // effects; none: the model is complete
  // > 0: Coulomb friction by MuJoCo's frictionloss, which is softer than
  // ours; its time constant, s (MujocoPlantOptions).
  double friction_time = 0.0;
  // How much each effect matters: the rms difference of the motions with and
  // without it over the mechanism's window from the same states, over the
  // noise. The size of the effect is found for it.
  double strength = 0.0;
  double noise = 0.0;  // rad or m
  std::uint64_t seed = 1;
};

// Cases with one and with two hidden effects, by both engines; `seeds` of each,
// with noise and strength in turn.
std::vector<HiddenCase> HiddenCases(int seeds);
// Cases with nothing hidden: 18 a seed.
std::vector<HiddenCase> CompleteCases(int seeds);

// A case with all that it takes to run it.
struct HiddenData {
  HiddenCase info;
  TestMechanism mechanism;
  Model truth;                         // without the effects
  std::vector<PlantedEffect> planted;  // with their values
  std::vector<double> magnitudes;      // as PlantEffect takes them
  std::vector<double> strengths;       // that they have
  bool at_most = false;  // an effect is as large as it may be and still weaker
  std::vector<sysid::Run> train;  // two, 8 s at 100 Hz
  sysid::Run holdout;             // one of the same kind

  HiddenData(const HiddenCase& c, const TestMechanism& m)
      : info(c), mechanism(m), truth(m.plain) {}
};

HiddenData MakeHiddenData(const HiddenCase& hidden_case);

// One recording of a mechanism with effects; times and efforts are of the
// `engine` and everything random of the seed.
sysid::Run Record(const TestMechanism& mechanism, const Model& truth,
                  const std::vector<PlantedEffect>& planted,
                  const HiddenCase& info, double duration, std::uint64_t seed);

// The rms over joints and time of what the effect changes within the window,
// rad or m.
double Difference(const TestMechanism& mechanism, const Model& truth,
                  const PlantedEffect& effect, double tolerance,
                  std::uint64_t seed);

}  // namespace sysid
