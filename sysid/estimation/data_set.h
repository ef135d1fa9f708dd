#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "residuals/segment.h"
#include "sysid/estimation/processes.h"

namespace sysid {

// A recording with what compares a model with it. `measurements.run` points
// into it, so it is made once and not copied.
struct RunData {
  Run run;
  Measurements measurements;
  std::vector<double> sigma;  // per channel, SI
  // Per channel, how much there is to predict: the root mean square about its
  // mean, per independent number, SI (8.1). NaN where nothing was measured.
  std::vector<double> motion;
};

// How the numbers of a recording count.
struct MeasurementOptions {
  OrientationResidual orientation = OrientationResidual::kHeading;
  // Standard deviation of position-like measurements; 0: estimated per channel.
  double noise = 0.0;
  int threads = 1;
  // That share out the runs; null: one has all.
  std::shared_ptr<const Processes> processes;
};

inline const Processes& ProcessesOf(const MeasurementOptions& options) {
  return options.processes ? *options.processes : Alone();
}

// A channel of any run.
struct SensedChannel {
  std::string name, unit;
  ChannelKind kind = ChannelKind::kPosition;
  int target = -1;
  double sigma = 0.0;  // as RunData's
};

// Recordings of one mechanism: their samples, the residual of each channel and
// its noise, estimated once. Never changes; whoever needs it shares it.
//
// Of several processes each has its own runs; all else is of all runs.
class DataSet {
 public:
  // Estimates the noise where the options do not give it, but for channels
  // that are in `like` too: those have its noise. (Held-out runs are judged by
  // that of the fitted ones, thinned ones by that of all samples.) The runs
  // keep their order.
  DataSet(const Mechanism& mechanism, std::vector<Run> runs,
          const MeasurementOptions& options, const DataSet* like = nullptr);

  // About so many samples of it: runs spread evenly over the list of all
  // processes, whole, with the first. The same noise.
  std::shared_ptr<const DataSet> Part(double samples) const;

  const std::vector<std::shared_ptr<const RunData>>& runs() const {
    return runs_;
  }
  const MeasurementOptions& options() const { return options_; }
  // In the order of their first appearance.
  const std::vector<SensedChannel>& channels() const { return channels_; }
  // The place of a channel there.
  int PlaceOf(const std::string& channel) const { return places_.at(channel); }
  int run_count() const { return run_count_; }  // of all processes
  int first_run() const { return first_run_; }  // the place of runs()[0]

  // What measures a joint's position, or else its motor's; null: nothing.
  const SensedChannel* SensorOf(int joint) const;
  // The noise of that, or a stand-in.
  double JointSigma(int joint) const;
  // Root mean square of the channels' sigmas that are position-like: `noise` of
  // fit.json.
  double PooledNoise() const { return pooled_; }
  double LongestDuration() const { return longest_; }    // of a run, s
  double TotalDuration() const { return duration_; }     // of all runs, s
  double MedianSamplePeriod() const { return period_; }  // over all runs, s
  // Independent numbers that an average sample of all runs measures.
  double DofPerSample() const { return dof_per_sample_; }
  int samples() const { return samples_; }  // of all runs

 private:
  void Measure(const Processes& all);

  MeasurementOptions options_;
  std::vector<std::shared_ptr<const RunData>> runs_;
  std::vector<SensedChannel> channels_;
  std::map<std::string, int> places_;  // among those
  int run_count_ = 0, first_run_ = 0;
  double pooled_ = 0.0;
  double longest_ = 0.0, duration_ = 0.0;
  double period_ = 0.0, dof_per_sample_ = 0.0;
  int samples_ = 0;
};

// The recordings as they were given, to be changed.
std::vector<Run> RunsOf(const DataSet& data);

}  // namespace sysid
