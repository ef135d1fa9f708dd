#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/estimation/fit.h"
#include "sysid/simulation/simulate.h"

namespace sysid {

// Shipped models with effects and values, runs of them, and what is fitted: as
// the programs make them, in a line each.

struct Value {
  std::string name;
  double value;
};

inline void Set(const std::vector<Value>& values, Model* model) {
  std::vector<std::string> names;
  std::vector<double> numbers;
  for (const Value& value : values) {
    names.push_back(value.name);
    numbers.push_back(value.value);
  }
  SetParameters(FindParameters(*model, names, "test"), numbers, model);
}

inline Model Shipped(const std::string& name,
                     const std::vector<std::string>& effects = {},
                     const std::vector<Value>& values = {}) {
  const Catalogue catalogue;
  const Mechanism mechanism = LoadUrdf(FindModel(name));
  Model model = MakeModel(mechanism, catalogue);
  for (const std::string& effect : effects) {
    model.AddEffect(catalogue.Make(effect, mechanism, "test"));
  }
  Set(values, &model);
  return model;
}

// Free from these values, within the parameters' physical bounds.
inline std::vector<FreeParameter> FreeFrom(const Model& model,
                                           const std::vector<Value>& initial) {
  std::vector<FreeParameter> free;
  for (const Value& value : initial) {
    FreeParameter f;
    f.parameter = FindParameters(model, {value.name}, "test").front();
    f.initial = value.value;
    f.lower = f.parameter.lower;
    f.upper = f.parameter.upper;
    free.push_back(f);
  }
  return free;
}

// The same problem with options that `change` sets.
template <typename Change>
ShootingProblem Changed(const ShootingProblem& problem, const Change& change) {
  EstimationOptions options = problem.options();
  change(&options);
  return problem.With(options);
}

inline Fit FitRuns(const Model& model, const std::vector<FreeParameter>& free,
                   std::vector<Run> runs,
                   const EstimationOptions& options = {}) {
  ShootingProblem problem(model, free, std::move(runs), options);
  return FitLevenbergMarquardt(problem);
}

inline const ParameterEstimate& EstimateOf(const Fit& fit,
                                           const std::string& name) {
  for (const ParameterEstimate& estimate : fit.parameters) {
    if (estimate.name == name) return estimate;
  }
  static const ParameterEstimate none;
  return none;
}

// (estimate - truth) / standard error.
inline double Deviation(const Fit& fit, const Value& truth) {
  const ParameterEstimate& estimate = EstimateOf(fit, truth.name);
  return (estimate.value - truth.value) / estimate.std_error;
}

}  // namespace sysid
