#pragma once

#include <memory>
#include <string>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/session/fit_request.h"
#include "sysid/simulation/simulate.h"

namespace sysid {

// A planar double pendulum in memory.
inline Model PlanarPendulum() {
  return MakeModel(LoadUrdf(FindModel("pendulum2_planar")), Catalogue());
}

// What it does with dry friction of 0.05 N m in its first joint, for 6 s.
inline Run RubbingPendulum(std::uint64_t seed) {
  Model truth = PlanarPendulum();
  truth.AddEffect(
      Catalogue().Make("coulomb_friction@joint1", truth.mechanism(), "here"));
  truth.SetEffectParameter("joint1.friction", 0.05);
  SimulationOptions options;
  options.duration = 6.0;
  options.noise = 1e-3;
  options.seed = seed;
  Run run = Simulate(truth, RandomState(truth, 0.8, seed), options);
  run.name = "";
  return run;
}

// Such a request needs no file.
inline FitRequest RubbingRequest() {
  FitRequest request;
  request.model_in_memory = std::make_shared<const Model>(PlanarPendulum());
  request.runs = {RubbingPendulum(1)};
  request.holdout_runs = {RubbingPendulum(2)};
  request.free = {{"link1.length", 0.4}, {"link2.length"}};
  request.check = CheckLevel::kNumbers;
  request.threads = 2;
  return request;
}

}  // namespace sysid
