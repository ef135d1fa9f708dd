#include "sysid/session/effort_notices.h"

#include <algorithm>

#include "models/error.h"

namespace sysid {

// Joints that a machine leaves passive are few and have no motor, whose effort
// a URDF would limit.
void NotePassive(const std::vector<const Run*>& runs,
                 const Mechanism& mechanism,
                 std::vector<std::string>* notices) {
  std::vector<std::string> driven, passive, columns;
  bool has_motor = false;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const int size = VelocitySize(joint);
    if (size == 0) continue;
    const bool is_driven = std::any_of(
        runs.begin(), runs.end(),
        [&](const Run* run) { return HasEffort(*run, joint.v_index, size); });
    // Of one without any column UnmeasuredNotice speaks.
    const bool is_measured =
        std::any_of(runs.begin(), runs.end(), [&](const Run* run) {
          return std::any_of(run->channels.begin(), run->channels.end(),
                             [&](const Channel& channel) {
                               return channel.kind !=
                                          ChannelKind::kFramePosition &&
                                      channel.target == static_cast<int>(j);
                             });
        });
    if (!is_driven && !is_measured) continue;
    (is_driven ? driven : passive).push_back(joint.name);
    if (is_driven) continue;
    columns.push_back(joint.name + (size == 1 ? ".tau" : ".taux"));
    has_motor |= joint.effort_limit > 0.0;
  }
  if (driven.empty() || passive.empty()) return;
  if (!has_motor && driven.size() <= passive.size()) return;
  notices->push_back("no effort is recorded of " + Join(passive) + ", but of " +
                     Join(driven) +
                     ": right only if no motor acts there; else map the "
                     "columns " +
                     Join(columns));
}

void NoteUndriven(const std::vector<const Run*>& all,
                  const Mechanism& mechanism,
                  std::vector<std::string>* notices) {
  for (const Joint& joint : mechanism.joints) {
    const int size = VelocitySize(joint);
    if (size == 0) continue;
    const auto driven = [&](const Run* run) {
      return !run->effort.middleCols(joint.v_index, size).isZero(0.0);
    };
    // One that was recorded as zero is known to have been so.
    const auto known = [&](const Run* run) {
      return HasEffort(*run, joint.v_index, size);
    };
    if (std::none_of(all.begin(), all.end(), driven)) continue;
    for (const Run* run : all) {
      if (known(run)) continue;
      notices->push_back(run->name + ": no effort acts on joint '" +
                         joint.name +
                         "', as it does in other runs: right only if it was "
                         "not driven there");
    }
  }
}

}  // namespace sysid
