// Angles from the world's vertical where those from the link before are meant.

#include <cmath>

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

// The moving joint that carries a joint's parent link, where both are hinges
// about the same axis; else -1. `sign` is -1 where the axes are opposed.
int HingeBefore(const Model& model, int joint, double* sign) {
  for (const Body& body : model.bodies()) {
    if (body.joint != joint || body.parent < 0) continue;
    const Body& parent = model.bodies()[body.parent];
    if (!IsRotation1(body.type) || !IsRotation1(parent.type)) return -1;
    const Eigen::Vector3d axis =
        body.turned ? Eigen::Vector3d(body.R_PJ * body.axis) : body.axis;
    const double cosine = axis.dot(parent.axis);
    if (std::abs(cosine) < 1.0 - 1e-6) return -1;
    *sign = cosine > 0 ? 1.0 : -1.0;
    return parent.joint;
  }
  return -1;
}

void Subtract(int from, int what, double sign, Run* run) {
  for (const ChannelKind kind :
       {ChannelKind::kPosition, ChannelKind::kVelocity}) {
    Channel* a = ChannelOf(run, kind, from);
    const Channel* b = ChannelOf(run, kind, what);
    if (a != nullptr && b != nullptr) a->values -= sign * b->values;
  }
}

}  // namespace

void ReadAbsoluteAngles(const CheckInput& input,
                        std::vector<Reading>* readings) {
  const Mechanism& mechanism = input.model->mechanism();
  struct Pair {
    int joint, before;
    double sign;
  };
  std::vector<Pair> pairs;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const int joint = static_cast<int>(j);
    double sign = 1.0;
    const int before = HingeBefore(*input.model, joint, &sign);
    if (before < 0 || !Measures(input, ChannelKind::kPosition, joint) ||
        !Measures(input, ChannelKind::kPosition, before)) {
      continue;
    }
    pairs.push_back({joint, before, sign});
  }
  const auto add = [&](const std::vector<Pair>& which) {
    NewColumns columns;
    std::string names;
    for (const Pair& pair : which) {
      const std::string& name = mechanism.joints[pair.joint].name;
      const std::string& before = mechanism.joints[pair.before].name;
      names += (names.empty() ? "" : ", ") + name + ".q";
      for (const auto& [kind, suffix] :
           {std::pair(ChannelKind::kPosition, ".q"),
            std::pair(ChannelKind::kVelocity, ".qd")}) {
        if (!Measures(input, kind, pair.joint)) continue;
        const std::string other = SourceOf(input, before + suffix);
        columns.push_back(
            {name + suffix, Minus(SourceOf(input, name + suffix),
                                  pair.sign > 0 ? other : Negated(other))});
      }
    }
    Reading reading;
    reading.fault = "absolute_angle";
    reading.subject = names;
    reading.says = "with " + names + " measured from the world instead of " +
                   "from the link before";
    reading.consequence = "a URDF's joint angle is that between its two links";
    // From the tip down, so that each is taken from one that is still as read.
    reading.change = [which](Run* run) {
      for (size_t i = which.size(); i-- > 0;) {
        Subtract(which[i].joint, which[i].before, which[i].sign, run);
      }
    };
    reading.remedies = {ColumnsFlag(input, columns)};
    readings->push_back(reading);
  };
  for (const Pair& pair : pairs) add({pair});
  if (pairs.size() > 1) add(pairs);
}

}  // namespace sysid
