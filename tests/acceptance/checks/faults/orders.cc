// Columns of another joint, or of another one too.

#include "sysid/checks/readings/edit_run.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {
namespace {

Fault OfTwoJoints(const std::string& name, std::vector<std::string> as_good,
                  int parts) {
  return {name, std::move(as_good),
          [parts](const CleanCase& clean, std::uint64_t seed) -> Planted {
            Dice dice(seed);
            const std::vector<int> joints = parts == kEffort
                                                ? DrivenJoints(clean.session)
                                                : SimpleJoints(clean.session);
            if (joints.size() < 2) return std::nullopt;
            const int a = dice.Below(static_cast<int>(joints.size()) - 1);
            return Changed(clean.session, [&](Run* run) {
              SwapJoints(clean.session.model.mechanism(), joints[a],
                         joints[a + 1], parts, run);
            });
          }};
}

// All but the first of a chain.
std::vector<int> JointsOnAnother(const Session& session) {
  const std::vector<int> joints = SimpleJoints(session);
  return joints.size() < 2 || session.model_name == "cartpole"
             ? std::vector<int>()
             : std::vector<int>(joints.begin() + 1, joints.end());
}

}  // namespace

std::vector<Fault> OrderFaults() {
  return {
      OfTwoJoints("joints_swapped", {}, kMotion),
      OfTwoJoints("efforts_swapped", {"joints_swapped"}, kEffort),
      OfJoint("absolute_angle", {}, JointsOnAnother,
              [](int j, Dice*, const Session&, Run* run) {
                PositionOf(run, j)->values += PositionOf(run, j - 1)->values;
              }),
  };
}

}  // namespace sysid
