#include "sysid/session/unshown_joints.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/run_columns.h"
#include "sysid/io/table_file.h"
#include "sysid/parameters/patterns.h"

namespace sysid {

// Many files are alike: the first few are looked into.
std::set<std::string> NamesInFiles(const Mechanism& mechanism,
                                   const std::vector<std::string>& files,
                                   const ColumnMap& columns) {
  constexpr size_t kMost = 20;
  std::set<std::string> names;
  for (size_t i = 0; i < std::min(files.size(), kMost); ++i) {
    for (const ColumnMapping& entry : ColumnsOf(columns, files[i], mechanism)) {
      names.insert(entry.name);
    }
    // A pipe is read once.
    std::error_code error;
    if (!std::filesystem::is_regular_file(files[i], error)) return {};
    try {
      const std::unique_ptr<TableFile> file = OpenTable(files[i]);
      names.insert(file->header().begin(), file->header().end());
    } catch (const InputError&) {
      return {};
    }
  }
  return names;
}

std::set<std::string> NamesInRuns(const Mechanism& mechanism,
                                  const std::vector<Run>& runs) {
  std::set<std::string> names;
  for (const Run& run : runs) {
    for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
      const Joint* const joint =
          group.is_effort ? &mechanism.joints[group.target] : nullptr;
      const bool has =
          joint != nullptr
              ? HasEffort(run, joint->v_index, VelocitySize(*joint))
              : FindChannel(run, group.kind, group.target) != nullptr;
      if (has) names.insert(group.columns.begin(), group.columns.end());
    }
    for (const Input& input : run.inputs) names.insert(input.name);
  }
  return names;
}

namespace {

struct ShownJoints {
  std::vector<bool> joints;
  bool frames = false, efforts = false, any = false;
};

ShownJoints FindShown(const Mechanism& mechanism,
                      const std::set<std::string>& names) {
  ShownJoints shown;
  shown.joints.assign(mechanism.joints.size(), false);
  const auto has = [&](const std::vector<std::string>& columns) {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const auto& name) { return names.contains(name); });
  };
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    if (!has(group.columns)) continue;
    if (!group.is_effort && group.kind == ChannelKind::kFramePosition) {
      shown.frames = true;
      continue;
    }
    shown.joints[group.target] = shown.any = true;
    shown.efforts |= group.is_effort;
  }
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    if (has({mechanism.joints[j].name + ".cmd"})) shown.joints[j] = true;
  }
  for (const FollowerEffort& effort : FollowerEfforts(mechanism)) {
    if (names.contains(effort.column)) shown.joints[effort.leader] = true;
  }
  return shown;
}

// joints[i] carries links[i + 1].
int ParentOf(const Mechanism& mechanism, int joint) {
  return mechanism.joints[joint].parent_link - 1;
}

// Whether a shown joint lies on the way from this one to the root, or this one
// on the way of a shown one.
bool IsFelt(const Mechanism& mechanism, const ShownJoints& shown, int joint) {
  for (int j = joint; j >= 0; j = ParentOf(mechanism, j)) {
    if (shown.joints[j]) return true;
  }
  for (size_t i = 0; i < shown.joints.size(); ++i) {
    if (!shown.joints[i]) continue;
    for (int j = static_cast<int>(i); j >= 0; j = ParentOf(mechanism, j)) {
      if (j == joint) return true;
    }
  }
  return false;
}

double NearestToZero(const Joint& joint) {
  const bool limited = joint.has_limits && joint.lower <= joint.upper &&
                       joint.type != JointType::kContinuous;
  return limited ? std::clamp(0.0, joint.lower, joint.upper) : 0.0;
}

}  // namespace

std::vector<NamedValue> LocksOfUnshown(const Mechanism& mechanism,
                                       const std::set<std::string>& names_shown,
                                       const std::vector<NamedValue>& locks,
                                       std::vector<std::string>* notices) {
  const ShownJoints shown = FindShown(mechanism, names_shown);
  if (shown.frames || !shown.any) return {};
  std::vector<NamedValue> found;
  std::vector<std::string> names;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const bool locked = std::any_of(
        locks.begin(), locks.end(),
        [&](const NamedValue& lock) { return Matches(lock.name, joint.name); });
    if (VelocitySize(joint) == 0 || shown.joints[j] || locked) continue;
    const bool has_motor = shown.efforts && joint.effort_limit > 0.0;
    if (!has_motor && IsFelt(mechanism, shown, static_cast<int>(j))) continue;
    const double at = NearestToZero(joint);
    found.push_back({joint.name, at, "--lock"});
    names.push_back(joint.name + (at == 0.0 ? "" : "=" + ShortestText(at)));
  }
  if (!names.empty()) {
    notices->push_back("no recording shows " + JoinSome(names) +
                       ": held still, at zero where no position is said "
                       "(--lock JOINT=POSITION holds one elsewhere)");
  }
  return found;
}

}  // namespace sysid
