// Velocities that are not those of the positions.

#include <algorithm>

#include "sysid/checks/excerpt.h"
#include "sysid/checks/readings/edit_run.h"
#include "sysid/io/channel_edits.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {
namespace {

// Beside each position its slope over five samples.
void AddVelocities(const Mechanism& mechanism, Run* run) {
  std::vector<Channel> channels;
  for (const Channel& channel : run->channels) {
    channels.push_back(channel);
    if (channel.kind != ChannelKind::kPosition) continue;
    Channel velocity = channel;
    velocity.kind = ChannelKind::kVelocity;
    velocity.name = mechanism.joints[channel.target].name + ".qd";
    const int n = run->size();
    for (int k = 0; k < n; ++k) {
      const int a = std::max(0, k - 2), b = std::min(n - 1, k + 2);
      velocity.values(k, 0) = (channel.values(b, 0) - channel.values(a, 0)) /
                              (run->t[b] - run->t[a]);
    }
    channels.push_back(velocity);
  }
  run->channels = channels;
}

Fault OfVelocity(const std::string& name,
                 const std::function<void(int, const Session&, Run*)>& change,
                 size_t joints) {
  return {name, {}, [=](const CleanCase& clean, std::uint64_t seed) -> Planted {
            Dice dice(seed);
            const std::vector<int> simple = SimpleJoints(clean.session);
            if (simple.size() < joints) return std::nullopt;
            const int joint = DrawJoint(simple, &dice);
            return Changed(clean.session, [&](Run* run) {
              AddVelocities(clean.session.model.mechanism(), run);
              change(joint, clean.session, run);
            });
          }};
}

}  // namespace

std::vector<Fault> VelocityFaults() {
  return {
      OfVelocity(
          "velocity_flipped",
          [](int j, const Session&, Run* run) {
            ChannelOf(run, ChannelKind::kVelocity, j)->values *= -1.0;
          },
          1),
      OfVelocity(
          "velocity_scale",
          [](int j, const Session&, Run* run) {
            ChannelOf(run, ChannelKind::kVelocity, j)->values *= 6.0;
          },
          1),
      OfVelocity(
          "velocity_late",
          [](int j, const Session&, Run* run) {
            // Less than a sample cannot be seen in the changes.
            const double late = std::max(0.02, MedianPeriod(run->t));
            ShiftChannel(run->t, -late,
                         ChannelOf(run, ChannelKind::kVelocity, j));
          },
          1),
      OfVelocity(
          "velocities_swapped",
          [](int, const Session& s, Run* run) {
            const std::vector<int> list = SimpleJoints(s);
            ChannelOf(run, ChannelKind::kVelocity, list[0])
                ->values.swap(
                    ChannelOf(run, ChannelKind::kVelocity, list[1])->values);
          },
          2),
  };
}

}  // namespace sysid
