#include "sysid/estimation/run_parts.h"

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
  if (first == 0) part.start = run.start;
  for (int k = first; k < end; k += stride) part.t.push_back(run.t[k]);
  part.recorded_efforts = run.recorded_efforts;
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

std::vector<Run> JoinEnds(const std::vector<Run>& runs,
                          const std::vector<Run>& ends) {
  std::vector<Run> joined;
  for (size_t r = 0; r < runs.size(); ++r) {
    const Run& end = ends[r];
    const auto cut =
        std::lower_bound(runs[r].t.begin(), runs[r].t.end(), end.t.front());
    // The sample of the cut is in both: only the end knows what acts after it.
    Run run = SamplesOf(runs[r], 0, cut - runs[r].t.begin(), 1);
    const auto append = [](const auto& more, auto* rows) {
      const auto before = *rows;
      rows->resize(before.rows() + more.rows(), before.cols());
      *rows << before, more;
    };
    run.t.insert(run.t.end(), end.t.begin(), end.t.end());
    append(end.effort, &run.effort);
    for (size_t i = 0; i < run.inputs.size(); ++i) {
      std::vector<double>& values = run.inputs[i].values;
      values.insert(values.end(), end.inputs[i].values.begin(),
                    end.inputs[i].values.end());
    }
    for (size_t c = 0; c < run.channels.size(); ++c) {
      append(end.channels[c].values, &run.channels[c].values);
    }
    joined.push_back(std::move(run));
  }
  return joined;
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
