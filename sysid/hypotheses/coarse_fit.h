#pragma once

#include <memory>
#include <vector>

#include "sysid/checks/excerpt.h"
#include "sysid/estimation/shooting_problem.h"
#include "sysid/hypotheses/data_hypothesis.h"
#include "sysid/linearization/screening.h"

namespace sysid {

// Coarse fits of an excerpt: few iterations on short independent segments. All
// that compete to explain what a fit misses (effects, hypotheses about the
// data) are fitted to every other window and judged by the others.

// A model with what is free in it.
struct CoarseModel {
  Model model;
  std::vector<FreeParameter> free;
};

// The model with viscous and Coulomb friction on every joint and a bias of
// every effort, free beside what the user frees: a missing friction is no fault
// of the data.
CoarseModel WithFriction(const Model& model,
                         const std::vector<FreeParameter>& free,
                         const std::vector<const Run*>& runs);

// The augmented model: with a spring, a zero, an armature and a drag of every
// joint, and masses, centres and inertias where `bodies`: what any missing
// physics of rigid bodies could do.
CoarseModel Augmented(const CoarseModel& model, bool bodies);

// With an effect, which starts where the screening expects it.
CoarseModel WithEffect(const CoarseModel& model, const ScreenedEffect& effect);

// Without what is supposed of it.
CoarseModel Without(CoarseModel model, const Supposition& supposed);

// Starting from these values, in the order of `free`.
CoarseModel StartingAt(CoarseModel model, const std::vector<double>& values);

struct CoarseFit {
  Supposition supposed;  // what the data were read by
  std::shared_ptr<const ShootingProblem> train;
  Solution point;
  std::vector<double> values;  // of the free parameters
  double train_error = 0.0;    // in times the noise; infinity: cannot follow

  // Of the windows that were not fitted. Each from states of its own.
  double error = 0.0;  // in times the noise
  // log rms error of each held-out window and channel, (10.2): in the unit of
  // the recording. NaN where nothing was measured.
  RowMatrixXd log_errors;
  // How much each of them can tell, (10.3), from 0 to 1.
  RowMatrixXd weights;
  // The part of the motion that is not explained: rms error over rms motion
  // beside the straight lines of the segments, of the worst channel.
  double unexplained = 0.0;
};

// Fits and judges, and counts what that costs.
class CoarseFitter {
 public:
  // `patient`: whatever does not explain the data is begun a second time, from
  // short segments.
  CoarseFitter(const CheckInput& input, int samples, bool patient);

  const Excerpt& excerpt() const { return excerpt_; }
  double segment_s() const { return segment_s_; }
  const EstimationOptions& options() const { return options_; }
  // Indices of the runs of the held-out windows.
  const std::vector<int>& held_runs() const { return held_runs_; }
  // Every other window of the excerpt, of recordings without what is supposed.
  std::vector<Run> Train(const Supposition& supposed) const;
  Excerpt::Change ChangeOf(const Supposition& supposed) const;

  // `start` (may be null): a fit of the same model to begin from. `noise_of`
  // (null: the noise is estimated): errors are compared in one noise, for a
  // column that is shifted between samples has less of it.
  CoarseFit Fit(const CoarseModel& model, const Supposition& supposed,
                int iterations, const CoarseFit* start = nullptr,
                const DataSet* noise_of = nullptr);
  // Adds what the held-out windows say.
  void Judge(CoarseFit* fit);

  // In samples that were rolled out without derivatives.
  double work() const { return work_; }
  void AddWork(double work) { work_ += work; }
  // Of a fit of so many columns.
  double WorkOf(int columns, double evaluations) const;

 private:
  std::vector<Run> Half(const Supposition& supposed, int first) const;
  int Samples() const;
  // The best point from the states of the data: its error over the noise, and
  // the evaluations that it took.
  struct Solved {
    Solution point;
    double error = 0.0;
    int evaluations = 0;
  };
  Solved SolveFromData(const ShootingProblem& problem,
                       const Eigen::VectorXd& theta, bool fix_theta,
                       int iterations) const;
  Solved SolveFrom(Solution point, const ShootingProblem& problem,
                   bool fix_theta, int iterations) const;

  const Mechanism& mechanism_;
  Excerpt excerpt_;
  EstimationOptions options_;
  std::vector<int> held_runs_;
  bool patient_ = false;
  double segment_s_ = 0.0, work_ = 0.0;
};

// The difference of two explanations over held-out windows, (10.3): weighted
// mean and standard error of log error(a) - log error(b), weights those of a.
struct Difference {
  double mean = 0.0, std_error = 0.0;
  double windows = 0.0;  // of equal weight that would tell as much
  // b is better by so many standard errors, and by a factor worth a word.
  bool IsBetter(double significance, double factor) const;
  // Neither is better by more than a standard error, or by what is worth a
  // word.
  bool IsTie() const;
};
// Of the windows of these runs (empty: all).
Difference Compare(const CoarseFit& a, const CoarseFit& b,
                   const std::vector<int>& held_runs,
                   const std::vector<int>& runs);

}  // namespace sysid
