#include "sysid/io/run_columns.h"

#include <utility>

#include "glog/logging.h"
#include "models/error.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

// "joint1.qw", "joint1.qx", ...
std::vector<std::string> Columns(const std::string& base,
                                 const std::vector<std::string>& suffixes) {
  std::vector<std::string> columns;
  for (const std::string& suffix : suffixes) {
    columns.push_back(base + "." + suffix);
  }
  return columns;
}

const std::vector<std::string>& Suffixes() {
  static const auto& suffixes = *new std::vector<std::string>{
      "q",  "qd", "motor_q", "tau",  "qw",   "qx",         "qy", "qz",
      "wx", "wy", "wz",      "taux", "tauy", "tauz",       "px", "py",
      "pz", "ax", "ay",      "az",   "cmd",  "temperature"};
  return suffixes;
}

// "joint1.q" -> "joint1", "q"; the name may have dots of its own.
bool Split(const std::string& name, std::string* base, std::string* suffix) {
  const size_t dot = name.rfind('.');
  if (dot == std::string::npos || dot == 0) return false;
  *base = name.substr(0, dot);
  *suffix = name.substr(dot + 1);
  return Contains(Suffixes(), *suffix);
}

// Those of a joint of this type.
void AddGroups(const std::string& name, JointType type, int target,
               std::vector<ColumnGroup>* groups) {
  const auto add = [&](ChannelKind kind, const std::string& channel,
                       const std::vector<std::string>& suffixes,
                       const std::vector<int>& slots = {0, 1, 2}) {
    groups->push_back({channel == name + ".tau", kind, target, channel,
                       Columns(name, suffixes), slots});
  };
  if (type == JointType::kSpherical) {
    add(ChannelKind::kOrientation, name, {"qw", "qx", "qy", "qz"},
        {3, 0, 1, 2});
    add(ChannelKind::kAngularVelocity, name + ".w", {"wx", "wy", "wz"});
    add(ChannelKind::kPosition, name + ".tau", {"taux", "tauy", "tauz"});
  } else {
    add(ChannelKind::kPosition, name, {"q"}, {0});
    add(ChannelKind::kVelocity, name + ".qd", {"qd"}, {0});
    add(ChannelKind::kMotorPosition, name + ".motor_q", {"motor_q"}, {0});
    add(ChannelKind::kPosition, name + ".tau", {"tau"}, {0});
  }
}

}  // namespace

std::vector<InputColumn> InputColumns(const Mechanism& mechanism) {
  std::vector<InputColumn> columns;
  for (const Joint& joint : mechanism.joints) {
    if (VelocitySize(joint) == 1) {
      columns.push_back({joint.name + ".cmd", true});
    }
    if (VelocitySize(joint) > 0) {
      columns.push_back({joint.name + ".temperature", false});
    }
  }
  for (const char* name : {"ax", "ay", "az", "px", "py", "pz"}) {
    columns.push_back({std::string("base.") + name, false});
  }
  for (const std::string& name : mechanism.inputs) {
    columns.push_back({name, false});
  }
  return columns;
}

std::vector<ColumnGroup> RunColumnGroups(const Mechanism& mechanism) {
  std::vector<ColumnGroup> groups;
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Joint& joint = mechanism.joints[i];
    if (VelocitySize(joint) == 0) continue;
    AddGroups(joint.name, joint.type, static_cast<int>(i), &groups);
  }
  for (size_t i = 0; i < mechanism.links.size(); ++i) {
    const std::string& name = mechanism.links[i].name;
    // A root of this name stands still: the columns are those of the base.
    if (i == 0 && name == "base") continue;
    groups.push_back({false,
                      ChannelKind::kFramePosition,
                      static_cast<int>(i),
                      name,
                      Columns(name, {"px", "py", "pz"}),
                      {0, 1, 2}});
  }
  return groups;
}

std::vector<ColumnGroup> HeldColumnGroups(const Mechanism& mechanism) {
  std::vector<ColumnGroup> groups;
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Joint& joint = mechanism.joints[i];
    if (!joint.held) continue;
    AddGroups(joint.name, joint.held->type, static_cast<int>(i), &groups);
  }
  return groups;
}

std::vector<std::string> HeldColumnNames(const Mechanism& mechanism) {
  std::vector<std::string> names;
  for (const ColumnGroup& group : HeldColumnGroups(mechanism)) {
    names.insert(names.end(), group.columns.begin(), group.columns.end());
  }
  return names;
}

std::vector<FollowerEffort> FollowerEfforts(const Mechanism& mechanism) {
  std::vector<FollowerEffort> efforts;
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Joint& joint = mechanism.joints[i];
    if (!joint.mimic) continue;
    const Followed followed = FollowedBy(mechanism, static_cast<int>(i));
    if (VelocitySize(mechanism.joints[followed.joint]) != 1) continue;
    efforts.push_back(
        {joint.name + ".tau", followed.joint, followed.multiplier});
  }
  return efforts;
}

std::vector<std::string> FollowerColumnNames(const Mechanism& mechanism) {
  std::vector<std::string> names;
  for (const FollowerEffort& effort : FollowerEfforts(mechanism)) {
    names.push_back(effort.column);
  }
  return names;
}

ColumnGroup AlongAxes(const ColumnGroup& group, const std::vector<int>& axes) {
  if (group.is_effort || group.kind != ChannelKind::kFramePosition) {
    return group;
  }
  ColumnGroup along = group;
  along.columns.clear();
  along.slots.clear();
  for (const int axis : axes) {
    along.slots.push_back(static_cast<int>(along.columns.size()));
    along.columns.push_back(group.columns[axis]);
  }
  return along;
}

ColumnGroup GroupOf(const Mechanism& mechanism, const Channel& channel) {
  const std::vector<ColumnGroup> groups = RunColumnGroups(mechanism);
  const auto group =
      std::find_if(groups.begin(), groups.end(), [&](const ColumnGroup& g) {
        return !g.is_effort && g.kind == channel.kind &&
               g.target == channel.target;
      });
  CHECK(group != groups.end()) << channel.name;
  return AlongAxes(*group, channel.axes);
}

const Channel* FindChannel(const Run& run, ChannelKind kind, int target) {
  for (const Channel& channel : run.channels) {
    if (channel.kind == kind && channel.target == target) return &channel;
  }
  return nullptr;
}

// The run is the caller's to change.
Channel* FindChannel(Run* run, ChannelKind kind, int target) {
  return const_cast<Channel*>(FindChannel(std::as_const(*run), kind, target));
}

std::vector<std::string> RunColumnNames(const Mechanism& mechanism) {
  std::vector<std::string> names = {"t"};
  for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
    names.insert(names.end(), group.columns.begin(), group.columns.end());
  }
  for (const InputColumn& input : InputColumns(mechanism)) {
    if (!Contains(names, input.name)) names.push_back(input.name);
  }
  return names;
}

bool HasRunColumnSuffix(const std::string& name) {
  std::string base, suffix;
  return Split(name, &base, &suffix);
}

ColumnNameFault ExplainUnknownColumn(const std::string& name,
                                     const Mechanism& mechanism) {
  const std::string quoted = "'" + name + "'";
  std::string base, suffix;
  if (!Split(name, &base, &suffix)) {
    const std::vector<std::string> names = RunColumnNames(mechanism);
    return {quoted + " is not a column of a run", NameHint(name, names)};
  }
  const bool of_link = suffix[0] == 'p';
  if (suffix[0] == 'a') {
    return {"only the base has a column " + quoted,
            "its acceleration is base.ax, base.ay, base.az"};
  }
  const int j = mechanism.FindJoint(base);
  if (j >= 0 && !of_link) {
    const Joint& joint = mechanism.joints[j];
    if (joint.mimic && !joint.held) {
      const Followed followed = FollowedBy(mechanism, j);
      const std::string& leader = mechanism.joints[followed.joint].name;
      return {"joint '" + base + "' follows joint '" + leader +
                  "' (<mimic>) and has no column " + quoted,
              "measure that one, or leave its <mimic> out"};
    }
    if (joint.held) {
      return {"joint '" + base + "' is held still (--lock) and has no column " +
                  quoted,
              "leave the column out, or do not lock the joint"};
    }
    std::vector<std::string> columns;
    for (const ColumnGroup& group : RunColumnGroups(mechanism)) {
      if (group.kind == ChannelKind::kFramePosition || group.target != j) {
        continue;
      }
      columns.insert(columns.end(), group.columns.begin(), group.columns.end());
    }
    return {"joint '" + base + "' is " + ToString(joint.type) +
                " and has no column " + quoted,
            columns.empty()
                ? "leave the column out; if the joint moves, give it "
                  "another type in the URDF (revolute, ...)"
                : "its columns are " + Join(columns)};
  }
  const std::vector<std::string> bases =
      of_link ? mechanism.LinkNames() : mechanism.JointNames();
  const std::string kind = of_link ? "link '" : "joint '";
  const std::string nearest = NearestName(base, bases);
  return {"the model has no " + kind + base + "' (column " + quoted + ")",
          nearest.empty() ? NameHint(base, bases)
                          : "did you mean '" + nearest + "." + suffix + "'?"};
}

}  // namespace sysid
