#include "sysid/diagnosis/search_runs.h"

#include <algorithm>

#include "residuals/acting_inputs.h"

namespace sysid {
namespace {

// Every `stride`-th of the samples [first, end) of a run.
Run SamplesOf(const Run& run, int first, int end, int stride) {
  const int count = (end - first + stride - 1) / stride;
  const auto rows = Eigen::seqN(first, count, stride);
  Run part;
  part.name = run.name;
  for (int k = first; k < end; k += stride) part.t.push_back(run.t[k]);
  part.effort = run.effort(rows, Eigen::all);
  for (const Input& input : run.inputs) {
    part.inputs.push_back({input.name, input.held, {}});
    for (int k = first; k < end; k += stride) {
      part.inputs.back().values.push_back(input.values[k]);
    }
  }
  for (const Channel& channel : run.channels) {
    part.channels.push_back(channel);
    part.channels.back().values = channel.values(rows, Eigen::all);
  }
  return part;
}

}  // namespace

std::vector<Run> HoldOutLastQuarter(std::vector<Run>* runs) {
  std::vector<Run> held;
  for (Run& run : *runs) {
    const int last = run.size() - 1;
    const int cut = last - last / 4;
    held.push_back(SamplesOf(run, cut, last + 1, 1));
    run = SamplesOf(run, 0, cut + 1, 1);
  }
  return held;
}

int ThinRuns(double rate, std::vector<Run>* runs) {
  int largest = 1;
  for (Run& run : *runs) {
    const double duration = run.t.back() - run.t.front();
    const int n = static_cast<int>((run.size() - 1) / duration / rate);
    if (n < 2) continue;
    largest = std::max(largest, n);
    Run thin = SamplesOf(run, 0, run.size(), n);
    for (int i = 0; i + 1 < thin.size(); ++i) {
      MeanEffort(run, thin.t[i], thin.t[i + 1], thin.effort.row(i).data());
      for (Input& input : thin.inputs) {
        if (!input.held) continue;
        input.values[i] = MeanInput(run, input.name, thin.t[i], thin.t[i + 1]);
      }
    }
    run = std::move(thin);
  }
  return largest;
}

}  // namespace sysid
