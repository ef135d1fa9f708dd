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

namespace {

// Numbers of a sample of a channel.
int WidthOf(const Channel& channel) {
  switch (channel.kind) {
    case ChannelKind::kOrientation:
      return 4;
    case ChannelKind::kAngularVelocity:
      return 3;
    case ChannelKind::kFramePosition:
      return static_cast<int>(channel.axes.size());
    case ChannelKind::kPosition:
    case ChannelKind::kVelocity:
    case ChannelKind::kMotorPosition:
      return 1;
  }
  return 0;
}

std::string SizeText(Eigen::Index rows, Eigen::Index columns) {
  return std::to_string(rows) + " x " + std::to_string(columns);
}

}  // namespace

void CheckShape(const Run& run, const Mechanism& mechanism) {
  const auto refuse = [&](const std::string& what, const std::string& hint) {
    throw InputError(run.name, what, hint);
  };
  const auto check_size = [&](const std::string& what,
                              const RowMatrixXd& values, int columns) {
    if (values.rows() == run.size() && values.cols() == columns) return;
    refuse(what + " is " + SizeText(values.rows(), values.cols()) +
               ", not samples x numbers, " + SizeText(run.size(), columns),
           "give a row for each time");
  };
  for (int k = 0; k < run.size(); ++k) {
    if (std::isfinite(run.t[k]) && (k == 0 || run.t[k] > run.t[k - 1])) {
      continue;
    }
    refuse("the time does not rise at sample " + std::to_string(k),
           "times are in seconds, finite, each later than the one before");
  }
  if (run.channels.empty()) {
    refuse("measures nothing", "give channels: positions at least");
  }
  for (const Channel& channel : run.channels) {
    const size_t targets = channel.kind == ChannelKind::kFramePosition
                               ? mechanism.links.size()
                               : mechanism.joints.size();
    if (channel.target < 0 || channel.target >= static_cast<int>(targets)) {
      refuse("the target of channel '" + channel.name + "' is no joint or link",
             "give its index: Mechanism::FindJoint, FindLink");
    }
    check_size("channel '" + channel.name + "'", channel.values,
               WidthOf(channel));
  }
  check_size("the effort", run.effort, mechanism.nv);
  if (!run.recorded_efforts.empty() &&
      static_cast<int>(run.recorded_efforts.size()) != mechanism.nv) {
    refuse("it says of " + std::to_string(run.recorded_efforts.size()) +
               " efforts whether they were recorded, not of " +
               std::to_string(mechanism.nv),
           "say it of each, or of none");
  }
  if (!run.effort.allFinite()) {
    refuse("an effort is no number", "it acts from sample to sample");
  }
  for (const Input& input : run.inputs) {
    if (static_cast<int>(input.values.size()) != run.size()) {
      refuse("input '" + input.name + "' has " +
                 std::to_string(input.values.size()) + " values, not " +
                 std::to_string(run.size()),
             "give one for each time");
    }
    for (const double value : input.values) {
      if (std::isfinite(value)) continue;
      refuse("a value of input '" + input.name + "' is no number",
             "none may be missing");
    }
  }
}

}  // namespace sysid
