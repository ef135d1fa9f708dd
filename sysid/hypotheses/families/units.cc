// Degrees, millimetres, centimetres; milliseconds that pass for seconds.

#include <algorithm>
#include <cmath>

#include "sysid/checks/edit_run.h"
#include "sysid/hypotheses/families/families.h"

namespace sysid {
namespace {

struct Unit {
  DataFault fault;
  const char* name;
  const char* ours;
  const char* factor;
  double value;
};
constexpr Unit kDegree = {DataFault::kDegrees, "degrees", "radians",
                          "0.017453292519943295", M_PI / 180.0};
constexpr Unit kMillimetre = {DataFault::kMillimetres, "millimetres", "metres",
                              "0.001", 0.001};
constexpr Unit kCentimetre = {DataFault::kCentimetres, "centimetres", "metres",
                              "0.01", 0.01};

void AddUnit(const CheckInput& input, int j, const Unit& unit,
             std::vector<DataHypothesis>* all) {
  const Mechanism* mechanism = &input.model->mechanism();
  const std::string column = mechanism->joints[j].name + ".q";
  DataHypothesis hypothesis;
  hypothesis.fault = unit.fault;
  hypothesis.subjects = {column};
  hypothesis.says = Words("with " + column + " in " + unit.name);
  hypothesis.consequence = std::string("read as ") + unit.ours +
                           " the motion is another one altogether";
  hypothesis.change = [=](double, Run* run) {
    ScaleJoint(*mechanism, j, kMotion, unit.value, run);
  };
  hypothesis.log_unit = [=](const Channel& channel, double) {
    const bool is_it =
        channel.target == j && (channel.kind == ChannelKind::kPosition ||
                                channel.kind == ChannelKind::kVelocity);
    return is_it ? std::log(unit.value) : 0.0;
  };
  hypothesis.fix = [=](const CheckInput& of_run, double) {
    SuggestedFix fix;
    for (const std::string& name : MotionColumns(of_run, j)) {
      fix.columns.push_back({name, Times(SourceOf(of_run, name), unit.factor)});
    }
    return fix;
  };
  all->push_back(hypothesis);
}

}  // namespace

void UnitHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all) {
  for (const int j : MeasuredJoints(input)) {
    if (IsRotation1(input.model->mechanism().joints[j].type)) {
      AddUnit(input, j, kDegree, all);
    } else {
      AddUnit(input, j, kMillimetre, all);
      AddUnit(input, j, kCentimetre, all);
    }
  }
  // At 1 kHz milliseconds are a second apart, and pass; what is sampled faster
  // than each 0.2 s in our unit would be beyond 5 kHz.
  constexpr double kSlowest = 0.2;  // s
  for (const Run* run : input.runs) {
    const double period =
        (run->t.back() - run->t.front()) / std::max(1, run->size() - 1);
    if (period < kSlowest) return;
  }
  DataHypothesis hypothesis;
  hypothesis.fault = DataFault::kMilliseconds;
  hypothesis.subjects = {"t"};
  hypothesis.says = Words("with t in milliseconds");
  hypothesis.consequence = "every speed is a thousand times too small";
  hypothesis.change = [](double, Run* run) {
    for (double& t : run->t) t *= 0.001;
  };
  hypothesis.fix = [](const CheckInput& of_run, double) {
    SuggestedFix fix;
    fix.columns = {{"t", Times(SourceOf(of_run, "t"), "0.001")}};
    return fix;
  };
  all->push_back(hypothesis);
}

}  // namespace sysid
