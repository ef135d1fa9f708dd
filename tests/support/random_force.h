#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "tests/support/fit_setup.h"

namespace sysid {

// A planar double pendulum with viscous friction, driven by efforts that are
// recorded and by a random force that is not: exponentially correlated, 30 % as
// large at the elbow.
struct RandomForceCase {
  double std = 0.1, correlation_s = 0.3;  // N m, s
  int seed = 1;
};

inline Model ForcedPendulum() {
  return Shipped("pendulum2_planar",
                 {"viscous_damping@joint1", "viscous_damping@joint2"},
                 {{"joint1.damping", 0.1}, {"joint2.damping", 0.03}});
}

inline std::vector<Value> TruthOfForcedPendulum() {
  return {{"link1.length", 0.5},
          {"link2.length", 0.5},
          {"joint1.damping", 0.1},
          {"joint2.damping", 0.03}};
}

inline Run RecordUnderRandomForce(const RandomForceCase& c) {
  constexpr double kElbow = 0.3;
  SimulationOptions options;
  options.duration = 10.0;
  options.noise = 1e-3;
  options.seed = c.seed;
  const int samples = SampleCount(options);
  std::mt19937_64 random(c.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> frequency(0.1, 1.5),
      phase(0, 2 * M_PI);
  RowMatrixXd known = RowMatrixXd::Zero(samples, 2), unknown = known;
  for (int j = 0; j < 2; ++j) {
    const double share = j == 0 ? 1.0 : kElbow;
    for (int sine = 0; sine < 5; ++sine) {
      const double w = 2 * M_PI * frequency(random), p = phase(random);
      for (int i = 0; i < samples; ++i) {
        known(i, j) += 0.5 * share * std::sin(w * i / options.rate + p);
      }
    }
    const double kept = std::exp(-1.0 / (options.rate * c.correlation_s));
    double force = normal(random);
    for (int i = 0; i < samples; ++i) {
      unknown(i, j) = c.std * share * force;
      force = kept * force + std::sqrt(1 - kept * kept) * normal(random);
    }
  }
  const Model truth = ForcedPendulum();
  Run run = SimulateDriven(
      truth, RandomState(truth, 0.6, c.seed), options,
      [&](int sample, double, const Eigen::VectorXd&,
          Eigen::Ref<Eigen::VectorXd> effort) {
        effort = (known.row(sample) + unknown.row(sample)).transpose();
      });
  run.effort = known;
  run.name = "forced" + std::to_string(c.seed) + ".csv";
  return run;
}

}  // namespace sysid
