#include "sysid/diagnosis/search_runs.h"

#include <algorithm>

#include "residuals/acting_effort.h"

namespace sysid {

std::vector<Run> HoldOutLastQuarter(std::vector<Run>* runs) {
  std::vector<Run> held;
  for (Run& run : *runs) {
    const int last = run.size() - 1;
    const int cut = last - last / 4;
    const auto rows = [&](int first, int count) {
      Run part;
      part.name = run.name;
      part.t.assign(run.t.begin() + first, run.t.begin() + first + count);
      part.effort = run.effort.middleRows(first, count);
      for (const Channel& channel : run.channels) {
        part.channels.push_back(channel);
        part.channels.back().values = channel.values.middleRows(first, count);
      }
      return part;
    };
    held.push_back(rows(cut, last - cut + 1));
    run = rows(0, cut + 1);
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
    Run thin;
    thin.name = run.name;
    std::vector<int> rows;
    for (int k = 0; k < run.size(); k += n) rows.push_back(k);
    thin.effort.resize(static_cast<int>(rows.size()), run.effort.cols());
    for (size_t i = 0; i < rows.size(); ++i) {
      thin.t.push_back(run.t[rows[i]]);
      thin.effort.row(i) = run.effort.row(rows[i]);
      if (i + 1 == rows.size()) continue;
      MeanEffort(run, run.t[rows[i]], run.t[rows[i + 1]],
                 thin.effort.row(i).data());
    }
    for (const Channel& channel : run.channels) {
      thin.channels.push_back(channel);
      thin.channels.back().values = channel.values(rows, Eigen::all);
    }
    run = std::move(thin);
  }
  return largest;
}

}  // namespace sysid
