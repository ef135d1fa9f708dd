#include "models/effects/catalogue.h"

#include <algorithm>

#include "models/effects/shipped_effects.h"
#include "models/error.h"

namespace sysid {
namespace {

// Whether a moving joint is between a link and the world.
bool Moves(const Mechanism& mechanism, int link) {
  while (link > 0) {
    const Joint& joint = mechanism.joints[link - 1];
    if (joint.type != JointType::kFixed) return true;
    link = joint.parent_link;
  }
  return false;
}

// The moving joint that carries a link, or -1.
int MoverBelow(const Mechanism& mechanism, int link) {
  while (link > 0) {
    const int joint = link - 1;
    if (mechanism.joints[joint].type != JointType::kFixed) return joint;
    link = mechanism.joints[joint].parent_link;
  }
  return -1;
}

[[noreturn]] void ThrowWithoutTarget(const std::string& name,
                                     const std::vector<std::string>& targets,
                                     const std::string& place) {
  std::string target = targets.empty() ? "base" : targets.front();
  std::replace(target.begin(), target.end(), ',', '+');
  throw InputError(place, "effect '" + name + "' has no target",
                   "write effect@target, for instance " + name + "@" + target);
}

// What a force and an inertia do at a joint that follows another, they do to
// that one; an effect on columns has none there. Candidates they are not: the
// joint that is followed has its own.
void CheckOnFollower(const Effect& effect, const Mechanism& mechanism,
                     int follower, const std::string& place) {
  if (!(effect.hooks() & (kActingHooks | kMeasurementHook)) &&
      !effect.ReadsMore()) {
    return;
  }
  const std::string& leader =
      mechanism.joints[FollowedBy(mechanism, follower).joint].name;
  throw InputError(
      place,
      "effect '" + effect.kind() + "' has no meaning on the joint '" +
          mechanism.joints[follower].name + "': it follows joint '" + leader +
          "' (<mimic>) and has no columns of its own",
      "name " + effect.kind() + "@" + leader);
}

}  // namespace

Catalogue::Catalogue() {
  [this]<class... Effects>(EffectList<Effects...>) {
    (Add<Effects>(), ...);
  }(ShippedEffects());
}

void EffectSet::Add(std::shared_ptr<const Effect> effect) {
  if (Contains(effect->name())) {
    throw InputError("effect " + effect->name(), "is in the model already",
                     "name each effect once");
  }
  offsets_.push_back(static_cast<int>(parameters_.size()));
  for (const EffectParameter& parameter : effect->parameters()) {
    parameters_.push_back(parameter);
  }
  first_inputs_.push_back(input_count_);
  input_count_ += static_cast<int>(effect->inputs().size());
  first_states_.push_back(state_count());
  states_.insert(states_.end(), effect->states().begin(),
                 effect->states().end());
  effects_.push_back(std::move(effect));
}

bool EffectSet::Contains(const std::string& name) const {
  const std::vector<std::string> all = names();
  return std::find(all.begin(), all.end(), name) != all.end();
}

std::vector<std::string> EffectSet::names() const {
  std::vector<std::string> names;
  for (const auto& effect : effects_) names.push_back(effect->name());
  return names;
}

std::vector<std::string> Catalogue::kinds() const {
  std::vector<std::string> kinds;
  for (const Entry& entry : entries_) kinds.push_back(entry.kind);
  return kinds;
}

std::vector<std::string> Catalogue::Targets(const Entry& entry,
                                            const Mechanism& mechanism) const {
  std::vector<std::string> targets;
  if (entry.target == TargetKind::kBase) {
    targets.push_back("base");
  } else if (entry.target == TargetKind::kJointPair) {
    // Neighbours of one kind: no moving joint is between them.
    for (const Joint& second : mechanism.joints) {
      const int first = MoverBelow(mechanism, second.parent_link);
      if (VelocitySize(second) != 1 || first < 0) continue;
      const Joint& joint = mechanism.joints[first];
      if (VelocitySize(joint) != 1 || !entry.applies(second.type) ||
          (joint.type == JointType::kPrismatic) !=
              (second.type == JointType::kPrismatic)) {
        continue;
      }
      targets.push_back(joint.name + "," + second.name);
    }
  } else if (entry.target == TargetKind::kLink) {
    for (size_t i = 1; i < mechanism.links.size(); ++i) {
      if (mechanism.nominal.links[i].mass > 0 &&
          Moves(mechanism, static_cast<int>(i))) {
        targets.push_back(mechanism.links[i].name);
      }
    }
  } else {
    for (const Joint& joint : mechanism.joints) {
      if (VelocitySize(joint) > 0 && entry.applies(joint.type)) {
        targets.push_back(joint.name);
      }
    }
  }
  return targets;
}

std::shared_ptr<const Effect> Catalogue::Make(const std::string& name,
                                              const Mechanism& mechanism,
                                              const std::string& place) const {
  const size_t at = name.find('@');
  const std::string kind = name.substr(0, at);
  const auto entry =
      std::find_if(entries_.begin(), entries_.end(),
                   [&](const Entry& e) { return e.kind == kind; });
  if (at == std::string::npos) {
    const std::vector<std::string> targets = entry != entries_.end()
                                                 ? Targets(*entry, mechanism)
                                                 : mechanism.JointNames();
    ThrowWithoutTarget(name, targets, place);
  }
  std::string target = name.substr(at + 1);
  if (entry == entries_.end()) {
    throw InputError(place, "unknown effect '" + kind + "'",
                     NameHint(kind, kinds()));
  }
  std::string law;
  const size_t comma = target.find(',');
  if (entry->target == TargetKind::kJointPair) {
    std::replace(target.begin(), target.end(), '+', ',');
  } else if (!entry->typed && comma != std::string::npos) {
    // A list's next entry.
    ThrowWithoutTarget(target.substr(comma + 1), mechanism.JointNames(), place);
  }
  if (entry->typed) {
    const size_t colon = target.find(':');
    if (colon == std::string::npos ||
        target.find_first_not_of(" \t\n", colon + 1) == std::string::npos) {
      throw InputError(place, "effect '" + name + "' has no law",
                       "write it behind a colon: '" +
                           name.substr(0, name.find(':')) + ": -k*q^3'");
    }
    law = target.substr(colon);
    target.erase(colon);
    while (!target.empty() && target.back() == ' ') target.pop_back();
  }
  const auto make = [&]() -> std::shared_ptr<const Effect> {
    try {
      return entry->make(mechanism, target + law);
    } catch (const LawFault& fault) {
      throw InputError(place, "effect '" + name + "': " + fault.what(),
                       fault.hint());
    }
  };
  const int follower = mechanism.FindJoint(target);
  if (entry->target == TargetKind::kJoint && follower >= 0 &&
      mechanism.joints[follower].mimic &&
      entry->applies(mechanism.joints[follower].type)) {
    const std::shared_ptr<const Effect> effect = make();
    CheckOnFollower(*effect, mechanism, follower, place);
    return effect;
  }
  // A payload: a link without mass may be given one.
  const int link = mechanism.FindLink(target);
  if (entry->target == TargetKind::kLink && Moves(mechanism, link)) {
    return make();
  }
  std::vector<std::string> targets = Targets(*entry, mechanism);
  if (entry->on_motor_too && mechanism.FindJoint(target) < 0 &&
      target.ends_with(kOfMotor)) {
    for (std::string& joint : targets) joint += kOfMotor;
  }
  if (std::find(targets.begin(), targets.end(), target) == targets.end()) {
    const int joint = mechanism.FindJoint(target);
    const bool on_joint = joint >= 0 && entry->target == TargetKind::kJoint;
    const bool on_link =
        mechanism.FindLink(target) >= 0 && entry->target == TargetKind::kLink;
    if (on_joint || on_link) {
      if (on_joint && mechanism.joints[joint].held) {
        throw InputError(place,
                         "effect '" + kind + "' has no meaning on joint '" +
                             target + "', which is held still (--lock)",
                         "leave the effect out, or do not lock the joint");
      }
      throw InputError(
          place,
          "effect '" + kind + "' has no meaning on the " +
              (on_joint ? ToString(mechanism.joints[joint].type) + " joint '" +
                              target + "'"
                        : "link '" + target + "', which is fixed to the world"),
          targets.empty() ? std::string("this model has no ") +
                                (on_joint ? "joint" : "link") + " for it"
                          : "it acts on: " + Join(targets));
    }
    const size_t between = target.find(',');
    const std::string turned =
        between == std::string::npos
            ? ""
            : target.substr(between + 1) + "," + target.substr(0, between);
    const bool is_turned =
        std::find(targets.begin(), targets.end(), turned) != targets.end();
    throw InputError(
        place, "effect '" + kind + "': unknown target '" + target + "'",
        is_turned ? "the joint that carries the other is named first: " + turned
                  : NameHint(target, targets));
  }
  return make();
}

std::vector<std::string> Catalogue::Names(const Mechanism& mechanism) const {
  std::vector<std::string> names;
  for (const Entry& entry : entries_) {
    if (entry.typed) continue;
    for (const std::string& target : Targets(entry, mechanism)) {
      names.push_back(entry.kind + "@" + target);
    }
  }
  return names;
}

std::vector<std::string> Catalogue::NamesOnMotor(const Mechanism& mechanism,
                                                 int joint) const {
  std::vector<std::string> names;
  for (const Entry& entry : entries_) {
    if (!entry.on_motor_too || !entry.applies(mechanism.joints[joint].type)) {
      continue;
    }
    names.push_back(entry.kind + "@" + mechanism.joints[joint].name + kOfMotor);
  }
  return names;
}

std::vector<std::string> Catalogue::Candidates(
    const Mechanism& mechanism) const {
  std::vector<std::string> candidates = Names(mechanism);
  std::erase_if(candidates, [&](const std::string& name) {
    const auto effect = Make(name, mechanism, "candidates");
    return !effect->IsCandidate() || !effect->inputs().empty();
  });
  return candidates;
}

}  // namespace sysid
