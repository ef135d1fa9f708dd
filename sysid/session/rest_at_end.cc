#include "sysid/session/rest_at_end.h"

#include <algorithm>
#include <cmath>

#include "sysid/io/cell.h"
#include "sysid/io/run_rows.h"

namespace sysid {
namespace {

// The last row at which the numbers are not where they end.
int LastMotion(const Eigen::VectorXd& values) {
  constexpr double kTail = 0.05, kTimes = 4.0, kPart = 2e-3;
  constexpr int kNumbers = Eigen::PropagateNumbers;  // not those missing
  const int rows = static_cast<int>(values.size());
  const int tail = std::max(1, static_cast<int>(kTail * rows));
  const auto end = values.tail(tail);
  const double low = end.minCoeff<kNumbers>(), high = end.maxCoeff<kNumbers>();
  const double range =
      values.maxCoeff<kNumbers>() - values.minCoeff<kNumbers>();
  if (!std::isfinite(low)) return rows - 1;
  const double near = std::max(kTimes * (high - low), kPart * range);
  int last = rows - 1;
  while (last >= 0 && !(std::abs(values[last] - 0.5 * (low + high)) > near)) {
    --last;
  }
  return last;
}

}  // namespace

void LeaveOutRestAtEnd(std::vector<Run>* runs,
                       std::vector<std::string>* notices) {
  constexpr double kKept = 1.0, kLeast = 0.1;  // s; of the run
  for (Run& run : *runs) {
    if (run.size() < 2 || !run.inputs.empty() || !run.effort.isZero(0.0)) {
      continue;
    }
    int last = 0;
    for (const Channel& channel : run.channels) {
      for (int c = 0; c < channel.values.cols(); ++c) {
        last = std::max(last, LastMotion(channel.values.col(c)));
      }
    }
    const double end = run.t[last] + kKept;
    const auto after = std::upper_bound(run.t.begin(), run.t.end(), end);
    if (last == 0 || after == run.t.end() ||
        run.t.back() - end < kLeast * (run.t.back() - run.t.front())) {
      continue;
    }
    notices->push_back(run.name + ": at rest from " + RoundedText(run.t[last]) +
                       " s to its end, which decides between no laws: left "
                       "out but for a second");
    run = RowsOf(run, 0, static_cast<int>(after - run.t.begin()));
  }
}

}  // namespace sysid
