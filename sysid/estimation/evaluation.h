#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// Root mean square per independent number measured. `rms` is over position-like
// channels (rad and m; over all where there is none), `normalized_rms` over
// all, each divided by its noise: 1 is the noise floor. Both are corrected for
// the numbers that were fitted: they estimate the standard deviation of what
// the model does not explain. `fit_percent` is (8.2), NaN where nothing moves
// or the dynamics fail.
struct ErrorSummary {
  double rms = 0.0;
  double normalized_rms = 0.0;
  double fit_percent = std::numeric_limits<double>::quiet_NaN();
};

struct ChannelError {
  std::string name, unit;
  bool position_like = true;
  double rms = 0.0;
  double normalized_rms = 0.0;
  double noise = 0.0;
  double fit_percent = std::numeric_limits<double>::quiet_NaN();  // (8.1)
  double dof = 0.0;  // numbers measured
};

struct SegmentError {
  std::string trajectory;
  double t_start = 0.0, t_end = 0.0;
  double normalized_rms = 0.0;
  double squares = 0.0, dof = 0.0;  // whitened errors, and numbers measured
};

struct RunErrors {
  ErrorSummary total;
  // Of the whitened errors; and numbers measured, less those fitted.
  double squares = 0.0, dof = 0.0;
  std::vector<ChannelError> channels;
  std::vector<SegmentError> segments;
};

// Of the trajectories of a point, when `fitted` numbers were fitted to them.
// Where the dynamics fail the errors are infinite. Of several processes each
// knows the segments of its own runs (GatherErrors); all else is of all runs.
// `correlated`, where it is not null, is their AutocorrelationTime.
RunErrors EvaluateErrors(const ShootingProblem& problem, const Solution& point,
                         double fitted, double* correlated = nullptr);

// The mean square of errors as the problem weighs them: beside its noise where
// it knows no misfit.
double WeighedSquare(const ShootingProblem& problem, const RunErrors& errors);

// The errors of a segment, SI, from the state x0. False where the dynamics
// fail.
bool RollErrors(const SegmentRollout& rollout, const double* x0,
                const Eigen::VectorXd& theta, std::vector<double>* errors);

// By how much the variance of an estimate exceeds that under white residuals:
// the integrated autocorrelation time of the whitened residuals in samples,
//   1 + 2 sum_k rho_k,  summed until rho_k < 2 / sqrt(samples)           (6.3)
// (in the manner of Geyer's initial positive sequence; the threshold is two
// standard errors of a white series), over components and weighted by their
// squares. 1 where they are white.
double AutocorrelationTime(const ShootingProblem& problem,
                           const Solution& point);

// The same of errors that are there already, of each run its segments in the
// order of time: by channel, by component, each a series.
using WhitenedSeries = std::vector<std::vector<std::vector<double>>>;
WhitenedSeries WhitenErrors(const RunData& data, const SegmentRollout& rollout,
                            const double* errors);
double AutocorrelationTime(const std::vector<std::vector<WhitenedSeries>>& runs,
                           const Processes& all = Alone());

// How many independent numbers of a run's initial state the data speaks of: the
// axial spin of a spherical joint does not show in heading vectors.
double ObservedStateDof(const ShootingProblem& problem);

// Error against how far ahead the model predicts: states estimated from short
// windows, then rolled out; rms over position-like channels. To `longest`, s.
struct HorizonChannel {
  std::string name;
  double rms = 0.0;  // rad or m
};
struct HorizonError {
  double horizon_s = 0.0;
  double rms = 0.0;
  std::vector<HorizonChannel> channels;  // by name
};
std::vector<HorizonError> EvaluateHorizon(
    const ShootingProblem& problem, const Solution& solution,
    double longest = std::numeric_limits<double>::infinity());

// One prediction over the whole run from the first state of the point; in the
// measurement's own unit, angles as the angle between (rad).
struct OpenError {
  std::string trajectory;
  double duration_s = 0.0;
  struct Channel {
    std::string name, unit;
    double rms = 0.0;  // infinity where the dynamics fail
    double fit_percent = std::numeric_limits<double>::quiet_NaN();  // (8.1)
  };
  std::vector<Channel> channels;
};
std::vector<OpenError> EvaluateOpen(const ShootingProblem& problem,
                                    const Solution& point);

// The segments, or the open predictions, of all processes: for the first one.
// The others keep their own.
void GatherErrors(const Processes& all, RunErrors* errors);
void GatherOpen(const Processes& all, std::vector<OpenError>* open);

// What each channel would have measured at each sample, given the point's
// parameters and the states there (SampleStates): matrices like
// Channel::values.
std::vector<RowMatrixXd> PredictChannels(const ShootingProblem& problem,
                                         const Solution& point, int run,
                                         const RowMatrixXd& states);

}  // namespace sysid
