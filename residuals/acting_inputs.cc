#include "residuals/acting_inputs.h"

#include <algorithm>

#include "glog/logging.h"

namespace sysid {
namespace {

const Input& InputOf(const Run& run, const std::string& name) {
  const Input* input = FindInput(run, name);
  CHECK(input != nullptr) << run.name << " has no " << name;
  return *input;
}

// Of an input that is linear between its rows; the first and last hold beyond.
double Interpolated(const Run& run, const Input& input, double time) {
  const int last = run.size() - 1;
  const int row = std::min(RowBefore(run, time), last);
  if (time <= run.t.front() || row == last) return input.values[row];
  const double part = (time - run.t[row]) / (run.t[row + 1] - run.t[row]);
  return input.values[row] + part * (input.values[row + 1] - input.values[row]);
}

}  // namespace

int RowBefore(const Run& run, double time) {
  const auto at = std::lower_bound(run.t.begin(), run.t.end(), time);
  return std::max(0, static_cast<int>(at - run.t.begin()) - 1);
}

void MeanEffort(const Run& run, double from, double to, double* mean) {
  const int nv = static_cast<int>(run.effort.cols());
  std::fill(mean, mean + nv, 0.0);
  // A window that ends at a row's time but for rounding ends at that row.
  int row = RowBefore(run, to - 1e-9 * (to - from));
  for (double end = to; end > from; --row) {
    const double begin = row == 0 ? from : std::max(from, run.t[row]);
    const double part = (end - begin) / (to - from);
    for (int i = 0; i < nv; ++i) mean[i] += part * run.effort(row, i);
    end = begin;
  }
}

double MeanInput(const Run& run, const std::string& name, double from,
                 double to) {
  if (name == kTimeInput) return 0.5 * (from + to);
  const Input& input = InputOf(run, name);
  double mean = 0.0;
  int row = RowBefore(run, to - 1e-9 * (to - from));
  for (double end = to; end > from; --row) {
    const double begin = row == 0 ? from : std::max(from, run.t[row]);
    const double part = (end - begin) / (to - from);
    // Linear within a row's time: its middle is its mean.
    mean += part * (input.held ? input.values[row]
                               : Interpolated(run, input, 0.5 * (begin + end)));
    end = begin;
  }
  return mean;
}

double InputBefore(const Run& run, const std::string& name, double time) {
  if (name == kTimeInput) return time;
  const Input& input = InputOf(run, name);
  return input.held ? input.values[RowBefore(run, time)]
                    : Interpolated(run, input, time);
}

}  // namespace sysid
