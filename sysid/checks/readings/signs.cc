// A column whose sign is the other way round than the axis of the URDF.

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

constexpr char kConsequence[] =
    "as it stands the model moves the wrong way there: what is fitted makes up "
    "for that";

// The sign convention of a whole drive system.
void ReadAllEffortsFlipped(const CheckInput& input,
                           std::vector<Reading>* readings) {
  const Mechanism* mechanism = &input.model->mechanism();
  std::vector<int> driven;
  NewColumns columns;
  std::string names;
  for (size_t j = 0; j < mechanism->joints.size(); ++j) {
    const Joint& joint = mechanism->joints[j];
    if (!IsSimple(joint) || !IsDriven(input, joint)) continue;
    driven.push_back(static_cast<int>(j));
    const std::string column = joint.name + ".tau";
    columns.push_back({column, Negated(SourceOf(input, column))});
    names += (names.empty() ? "" : ", ") + column;
  }
  if (driven.size() < 2) return;
  Reading reading;
  reading.fault = "effort_flipped";
  reading.subject = names;
  reading.says = "with the sign of every effort changed";
  reading.consequence = kConsequence;
  reading.change = [=](Run* run) {
    for (const int j : driven) ScaleJoint(*mechanism, j, kEffort, -1.0, run);
  };
  reading.remedies = {ColumnsFlag(input, columns)};
  readings->push_back(reading);
}

}  // namespace

void ReadFlippedSigns(const CheckInput& input, std::vector<Reading>* readings) {
  const Mechanism* mechanism = &input.model->mechanism();
  for (size_t j = 0; j < mechanism->joints.size(); ++j) {
    const Joint& joint = mechanism->joints[j];
    const int index = static_cast<int>(j);
    if (!IsSimple(joint)) continue;
    const bool measured = Measures(input, ChannelKind::kPosition, index);
    const bool driven = IsDriven(input, joint);
    const auto add = [&](int parts, const std::string& fault,
                         const std::string& subject, const std::string& says) {
      NewColumns columns;
      if (parts & kMotion) {
        for (const auto& [kind, column] :
             {std::pair(ChannelKind::kPosition, joint.name + ".q"),
              std::pair(ChannelKind::kVelocity, joint.name + ".qd")}) {
          if (!Measures(input, kind, index)) continue;
          columns.push_back({column, Negated(SourceOf(input, column))});
        }
      }
      if (parts & kEffort) {
        const std::string column = joint.name + ".tau";
        columns.push_back({column, Negated(SourceOf(input, column))});
      }
      Reading reading;
      reading.fault = fault;
      reading.subject = subject;
      reading.says = says;
      reading.consequence = kConsequence;
      reading.change = [=](Run* run) {
        ScaleJoint(*mechanism, index, parts, -1.0, run);
      };
      reading.remedies = {ColumnsFlag(input, columns)};
      readings->push_back(reading);
    };
    if (measured) {
      add(kMotion, "axis_flipped", joint.name + ".q",
          "with the sign of " + joint.name + "'s motion changed");
    }
    if (driven) {
      add(kEffort, "effort_flipped", joint.name + ".tau",
          "with the sign of " + joint.name + "'s effort changed");
    }
    if (measured && driven) {
      add(kMotion | kEffort, "axis_flipped", joint.name,
          "with the axis of " + joint.name + " the other way round");
    }
  }
  ReadAllEffortsFlipped(input, readings);
}

}  // namespace sysid
