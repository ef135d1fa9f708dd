#pragma once

#include <string>
#include <vector>

#include "sysid/estimation/evaluation.h"
#include "sysid/linearization/linearized_fit.h"

namespace sysid {

// How well a model predicts what its parameters were not fitted to
// (docs/theory.md, section 7): over stretches of the fitted runs, each with the
// parameters of the other runs, or of the other stretches where there is one
// run; and over the held-out runs. Each segment starts from its own state.
struct CrossValidation {
  // Whitened errors, and numbers measured less those of the states, of the
  // segments whose middle is in the stretch; both zero where there is none.
  struct Stretch {
    double squares = 0.0, dof = 0.0;
    std::string trajectory{};
    double t_start = 0.0, t_end = 0.0;  // s

    double error() const;  // normalised; NaN where there is none
  };
  std::vector<Stretch> stretches;

  Eigen::ArrayXd LogErrors() const;  // by stretch
  // The geometric mean of the stretches' normalised errors: none of them, where
  // all models fail alike, hides the others.
  double error() const;
  // Of that, as it varies from stretch to stretch; infinite for one of them.
  double std_error() const;
};

// Which stretch each segment of a fit belongs to, and which part of the data
// predicts it without: the other runs, or of one run the other stretches.
struct Folds {
  std::vector<int> stretch, fold;  // of the segments
  int stretches = 0, count = 0;    // in all; of folds
};
Folds FoldsOf(const LinearizedFit& fit);

// Of the fitted runs, from one linearisation of the fit: (7.11).
CrossValidation CrossValidate(const LinearizedFit& fit);
// Adds the stretches of runs that were not fitted at all. Each segment's state
// took up `state_dof` numbers (ObservedStateDof).
void AddHeldOut(const DataSet& data, const RunErrors& errors, double state_dof,
                CrossValidation* to);

}  // namespace sysid
