#pragma once

#include <string>
#include <vector>

#include "sysid/estimation/estimates.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/shooting_stage.h"

namespace sysid {

// What an estimator found.
struct Fit {
  std::string solver = "lm";
  bool converged = false;
  std::string termination;  // in words; where it failed: why
  int iterations = 0;
  double wall_time_s = 0.0;
  double step_s = 0.0;            // longest integration step
  double segment_s = 0.0;         // mean length of the last stage's segments
  double defect = kJoinedDefect;  // how tightly they hang together
  int samples = 0;
  double noise = 0.0;

  std::vector<ParameterEstimate> parameters;
  // By name: groups that the data cannot tell apart, and single parameters that
  // it says nothing of.
  std::vector<std::vector<std::string>> not_identifiable;
  Eigen::MatrixXd covariance;  // of the parameters' values
  RunErrors train;
  std::vector<HorizonError> horizon;
  std::vector<OpenError> open;
  std::vector<HistoryEntry> history;

  ShootingPoint point;
  Model model;  // with the estimates as nominal values

  explicit Fit(const Model& m) : model(m) {}
};

// Ceres' Levenberg-Marquardt over multiple-shooting segments that grow: short
// and loosely joined first, then the last length, tightly joined (one
// trajectory of the model a run). Covariance from the Jacobian with the states
// eliminated.
//
// The covariance is that of white noise of the problem's sigma, times the
// reduced chi-square where that is above 1 (a model that misses the data by
// eight times the noise knows its parameters eight times worse), times the
// autocorrelation time of the residuals: what is missing pulls the same way for
// many samples.
//
// Never throws for numerics: Fit::converged and termination say what happened.
Fit FitLevenbergMarquardt(ShootingProblem* problem);

}  // namespace sysid
