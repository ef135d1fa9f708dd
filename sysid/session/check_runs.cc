#include "sysid/session/check_runs.h"

#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "models/error.h"
#include "sysid/checks/excerpt.h"
#include "sysid/io/cell.h"
#include "sysid/io/unreadable_run.h"

namespace sysid {
namespace {

std::string Seconds(double value) { return RoundedText(value) + " s"; }

void CheckUnit(const Run& run, double period) {
  constexpr double kLongest = 1.0;  // s: of mechanisms that move
  const std::string& column = run.time_source;
  if (column.empty() || period <= kLongest * (1 + 1e-9)) return;
  throw MisreadColumn("milliseconds", run.name,
                      "its samples are " + Seconds(period) +
                          " apart: is the time in milliseconds?",
                      "--columns t=" + column +
                          "*0.001  (if it is seconds after all: t=" + column +
                          "*1)",
                      "t", column + "*0.001");
}

void CheckPauses(const Run& run, double period) {
  constexpr double kSamples = 1000, kLongest = 10.0;  // s
  for (int k = 1; k < run.size(); ++k) {
    const double pause = run.t[k] - run.t[k - 1];
    if (pause <= std::max(kLongest, kSamples * period)) continue;
    throw UnreadableRun("gap", run.name,
                        "nothing was sampled from " + Seconds(run.t[k - 1]) +
                            " to " + Seconds(run.t[k]) +
                            ": too long to predict across",
                        "split it there into two files, and give both");
  }
}

}  // namespace

double Range(const Channel& channel) {
  constexpr int kNumbers = Eigen::PropagateNumbers;  // not those missing
  double most = 0.0;
  for (const auto& component : channel.values.colwise()) {
    most = std::max(
        most, component.maxCoeff<kNumbers>() - component.minCoeff<kNumbers>());
  }
  return most;
}

void CheckMotion(const std::vector<Run>& runs) {
  for (const Run& run : runs) {
    for (const Channel& channel : run.channels) {
      if (Range(channel) > 0) return;
    }
  }
  if (runs.empty()) return;
  throw UnreadableRun("still", runs.front().name,
                      "nothing that was measured ever changes",
                      "a mechanism at rest tells nothing of its parameters: "
                      "record a motion");
}

void CheckDistinct(const std::vector<std::string>& traj,
                   const std::vector<std::string>& holdout) {
  std::set<std::string> names;
  std::set<std::pair<dev_t, ino_t>> files;
  // Whether a file is new, whatever it is called; remembers it.
  const auto is_new = [&](const std::string& file) {
    struct stat status {};
    return names.insert(file).second &&
           (stat(file.c_str(), &status) != 0 ||
            files.emplace(status.st_dev, status.st_ino).second);
  };
  for (const std::string& file : traj) {
    if (!is_new(file)) {
      throw InputError("--traj", "'" + file + "' is given twice",
                       "give each recording once: what is counted twice makes "
                       "the intervals too narrow");
    }
  }
  for (const std::string& file : holdout) {
    if (!is_new(file)) {
      throw InputError("--holdout",
                       "'" + file + "' is fitted too, or given twice",
                       "hold out recordings that are not in --traj");
    }
  }
}

void CheckRunNames(const ColumnMap& columns, const ChannelEdits& edits,
                   const Mechanism& mechanism,
                   const std::vector<std::string>& files) {
  const auto check = [&](const ScopedName& scoped, const std::string& place) {
    for (const std::string& file : files) {
      if (scoped.IsFor(file)) return;
    }
    throw InputError(place, "there is no run '" + scoped.run + "'",
                     "--traj and --holdout name " + Join(files));
  };
  for (const ColumnMapping& entry : columns) {
    check(RunColumn(entry.name, mechanism), entry.place);
  }
  for (const ChannelShift& shift : edits.shifts) {
    check(EditedName(shift.name, mechanism), shift.place);
  }
  for (const IgnoredSpan& span : edits.ignored) {
    check(EditedName(span.name, mechanism), span.place);
  }
}

void CheckTimes(const std::vector<Run>& runs) {
  constexpr int kFewest = 5;  // samples: fewer say nothing beyond the state
  for (const Run& run : runs) {
    if (run.size() < kFewest) {
      throw UnreadableRun(
          "few_samples", run.name,
          "has " + std::to_string(run.size()) +
              " samples: too few to fit anything",
          "at least " + std::to_string(kFewest) + " are needed");
    }
    const double period = MedianPeriod(run.t);
    CheckUnit(run, period);
    CheckPauses(run, period);
  }
}

}  // namespace sysid
