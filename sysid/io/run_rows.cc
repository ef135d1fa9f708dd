#include "sysid/io/run_rows.h"

#include <algorithm>
#include <cmath>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/run_columns.h"

namespace sysid {

Run RowsOf(const Run& run, int first, int last) {
  Run rows;
  rows.name = run.name;
  rows.unread = run.unread;
  rows.time_source = run.time_source;
  rows.t.assign(run.t.begin() + first, run.t.begin() + last);
  rows.recorded_efforts = run.recorded_efforts;
  rows.effort = run.effort.middleRows(first, last - first);
  for (const Input& input : run.inputs) {
    rows.inputs.push_back(
        {input.name,
         input.held,
         {input.values.begin() + first, input.values.begin() + last}});
  }
  for (const Channel& channel : run.channels) {
    Channel part = channel;
    part.values = channel.values.middleRows(first, last - first);
    rows.channels.push_back(std::move(part));
  }
  return rows;
}

void CountTurns(const Mechanism& mechanism, Run* run,
                std::vector<std::string>* notices) {
  constexpr double kTurn = 2.0 * M_PI, kPart = 0.2, kRounding = 1e-3;
  std::vector<std::string> wrapped;
  for (Channel& channel : run->channels) {
    if (!IsScalarPosition(channel.kind) ||
        !IsRotation1(mechanism.joints[channel.target].type)) {
      continue;
    }
    constexpr int kNumbers = Eigen::PropagateNumbers;  // not those missing
    const double range = channel.values.maxCoeff<kNumbers>() -
                         channel.values.minCoeff<kNumbers>();
    if (!(range <= kTurn * (1.0 + kRounding))) continue;
    double turned = 0.0, before = std::nan("");
    size_t jumps = 0;
    for (int k = 0; k < channel.values.rows(); ++k) {
      double& now = channel.values(k, 0);
      if (std::isnan(now)) continue;
      const double turns = (now + turned - before) / kTurn;
      const double whole = std::round(turns);
      if (whole != 0.0 && std::abs(turns - whole) < kPart) {
        turned -= whole * kTurn;
        ++jumps;
      }
      now += turned;
      before = now;
    }
    if (jumps == 0) continue;
    wrapped.push_back(GroupOf(mechanism, channel).columns[0] + " (" +
                      CountOf(jumps, "time") + ")");
  }
  if (wrapped.empty() || notices == nullptr) return;
  notices->push_back(run->name + ": the sensor wraps, and its turns are " +
                     "counted on: " + Join(wrapped));
}

void BeginMeasured(Run* run, std::vector<std::string>* notices) {
  const auto is_measured = [&](int k) {
    return std::any_of(run->channels.begin(), run->channels.end(),
                       [&](const Channel& channel) {
                         return !channel.values.row(k).array().isNaN().all();
                       });
  };
  int first = 0;
  while (first < run->size() && !is_measured(first)) ++first;
  // Two rows are the least of a run.
  if (first == 0 || first + 2 > run->size()) return;
  *run = RowsOf(*run, first, run->size());
  if (notices == nullptr) return;
  notices->push_back(run->name + ": begins at " + RoundedText(run->t.front()) +
                     " s: nothing before is measured");
}

}  // namespace sysid
