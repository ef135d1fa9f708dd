// Degrees, millimetres, centimetres; milliseconds that pass for seconds.

#include <cmath>

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {

void ReadOtherUnits(const CheckInput& input, std::vector<Reading>* readings) {
  const Mechanism* mechanism = &input.model->mechanism();
  struct Unit {
    const char* fault;
    const char* name;
    const char* ours;
    const char* factor;
    double value;
  };
  static const Unit kDegree = {"degrees", "degrees", "radians",
                               "0.017453292519943295", M_PI / 180.0};
  static const Unit kMillimetre = {"millimetres", "millimetres", "metres",
                                   "0.001", 0.001};
  static const Unit kCentimetre = {"centimetres", "centimetres", "metres",
                                   "0.01", 0.01};
  const auto add = [&](int j, const Unit& unit) {
    const Joint& joint = mechanism->joints[j];
    NewColumns columns;
    for (const auto& [kind, suffix] :
         {std::pair(ChannelKind::kPosition, ".q"),
          std::pair(ChannelKind::kVelocity, ".qd")}) {
      if (!Measures(input, kind, j)) continue;
      const std::string column = joint.name + suffix;
      columns.push_back({column, Times(SourceOf(input, column), unit.factor)});
    }
    Reading reading;
    reading.fault = unit.fault;
    reading.subject = joint.name + ".q";
    reading.says = "with " + joint.name + ".q in " + unit.name;
    reading.consequence = std::string("read as ") + unit.ours +
                          " the motion is another one altogether";
    const double factor = unit.value;
    reading.target = j;
    reading.factor = factor;
    reading.change = [=](Run* run) {
      ScaleJoint(*mechanism, j, kMotion, factor, run);
    };
    reading.remedies = {ColumnsFlag(input, columns)};
    readings->push_back(reading);
  };
  for (size_t j = 0; j < mechanism->joints.size(); ++j) {
    const int index = static_cast<int>(j);
    if (!IsSimple(mechanism->joints[j]) ||
        !Measures(input, ChannelKind::kPosition, index)) {
      continue;
    }
    if (IsRotation1(mechanism->joints[j].type)) {
      add(index, kDegree);
    } else {
      add(index, kMillimetre);
      add(index, kCentimetre);
    }
  }
  // At 1 kHz milliseconds are a second apart, and pass.
  Reading reading;
  reading.fault = "milliseconds";
  reading.subject = "t";
  reading.says = "with t in milliseconds";
  reading.consequence = "every speed is a thousand times too small";
  reading.change = [](Run* run) {
    for (double& t : run->t) t *= 0.001;
  };
  reading.remedies = {
      ColumnsFlag(input, {{"t", Times(SourceOf(input, "t"), "0.001")}})};
  double period = INFINITY;
  for (const Run* run : input.runs) {
    period = std::min(period, (run->t.back() - run->t.front()) /
                                  std::max(1, run->size() - 1));
  }
  if (period > 0.2) readings->push_back(reading);
}

}  // namespace sysid
