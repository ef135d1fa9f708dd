// Stamps, clocks and what is late.

#include "sysid/checks/excerpt.h"
#include "sysid/io/channel_edits.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"
#include "tests/acceptance/checks/resampled.h"

namespace sysid {

std::vector<Fault> TimeFaults() {
  return {
      OfJoint("channel_late", {}, JointsOnTime,
              [](int j, Dice* dice, const Session& s, Run* run) {
                const double delay = dice->Sign() * 0.01;
                ChannelEdits edits;
                edits.shifts = {
                    {s.model.mechanism().joints[j].name + ".q", delay, ""}};
                ApplyEdits(edits, s.model.mechanism(), run, nullptr);
              }),
      OfRun("time_jitter",
            [](Dice* dice, Run* run) {
              const double period = MedianPeriod(run->t);
              // Even samples whose stamps are not.
              for (double& t : run->t) {
                t += period * dice->Uniform(-0.45, 0.45);
              }
            }),
      OfRun("gap",
            [](Dice* dice, Run* run) {
              const int n = run->size();
              const int first = n / 4 + dice->Below(n / 2);
              *run = WithoutRows(*run, first, first + 15);
            }),
      {"clock_scale",
       {},
       [](const CleanCase& clean, std::uint64_t seed) -> Planted {
         Dice dice(seed);
         // Where a length is free it makes up for any clock.
         if (clean.real || BallJoints(clean.session).size() +
                                   SimpleJoints(clean.session).size() <
                               2) {
           return std::nullopt;
         }
         Session planted = Changed(clean.session, [&](Run* run) {
           const double scale = dice.Sign() > 0 ? 1.3 : 0.75;
           for (double& t : run->t) t *= scale;
         });
         planted.free.clear();
         return planted;
       }},
  };
}

}  // namespace sysid
