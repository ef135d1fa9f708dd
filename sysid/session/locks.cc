#include "sysid/session/locks.h"

#include <algorithm>
#include <map>
#include <set>

#include "models/error.h"
#include "models/hold_joints.h"
#include "sysid/io/csv.h"
#include "sysid/parameters/patterns.h"

namespace sysid {
namespace {

JointType TypeInFile(const Joint& joint) {
  return joint.held ? joint.held->type : joint.type;
}

std::string Text(const NamedValue& lock) {
  return lock.name + (lock.value ? "=" + ShortestText(*lock.value) : "");
}

// The joint that is held still of which a parameter's name speaks: not its
// origin, which it keeps.
bool IsOfHeldJoint(const Mechanism& mechanism, const std::string& parameter) {
  const size_t dot = parameter.rfind('.');
  if (dot == std::string::npos) return false;
  const std::string of = parameter.substr(dot + 1);
  const int joint = mechanism.FindJoint(parameter.substr(0, dot));
  return joint >= 0 && mechanism.joints[joint].held && of != "x" && of != "y" &&
         of != "z";
}

void NoteDropped(const std::vector<std::string>& names,
                 std::vector<std::string>* notices) {
  if (names.empty()) return;
  notices->push_back("not in the model, since --lock holds the joint still: " +
                     Join(names));
}

}  // namespace

void DropHeldEffects(const Mechanism& mechanism,
                     std::vector<Located<std::string>>* effects,
                     std::vector<std::string>* notices) {
  std::vector<std::string> dropped;
  std::erase_if(*effects, [&](const Located<std::string>& effect) {
    const size_t at = effect.value.find('@');
    if (at == std::string::npos) return false;
    const int joint = mechanism.FindJoint(effect.value.substr(at + 1));
    if (joint < 0 || !mechanism.joints[joint].held) return false;
    dropped.push_back(effect.value);
    return true;
  });
  NoteDropped(dropped, notices);
}

FitSpecification WithoutHeld(const Mechanism& mechanism,
                             FitSpecification specification,
                             std::vector<std::string>* notices) {
  DropHeldEffects(mechanism, &specification.effects, notices);
  std::vector<std::string> dropped;
  const auto is_held = [&](const auto& entry) {
    if (!IsOfHeldJoint(mechanism, entry.name)) return false;
    dropped.push_back(entry.name);
    return true;
  };
  std::erase_if(specification.free, is_held);
  std::erase_if(specification.fix, is_held);
  NoteDropped(dropped, notices);
  return specification;
}

std::vector<NamedValue> ResolveLocks(const Mechanism& mechanism,
                                     const std::vector<NamedValue>& locks) {
  std::vector<std::string> names;
  std::map<std::string, NamedValue> found;
  std::set<std::string> followers;  // without a position of their own
  for (const Joint& joint : mechanism.joints) {
    if (TypeInFile(joint) != JointType::kFixed) names.push_back(joint.name);
  }
  for (const NamedValue& lock : locks) {
    bool any = false;
    for (const Joint& joint : mechanism.joints) {
      const JointType type = TypeInFile(joint);
      if (type == JointType::kFixed) continue;
      if (!Matches(lock.name, joint.name)) continue;
      any = true;
      if (type == JointType::kSpherical && lock.value.value_or(0.0) != 0.0) {
        throw InputError(
            lock.place,
            "joint '" + joint.name + "' is spherical: it cannot be held at " +
                ShortestText(*lock.value),
            "write " + joint.name + " alone: it is then held at the identity");
      }
      if (joint.mimic && !lock.value) followers.insert(joint.name);
      if (joint.mimic && lock.value) followers.erase(joint.name);
      found[joint.name] = {joint.name, lock.value.value_or(0.0), lock.place};
    }
    if (any) continue;
    const bool fixed = mechanism.FindJoint(lock.name) >= 0;
    throw InputError(lock.place,
                     fixed ? "joint '" + lock.name + "' is fixed already"
                           : "no joint that moves is named '" + lock.name + "'",
                     fixed ? "leave it out" : NameHint(lock.name, names));
  }
  // Where their leaders put them, if those are held.
  for (const std::string& name : followers) {
    const int follower = mechanism.FindJoint(name);
    const Joint* leader = &mechanism.joints[follower];
    bool is_led = false;
    while (leader->mimic) {
      leader = &mechanism.joints[mechanism.FindJoint(leader->mimic->joint)];
      is_led |= found.contains(leader->name);
    }
    if (is_led) {
      found.erase(name);
    } else {
      found[name].value = FollowedBy(mechanism, follower).offset;
    }
  }
  std::vector<NamedValue> resolved;
  for (const std::string& name : names) {
    const auto at = found.find(name);
    if (at != found.end()) resolved.push_back(at->second);
  }
  return resolved;
}

Mechanism LockJoints(const Mechanism& mechanism,
                     const std::vector<NamedValue>& resolved,
                     std::vector<std::string>* notices) {
  if (resolved.empty()) return mechanism;
  std::map<int, double> positions;
  std::vector<std::string> beyond;
  for (const NamedValue& lock : resolved) {
    const int j = mechanism.FindJoint(lock.name);
    const Joint& joint = mechanism.joints[j];
    positions[j] = *lock.value;
    const JointType type = TypeInFile(joint);
    const bool limited =
        joint.has_limits && joint.lower <= joint.upper &&
        (type == JointType::kRevolute || type == JointType::kPrismatic);
    if (limited && (*lock.value < joint.lower || *lock.value > joint.upper)) {
      beyond.push_back(lock.name + " at " + ShortestText(*lock.value) +
                       " (limits " + ShortestText(joint.lower) + " to " +
                       ShortestText(joint.upper) + ")");
    }
  }
  if (!beyond.empty()) {
    notices->push_back("held beyond the limits: " + Join(beyond));
  }
  Mechanism held = HoldJoints(mechanism, positions);
  if (held.nv == 0) {
    throw InputError(resolved.front().place, "holds every joint that moves",
                     "leave one of them out");
  }
  return held;
}

std::string UnmeasuredNotice(const Mechanism& mechanism,
                             const std::vector<const Run*>& runs,
                             const std::vector<NamedValue>& flag_locks) {
  const auto any = [&](const auto& says) {
    return std::any_of(runs.begin(), runs.end(),
                       [&](const Run* run) { return says(*run); });
  };
  const auto has_channel = [](const Run& run, const auto& is_it) {
    return std::any_of(run.channels.begin(), run.channels.end(), is_it);
  };
  const auto is_frame = [](const Channel& channel) {
    return channel.kind == ChannelKind::kFramePosition;
  };
  if (any([&](const Run& run) { return has_channel(run, is_frame); })) {
    return "";
  }
  std::vector<std::string> names, flags;
  for (const NamedValue& lock : flag_locks) flags.push_back(Text(lock));
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    if (VelocitySize(joint) == 0) continue;
    const bool has_column = any([&](const Run& run) {
      return has_channel(run,
                         [&](const Channel& channel) {
                           return channel.target == static_cast<int>(j);
                         }) ||
             HasEffort(run, joint.v_index, VelocitySize(joint));
    });
    if (has_column) continue;
    names.push_back(joint.name);
    flags.push_back(joint.name);
  }
  if (names.empty()) return "";
  return "no column of " + Join(names) + ": " +
         (names.size() == 1 ? "its motion is" : "their motions are") +
         " estimated from the others; hold still by --lock '" +
         Join(flags, ",") + "'";
}

void DropHeldChannels(const Mechanism& mechanism, const Mechanism& held,
                      Run* run) {
  std::erase_if(run->channels, [&](const Channel& channel) {
    return channel.kind != ChannelKind::kFramePosition &&
           held.joints[channel.target].held;
  });
  RowMatrixXd effort(run->effort.rows(), held.nv);
  std::vector<bool> recorded(held.nv);
  for (size_t j = 0; j < held.joints.size(); ++j) {
    const int size = VelocitySize(held.joints[j]);
    if (size == 0) continue;
    const int from = mechanism.joints[j].v_index, to = held.joints[j].v_index;
    effort.middleCols(to, size) = run->effort.middleCols(from, size);
    for (int k = 0; k < size; ++k) recorded[to + k] = HasEffort(*run, from + k);
  }
  run->effort = std::move(effort);
  run->recorded_efforts = std::move(recorded);
}

}  // namespace sysid
