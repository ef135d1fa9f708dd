#pragma once

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "models/parameters.h"
#include "residuals/costs.h"
#include "sysid/estimation/data_set.h"
#include "sysid/estimation/theta_equations.h"
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

struct EstimationOptions : MeasurementOptions {
  RolloutOptions rollout;  // step 0: chosen, see ChooseRollout; Solution has it
  // Length of a shooting segment in the last stage, s; 0: chosen from the data.
  double segment = 0.0;
  RobustLoss loss = RobustLoss::kNone;
  double loss_scale = 3.0;   // standard deviations
  int max_iterations = 400;  // over all stages
  // Part of the cost: a stage ends where all iterations that it has left would
  // gain less, at the pace of the last few.
  double least_gain = 0.0;
  // Normalised: so too the stage that makes one trajectory of a run, where
  // these would not bring the error below this. A fit with a finite one is made
  // for its error alone: Fit::horizon and Fit::open stay empty.
  double wanted_error = std::numeric_limits<double>::infinity();
  // What a chosen step may change, in standard deviations (ChooseRollout).
  double step_error = 0.2;
  // A chosen step is no shorter, s: what is stiffer is not followed. 0: as the
  // motion needs it.
  double shortest_step = 0.0;
  std::function<void(const Progress&)> progress;  // may be empty
  // Asks a running fit to stop, which then throws Cancelled (cancelled.h).
  std::stop_token stop;
  // FitLevenbergMarquardt, FitAdam and FitGaussianMixture return the best point
  // so far instead, not converged, where there is one.
  bool keep_best = false;
  // Joints (of nv) of which inverse dynamics takes the recorded effort for none
  // (effort_audit.h): their equations say nothing.
  std::vector<int> no_efforts;
  // How much a body of the URDF counts beside the data in inverse dynamics,
  // (11.8): so much as so many samples of noise. Its inertias are rough.
  double body_weight = 1.0;
};

// What is asked of data: a model, and which of its parameters are free, with
// their bounds and priors. Never changes.
struct Question {
  Question(const Model& m, std::vector<FreeParameter> f);
  Question(const Question&) = delete;  // the map points to the model
  Question& operator=(const Question&) = delete;

  const Model model;
  const std::vector<FreeParameter> free;
  const ParameterMap map;
};

// What is fitted to what, and how: a question, data and options. A value: a
// copy, with other options (With) or not, shares question and data.
class ShootingProblem {
 public:
  ShootingProblem(const Model& model, std::vector<FreeParameter> free,
                  std::shared_ptr<const DataSet> data,
                  const EstimationOptions& options);
  // With a data set of its own (MakeDataSet).
  ShootingProblem(const Model& model, std::vector<FreeParameter> free,
                  std::vector<Run> runs, const EstimationOptions& options);

  ShootingProblem With(const EstimationOptions& options) const;
  // Of this process by itself, its runs and no others.
  ShootingProblem Apart() const;
  ShootingProblem WithData(std::shared_ptr<const DataSet> data) const;
  // The same question, begun at theta.
  ShootingProblem StartingAt(Eigen::VectorXd theta) const;
  // The same question, of which these equations tell as well. A fit turns to
  // them where rollouts lose the motion.
  ShootingProblem WithEquations(
      std::shared_ptr<const ThetaEquations> equations) const;
  // The same question, its channels weighed by these errors (Misfit).
  ShootingProblem Weighing(std::map<std::string, double> misfit) const;

  const Model& model() const { return question_->model; }
  const ParameterMap& map() const { return question_->map; }
  const std::vector<FreeParameter>& free() const { return question_->free; }
  const DataSet& data() const { return *data_; }
  const std::shared_ptr<const DataSet>& shared_data() const { return data_; }
  const std::vector<std::shared_ptr<const RunData>>& runs() const {
    return data_->runs();
  }
  const EstimationOptions& options() const { return options_; }
  // That share out the runs.
  const Processes& processes() const { return ProcessesOf(options_); }

  // The start of the estimation: where StartingAt says, or at the initial
  // values of the free parameters.
  Eigen::VectorXd InitialTheta() const;

  // Null where there are none.
  const std::shared_ptr<const ThetaEquations>& equations() const {
    return equations_;
  }

  // Standard deviation of a channel's errors as a fit weighs them, in times its
  // noise: 1 where nothing is known of what the model misses.
  double Misfit(const std::string& channel) const;
  const std::map<std::string, double>& misfit() const { return misfit_; }

 private:
  std::shared_ptr<const Question> question_;
  std::shared_ptr<const DataSet> data_;
  EstimationOptions options_;
  Eigen::VectorXd start_;  // empty: the initial values
  std::map<std::string, double> misfit_;
  std::shared_ptr<const ThetaEquations> equations_;
};

// The data set that the options mean: their noise and residual.
std::shared_ptr<const DataSet> MakeDataSet(const Model& model,
                                           std::vector<Run> runs,
                                           const EstimationOptions& options);
// With the noise of another's channels.
std::shared_ptr<const DataSet> MakeDataSetLike(const Model& model,
                                               std::vector<Run> runs,
                                               const EstimationOptions& options,
                                               const DataSet& other);

// What a fit finds, and where the next one starts: theta, how the runs are cut
// into segments, and the state at the first sample of each. Segment k of a run
// covers samples[k] to samples[k + 1]. A value.
struct Solution {
  struct Nodes {
    std::vector<int> samples;  // segments + 1
    RowMatrixXd states;        // segments x state_size
    int segments() const { return static_cast<int>(samples.size()) - 1; }
    bool operator==(const Nodes&) const = default;
  };
  Eigen::VectorXd theta;
  std::vector<Nodes> runs;
  // How its segments are integrated: the step that was chosen is part of what
  // was found.
  RolloutOptions rollout;
  bool operator==(const Solution&) const = default;
};

// A segment of a point, and all of them in the order of runs and time.
struct SegmentPlace {
  int run;
  int segment;
};
std::vector<SegmentPlace> AllSegments(const Solution& point);

// Cuts a run into segments of about `length` seconds (all of the same number of
// samples, within one), each of at least `min_samples`; one segment where the
// run is too short for two. Returns samples as in Solution::Nodes.
std::vector<int> CutRun(const std::vector<double>& t, double length,
                        int min_samples);

// The states at every sample, by rolling every segment out; by all threads.
// samples x state_size; false where the dynamics fail.
bool SampleStates(const ShootingProblem& problem, const Solution& point,
                  int run, RowMatrixXd* states);

}  // namespace sysid
