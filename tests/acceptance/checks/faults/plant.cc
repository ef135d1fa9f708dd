#include "tests/acceptance/checks/faults/plant.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sysid/checks/readings/edit_run.h"

namespace sysid {
namespace {

const Joint& JointOf(const Session& session, int joint) {
  return session.model.mechanism().joints[joint];
}

std::vector<int> JointsThat(const Session& session,
                            const std::function<bool(int)>& fit) {
  std::vector<int> joints;
  for (size_t j = 0; j < session.model.mechanism().joints.size(); ++j) {
    if (fit(static_cast<int>(j))) joints.push_back(static_cast<int>(j));
  }
  return joints;
}

bool HasPosition(const Session& session, int joint) {
  for (const Channel& channel : session.runs.front().channels) {
    if (channel.kind == ChannelKind::kPosition && channel.target == joint) {
      return true;
    }
  }
  return false;
}

bool HasEffort(const Session& session, int joint) {
  const Joint& j = JointOf(session, joint);
  return j.type != JointType::kFixed &&
         !session.runs.front().effort.col(j.v_index).isZero(0.0);
}

}  // namespace

std::vector<int> SimpleJoints(const Session& session) {
  return JointsThat(session, [&](int j) {
    return IsSimple(JointOf(session, j)) && HasPosition(session, j);
  });
}

std::vector<int> DrivenJoints(const Session& session) {
  return JointsThat(session, [&](int j) {
    return IsSimple(JointOf(session, j)) && HasEffort(session, j);
  });
}

std::vector<int> BallJoints(const Session& session) {
  return JointsThat(session, [&](int j) {
    return JointOf(session, j).type == JointType::kSpherical;
  });
}

std::vector<int> JointsBesideAnother(const Session& session) {
  std::vector<int> joints = SimpleJoints(session);
  if (joints.size() < 2 && DrivenJoints(session).empty()) joints.clear();
  return joints;
}

std::vector<int> JointsOnTime(const Session& session) {
  if (session.model_name == "simple_pendulum_dfki") return {};
  return JointsBesideAnother(session);
}

std::vector<int> Hinges(const Session& session) {
  std::vector<int> joints = SimpleJoints(session);
  std::erase_if(joints,
                [&](int j) { return !IsRotation1(JointOf(session, j).type); });
  return joints;
}

std::vector<int> Slides(const Session& session) {
  std::vector<int> joints = SimpleJoints(session);
  std::erase_if(joints,
                [&](int j) { return IsRotation1(JointOf(session, j).type); });
  return joints;
}

int DrawJoint(const std::vector<int>& from, Dice* dice) {
  return from.empty() ? -1 : from[dice->Below(static_cast<int>(from.size()))];
}

Channel* PositionOf(Run* run, int joint) {
  return ChannelOf(run, ChannelKind::kPosition, joint);
}

double SpanOf(const Channel& channel) {
  double low = INFINITY, high = -INFINITY;
  for (const double value : channel.values.reshaped()) {
    if (std::isnan(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  return high - low;
}

Session Changed(const Session& session,
                const std::function<void(Run*)>& change) {
  Session changed = session;
  for (Run& run : changed.runs) change(&run);
  return changed;
}

Fault OfJoint(const std::string& name, std::vector<std::string> as_good,
              const std::function<std::vector<int>(const Session&)>& joints,
              const JointChange& change) {
  return {name, std::move(as_good),
          [=](const CleanCase& clean, std::uint64_t seed) -> Planted {
            Dice dice(seed);
            const int joint = DrawJoint(joints(clean.session), &dice);
            if (joint < 0) return std::nullopt;
            return Changed(clean.session, [&](Run* run) {
              Dice same = dice;  // a fault is the same in every run
              change(joint, &same, clean.session, run);
            });
          }};
}

Fault OfRun(const std::string& name,
            const std::function<void(Dice*, Run*)>& change) {
  return {name, {}, [=](const CleanCase& clean, std::uint64_t seed) -> Planted {
            Dice dice(seed);
            return Changed(clean.session,
                           [&](Run* run) { change(&dice, run); });
          }};
}

}  // namespace sysid
