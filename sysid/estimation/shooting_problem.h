#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "models/parameters.h"
#include "residuals/costs.h"
#include "residuals/segment.h"
#include "sysid/parameters/free_parameter.h"

namespace sysid {

// What a fit does while it runs, for a progress line. `error` is the normalised
// rms so far.
struct Progress {
  std::string doing;
  int iteration = 0;
  int of = 0;  // at most, in what is being done; 0: unknown
  double error = 0.0;
};

struct EstimationOptions {
  RolloutOptions rollout;  // step 0: chosen, see ChooseStep
  // Length of a shooting segment in the last stage, s; 0: chosen from the data.
  double segment = 0.0;
  // Standard deviation of position-like measurements; 0: estimated per channel.
  double noise = 0.0;
  OrientationResidual orientation = OrientationResidual::kHeading;
  RobustLoss loss = RobustLoss::kNone;
  double loss_scale = 3.0;  // standard deviations
  int threads = 1;
  int max_iterations = 400;  // over all stages
  // What a chosen step may change, in standard deviations (ChooseStep).
  double step_error = 0.2;
  std::function<void(const Progress&)> progress;  // may be empty
  // Asks a running fit to stop, which then throws Cancelled (cancelled.h).
  std::stop_token stop;
  // FitLevenbergMarquardt, FitAdam and FitGaussianMixture return the best point
  // so far instead, not converged, where there is one.
  bool keep_best = false;
};

// A run as the estimators use it. `measurements.run` points into it, so it is
// built once and not copied.
struct RunData {
  Run run;
  Measurements measurements;
  std::vector<double> sigma;  // per channel, SI
};

// What is fitted to what: a model, its free parameters, runs.
class ShootingProblem {
 public:
  // Estimates the noise where the options do not give it. The runs keep their
  // order.
  ShootingProblem(const Model& model, std::vector<FreeParameter> free,
                  std::vector<Run> runs, const EstimationOptions& options);
  ShootingProblem(const ShootingProblem&) = delete;
  ShootingProblem& operator=(const ShootingProblem&) = delete;

  const Model& model() const { return model_; }
  const ParameterMap& map() const { return *map_; }
  const std::vector<FreeParameter>& free() const { return free_; }
  const std::vector<std::unique_ptr<RunData>>& runs() const { return runs_; }
  const EstimationOptions& options() const { return options_; }
  EstimationOptions* mutable_options() { return &options_; }
  // The noise of the same channels elsewhere: held-out runs are judged by that
  // of the fitted ones.
  void UseNoiseOf(const ShootingProblem& other);

  // The start of the estimation.
  Eigen::VectorXd InitialTheta() const;
  // The noise of a joint's position, or a stand-in where it is not measured.
  double JointSigma(int joint) const;
  // Root mean square of the channels' sigmas that are position-like: `noise` of
  // fit.json.
  double PooledNoise() const;
  double LongestDuration() const;     // of a run, s
  double MedianSamplePeriod() const;  // over all runs, s
  // Independent numbers that an average sample of all runs measures.
  double DofPerSample() const;

 private:
  Model model_;
  std::vector<FreeParameter> free_;
  std::unique_ptr<ParameterMap> map_;
  std::vector<std::unique_ptr<RunData>> runs_;
  EstimationOptions options_;
};

// The unknowns of multiple shooting: theta, and for each run the state at the
// first sample of each segment. Segment k of a run covers samples[k] to
// samples[k + 1].
struct ShootingPoint {
  struct Nodes {
    std::vector<int> samples;  // segments + 1
    RowMatrixXd states;        // segments x state_size
    int segments() const { return static_cast<int>(samples.size()) - 1; }
  };
  Eigen::VectorXd theta;
  std::vector<Nodes> runs;
};

// A segment of a point, and all of them in the order of runs and time.
struct SegmentPlace {
  int run;
  int segment;
};
std::vector<SegmentPlace> AllSegments(const ShootingPoint& point);

// Cuts a run into segments of about `length` seconds (all of the same number of
// samples, within one), each of at least `min_samples`; one segment where the
// run is too short for two. Returns samples as in ShootingPoint::Nodes.
std::vector<int> CutRun(const std::vector<double>& t, double length,
                        int min_samples);

// The states at every sample, by rolling every segment out; by all threads.
// samples x state_size; false where the dynamics fail.
bool SampleStates(const ShootingProblem& problem, const ShootingPoint& point,
                  int run, RowMatrixXd* states);

}  // namespace sysid
