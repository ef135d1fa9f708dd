#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"

namespace sysid {

// The columns of a run that belong together (docs/interface.md section 2):
// J.q; J.qd; J.motor_q; J.tau; J.qw..qz; J.wx..wz; J.taux..tauz; F.px..pz.
struct ColumnGroup {
  bool is_effort = false;  // else a channel of this kind:
  ChannelKind kind = ChannelKind::kPosition;
  int target = -1;   // joint index, or link index of a frame position
  std::string name;  // of the channel: "joint1", "joint1.qd", "joint1.w", "tip"
  std::vector<std::string> columns;  // in the order of the file
  // columns[i] is number slots[i] of the channel's row (a quaternion is
  // w, x, y, z in files and x, y, z, w in memory).
  std::vector<int> slots;
};

// Every group that a recording of this mechanism could have: the moving joints
// in order, then the links.
std::vector<ColumnGroup> RunColumnGroups(const Mechanism& mechanism);

// What effects may read beside efforts (docs/interface.md section 2): the
// columns J.cmd and J.temperature of joints, base.ax..az and base.px..pz of the
// base, and what the mechanism names (Mechanism::inputs).
struct InputColumn {
  std::string name;
  bool held = false;  // as Input::held
};
std::vector<InputColumn> InputColumns(const Mechanism& mechanism);

// Those that the joints would have which are held still (--lock), and their
// columns.
std::vector<ColumnGroup> HeldColumnGroups(const Mechanism& mechanism);
std::vector<std::string> HeldColumnNames(const Mechanism& mechanism);

// An effort that a joint which follows another (<mimic>) would have: it acts on
// the joint that moves, times the multiplier.
struct FollowerEffort {
  std::string column;  // "finger_right.tau"
  int leader = -1;     // joint index
  double multiplier = 1.0;
};
std::vector<FollowerEffort> FollowerEfforts(const Mechanism& mechanism);
std::vector<std::string> FollowerColumnNames(const Mechanism& mechanism);

// Of a frame position's group what is measured along these of its axes; any
// other group as it is.
ColumnGroup AlongAxes(const ColumnGroup& group, const std::vector<int>& axes);

// The columns of a channel.
ColumnGroup GroupOf(const Mechanism& mechanism, const Channel& channel);

// The channel of a run that measures this; null where none does.
Channel* FindChannel(Run* run, ChannelKind kind, int target);
const Channel* FindChannel(const Run& run, ChannelKind kind, int target);

// All their columns, "t" first.
std::vector<std::string> RunColumnNames(const Mechanism& mechanism);

// What is wrong with a name of the form of our columns ("jiont1.q") that is
// none of this mechanism's, and what to do: "the model has no joint 'jiont1'"
// with "did you mean 'joint1.q'?"; "joint 'ball' is spherical" with the columns
// it has.
struct ColumnNameFault {
  std::string what;
  std::string hint;
};
ColumnNameFault ExplainUnknownColumn(const std::string& name,
                                     const Mechanism& mechanism);

// Whether the name ends as ours do (".q", ".qw", ".taux", ".px", ...).
bool HasRunColumnSuffix(const std::string& name);

}  // namespace sysid
