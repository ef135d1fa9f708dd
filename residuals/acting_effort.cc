#include "residuals/acting_effort.h"

#include <algorithm>

namespace sysid {

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

}  // namespace sysid
