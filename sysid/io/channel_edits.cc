#include "sysid/io/channel_edits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "models/error.h"
#include "models/math/constants.h"
#include "sysid/io/csv.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

constexpr char kShiftHint[] =
    "write column=seconds, the delay with which it was recorded: "
    "joint1.q=0.010 (of one run: run.csv/joint1.q=0.010)";
constexpr char kIgnoreHint[] =
    "write column@from:to in seconds: joint1.q@12.3:14.5 (of one run: "
    "run.csv/joint1.q@12.3:14.5)";

std::vector<std::string> Entries(const std::string& text,
                                 const std::string& place,
                                 const std::string& hint) {
  std::vector<std::string> entries;
  if (Trim(text).empty()) return entries;
  for (size_t from = 0;;) {
    const size_t comma = text.find(',', from);
    const size_t length = comma == std::string::npos ? comma : comma - from;
    entries.emplace_back(Trim(std::string_view(text).substr(from, length)));
    if (entries.back().empty()) {
      throw InputError(place, "has an empty entry: '" + text + "'", hint);
    }
    if (comma == std::string::npos) return entries;
    from = comma + 1;
  }
}

double Seconds(const std::string& text, const std::string& entry,
               const std::string& place, const std::string& hint) {
  double value = 0.0;
  if (!ParseNumber(Trim(text), &value) || !std::isfinite(value)) {
    throw InputError(
        place, "'" + text + "' is not a number of seconds, in '" + entry + "'",
        hint);
  }
  return value;
}

// The group of columns that a name is one of, or that has the name itself.
const ColumnGroup* FindGroup(const std::vector<ColumnGroup>& groups,
                             const std::string& name) {
  for (const ColumnGroup& group : groups) {
    for (const std::string& column : group.columns) {
      if (column == name) return &group;
    }
  }
  return nullptr;
}

// Every group of the name: of a column, or of all that is measured of a joint
// or link.
std::vector<const ColumnGroup*> GroupsOf(const std::vector<ColumnGroup>& groups,
                                         const std::string& name) {
  if (const ColumnGroup* one = FindGroup(groups, name)) return {one};
  std::vector<const ColumnGroup*> all;
  for (const ColumnGroup& group : groups) {
    const std::string& column = group.columns.front();
    if (!group.is_effort && column.substr(0, column.rfind('.')) == name) {
      all.push_back(&group);
    }
  }
  return all;
}

ScopedName SplitScoped(const std::string& text,
                       const std::vector<ColumnGroup>& groups) {
  return SplitScope(text, [&](const std::string& name) {
    return !GroupsOf(groups, name).empty();
  });
}

// A shift, named without its run, and the groups that it moves.
struct GroupShift {
  ChannelShift shift;
  std::vector<const ColumnGroup*> groups;
};

// Those of a run. Each group moves once: of several that name it, for this run
// rather than all, by the column rather than the joint.
std::vector<GroupShift> ShiftsOf(const std::vector<ChannelShift>& shifts,
                                 const std::vector<ColumnGroup>& groups,
                                 const std::string& run) {
  using Rank = std::array<bool, 2>;
  std::vector<GroupShift> all;
  std::vector<Rank> ranks;
  std::map<const ColumnGroup*, size_t> winners;
  for (const ChannelShift& shift : shifts) {
    const ScopedName scoped = SplitScoped(shift.name, groups);
    if (!scoped.IsFor(run)) continue;
    all.push_back({shift, {}});
    all.back().shift.name = scoped.name;
    ranks.push_back(
        {!scoped.run.empty(), FindGroup(groups, scoped.name) != nullptr});
    for (const ColumnGroup* group : GroupsOf(groups, scoped.name)) {
      const auto [at, is_new] = winners.emplace(group, all.size() - 1);
      if (ranks.back() > ranks[at->second]) at->second = all.size() - 1;
    }
  }
  for (size_t i = 0; i < all.size(); ++i) {
    for (const ColumnGroup* group : GroupsOf(groups, all[i].shift.name)) {
      const size_t winner = winners.at(group);
      const ChannelShift& other = all[winner].shift;
      if (ranks[i] != ranks[winner] || all[i].shift.delay == other.delay) {
        continue;
      }
      throw InputError(all[i].shift.place,
                       "'" + other.name + "' and '" + all[i].shift.name +
                           "' are shifted together, and by different times",
                       "name one of them");
    }
  }
  for (const ColumnGroup& group : groups) {
    const auto at = winners.find(&group);
    if (at != winners.end()) all[at->second].groups.push_back(&group);
  }
  return all;
}

// A delay that is a whole number of even samples, within a hundredth of one.
std::optional<int> WholeSamples(const std::vector<double>& t, double delay) {
  const int n = static_cast<int>(t.size());
  const double period = (t.back() - t.front()) / (n - 1);
  for (int k = 1; k < n; ++k) {
    if (std::abs(t[k] - t[k - 1] - period) > 0.01 * period) return {};
  }
  const double samples = delay / period;
  if (std::abs(samples - std::round(samples)) > 0.01) return {};
  return static_cast<int>(std::round(samples));
}

// Values at t from rows i - 1 .. i + 2, t within [t_i, t_{i+1}]: Hermite's
// cubic with the slopes of its neighbours' chords. Angles across a wrap are
// taken the short way.
double Cubic(const std::vector<double>& t, const RowMatrixXd& y, int c, int i,
             double at, bool wraps) {
  const int n = static_cast<int>(t.size());
  const auto value = [&](int k) {
    double v = y(k, c);
    if (wraps) v -= 2 * M_PI * std::round((v - y(i, c)) / (2 * M_PI));
    return v;
  };
  const double h = t[i + 1] - t[i];
  const double chord = (value(i + 1) - value(i)) / h;
  const auto slope = [&](int k) {
    if (k == 0 || k == n - 1) return chord;
    const double s = (value(k + 1) - value(k - 1)) / (t[k + 1] - t[k - 1]);
    return std::isnan(s) ? chord : s;
  };
  const double s = (at - t[i]) / h;
  const double m0 = h * slope(i), m1 = h * slope(i + 1);
  const double a = value(i), b = value(i + 1);
  return a + s * (m0 + s * (3 * (b - a) - 2 * m0 - m1 +
                            s * (2 * (a - b) + m0 + m1)));
}

void Slerp(const RowMatrixXd& y, int i, double s, Eigen::Ref<RowMatrixXd> row) {
  const auto quaternion = [&](int k) {
    return Eigen::Quaterniond(y(k, 3), y(k, 0), y(k, 1), y(k, 2));
  };
  const Eigen::Quaterniond q = quaternion(i).slerp(s, quaternion(i + 1));
  row = q.coeffs().transpose();
}

void ShiftChannel(const std::vector<double>& t, double delay,
                  Channel* channel) {
  const int n = static_cast<int>(t.size());
  if (n < 2 || delay == 0.0) return;
  const RowMatrixXd from = channel->values;
  channel->values.setConstant(kNaN);
  if (const std::optional<int> whole = WholeSamples(t, delay)) {
    for (int k = 0; k < n; ++k) {
      const int i = k + *whole;
      if (i >= 0 && i < n) channel->values.row(k) = from.row(i);
    }
    return;
  }
  const bool wraps = IsScalarPosition(channel->kind);
  int i = 0;
  for (int k = 0; k < n; ++k) {
    const double at = t[k] + delay;
    if (at < t.front() || at > t.back()) continue;
    while (i > 0 && t[i] > at) --i;
    while (i + 2 < n && t[i + 1] < at) ++i;
    if (channel->kind == ChannelKind::kOrientation) {
      Slerp(from, i, (at - t[i]) / (t[i + 1] - t[i]), channel->values.row(k));
      continue;
    }
    for (int c = 0; c < from.cols(); ++c) {
      channel->values(k, c) = Cubic(t, from, c, i, at, wraps);
    }
    if (channel->values.row(k).hasNaN()) {
      channel->values.row(k).setConstant(kNaN);
    }
  }
}

// The effort that was recorded for [t_i, t_{i+1}) acts from t_i - delay; over a
// sample of the new grid its mean is what moves the mechanism.
void ShiftEffort(const std::vector<double>& t, double delay, int first,
                 int size, RowMatrixXd* effort) {
  const int n = static_cast<int>(t.size());
  if (n < 2 || delay == 0.0) return;
  const RowMatrixXd from = effort->middleCols(first, size);
  if (const std::optional<int> whole = WholeSamples(t, delay)) {
    for (int k = 0; k < n; ++k) {
      const int i = std::clamp(k + *whole, 0, n - 1);
      effort->row(k).segment(first, size) = from.row(i);
    }
    return;
  }
  // The impulse up to t[i], and from there at the rate of row i.
  RowMatrixXd impulse = RowMatrixXd::Zero(n, size);
  for (int k = 1; k < n; ++k) {
    impulse.row(k) = impulse.row(k - 1) + (t[k] - t[k - 1]) * from.row(k - 1);
  }
  int i = 0;
  const auto impulse_at = [&](double at) -> Eigen::RowVectorXd {
    if (at <= t.front()) return (at - t.front()) * from.row(0);
    while (i > 0 && t[i] > at) --i;
    while (i + 1 < n && t[i + 1] <= at) ++i;
    return impulse.row(i) + (at - t[i]) * from.row(i);
  };
  for (int k = 0; k < n; ++k) {
    const double h = k + 1 < n ? t[k + 1] - t[k] : t[k] - t[k - 1];
    const Eigen::RowVectorXd begin = impulse_at(t[k] + delay);
    effort->row(k).segment(first, size) =
        (impulse_at(t[k] + h + delay) - begin) / h;
  }
}

}  // namespace

std::vector<ChannelShift> ParseShifts(const std::string& text,
                                      const std::string& place) {
  std::vector<ChannelShift> shifts;
  for (const std::string& entry : Entries(text, place, kShiftHint)) {
    const size_t equals = entry.rfind('=');  // a file's name may have one
    if (equals == std::string::npos || equals == 0) {
      throw InputError(place, "'" + entry + "' is no shift", kShiftHint);
    }
    ChannelShift shift;
    shift.name = Trim(std::string_view(entry).substr(0, equals));
    shift.delay = Seconds(entry.substr(equals + 1), entry, place, kShiftHint);
    shift.place = place;
    for (const ChannelShift& known : shifts) {
      if (known.name == shift.name) {
        throw InputError(place, "'" + shift.name + "' is shifted twice",
                         "name it once");
      }
    }
    shifts.push_back(shift);
  }
  return shifts;
}

std::vector<IgnoredSpan> ParseIgnored(const std::string& text,
                                      const std::string& place) {
  std::vector<IgnoredSpan> spans;
  for (const std::string& entry : Entries(text, place, kIgnoreHint)) {
    const size_t at = entry.rfind('@');
    const size_t colon = entry.find(':', at == std::string::npos ? 0 : at);
    if (at == std::string::npos || at == 0 || colon == std::string::npos) {
      throw InputError(place, "'" + entry + "' is no span of a column",
                       kIgnoreHint);
    }
    IgnoredSpan span;
    span.name = Trim(std::string_view(entry).substr(0, at));
    span.t_start = Seconds(entry.substr(at + 1, colon - at - 1), entry, place,
                           kIgnoreHint);
    span.t_end = Seconds(entry.substr(colon + 1), entry, place, kIgnoreHint);
    if (span.t_end < span.t_start) {
      throw InputError(place, "'" + entry + "' ends before it begins",
                       kIgnoreHint);
    }
    span.place = place;
    spans.push_back(span);
  }
  return spans;
}

std::string ToString(const ChannelShift& shift) {
  return shift.name + "=" + ShortestText(shift.delay);
}

std::string ToString(const IgnoredSpan& span) {
  return span.name + "@" + ShortestText(span.t_start) + ":" +
         ShortestText(span.t_end);
}

ChannelEdits MergeEdits(const ChannelEdits& base, const ChannelEdits& winner,
                        const Mechanism& mechanism) {
  const std::vector<ColumnGroup> groups = RunColumnGroups(mechanism);
  ChannelEdits merged = winner;
  for (const ChannelShift& shift : base.shifts) {
    const ScopedName own = SplitScoped(shift.name, groups);
    const std::vector<const ColumnGroup*> moved = GroupsOf(groups, own.name);
    const auto overrules = [&](const ChannelShift& other) {
      const ScopedName name = SplitScoped(other.name, groups);
      if (name.run != own.run) return false;
      const std::vector<const ColumnGroup*> all = GroupsOf(groups, name.name);
      return !moved.empty() &&
             std::all_of(moved.begin(), moved.end(), [&](const ColumnGroup* g) {
               return Contains(all, g);
             });
    };
    if (std::none_of(winner.shifts.begin(), winner.shifts.end(), overrules)) {
      merged.shifts.push_back(shift);
    }
  }
  merged.ignored.insert(merged.ignored.end(), base.ignored.begin(),
                        base.ignored.end());
  return merged;
}

void CheckEdits(const ChannelEdits& edits, const Mechanism& mechanism) {
  const std::vector<ColumnGroup> groups = RunColumnGroups(mechanism);
  const auto check = [&](const std::string& text, const std::string& place,
                         bool may_be_effort) {
    const std::string name = SplitScoped(text, groups).name;
    const std::vector<const ColumnGroup*> found = GroupsOf(groups, name);
    if (name == "t") {
      throw InputError(place, "'t' is the time, and no measurement",
                       "name what was measured: joint1.q");
    }
    if (found.empty()) {
      const ColumnNameFault fault = ExplainUnknownColumn(name, mechanism);
      throw InputError(place, fault.what, fault.hint);
    }
    if (found.front()->is_effort && !may_be_effort) {
      throw InputError(place, "the effort '" + name + "' cannot be missing",
                       "an effort acts at all times; leave the time out by "
                       "ignoring what was measured there");
    }
  };
  for (const ChannelShift& shift : edits.shifts) {
    check(shift.name, shift.place, true);
  }
  for (const IgnoredSpan& span : edits.ignored) {
    check(span.name, span.place, false);
  }
}

ScopedName EditedName(const std::string& text, const Mechanism& mechanism) {
  return SplitScoped(text, RunColumnGroups(mechanism));
}

void ApplyEdits(const ChannelEdits& edits, const Mechanism& mechanism, Run* run,
                std::vector<std::string>* notices) {
  const std::vector<ColumnGroup> groups = RunColumnGroups(mechanism);
  const auto note = [&](const std::string& text) {
    if (notices != nullptr) notices->push_back(run->name + ": " + text);
  };
  for (const GroupShift& shifted : ShiftsOf(edits.shifts, groups, run->name)) {
    const ChannelShift& shift = shifted.shift;
    if (std::abs(shift.delay) >= 0.5 * (run->t.back() - run->t.front())) {
      throw InputError(shift.place,
                       "a shift of '" + shift.name + "' by " +
                           ShortestText(shift.delay) + " s leaves little of " +
                           run->name,
                       "it is in seconds: 10 ms are 0.010");
    }
    bool any = shifted.groups.empty();  // others win
    for (const ColumnGroup* group : shifted.groups) {
      if (group->is_effort) {
        const Joint& joint = mechanism.joints[group->target];
        ShiftEffort(run->t, shift.delay, joint.v_index, VelocitySize(joint),
                    &run->effort);
        any = true;
      } else if (Channel* channel =
                     FindChannel(run, group->kind, group->target)) {
        ShiftChannel(run->t, shift.delay, channel);
        any = true;
      }
    }
    if (!any) note("has no column '" + shift.name + "' to shift");
  }
  for (const IgnoredSpan& span : edits.ignored) {
    const ScopedName scoped = SplitScoped(span.name, groups);
    if (!scoped.IsFor(run->name)) continue;
    bool any = false;
    for (const ColumnGroup* group : GroupsOf(groups, scoped.name)) {
      Channel* channel = FindChannel(run, group->kind, group->target);
      if (channel == nullptr) continue;
      for (int k = 0; k < run->size(); ++k) {
        if (run->t[k] < span.t_start || run->t[k] > span.t_end) continue;
        channel->values.row(k).setConstant(kNaN);
        any = true;
      }
    }
    if (!any) {
      note("has nothing of '" + scoped.name + "' to ignore between " +
           ShortestText(span.t_start) + " s and " + ShortestText(span.t_end) +
           " s");
    }
  }
}

void DropUnmeasured(const std::string& place, Run* run,
                    std::vector<std::string>* notices) {
  for (const Channel& channel : run->channels) {
    if (channel.values.array().isNaN().all()) {
      if (notices == nullptr) continue;
      notices->push_back(run->name + ": nothing of " + channel.name +
                         " is left: it was not measured");
    }
  }
  const size_t before = run->channels.size();
  std::erase_if(run->channels, [](const Channel& channel) {
    return channel.values.array().isNaN().all();
  });
  if (run->channels.empty() && before > 0) {
    throw InputError(place, "nothing of " + run->name + " is left",
                     "leave the run out");
  }
}

}  // namespace sysid
