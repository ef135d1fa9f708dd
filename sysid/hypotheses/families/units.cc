// Degrees, millimetres, centimetres; milliseconds that pass for seconds.

#include <algorithm>
#include <cmath>

#include "models/error.h"
#include "sysid/hypotheses/families/families.h"

namespace sysid {
namespace {

struct Unit {
  DataFault fault;
  const char* name;
  const char* ours;
  double factor;
};
constexpr Unit kDegree = {DataFault::kDegrees, "degrees", "radians",
                          M_PI / 180.0};
constexpr Unit kMillimetre = {DataFault::kMillimetres, "millimetres", "metres",
                              0.001};
constexpr Unit kCentimetre = {DataFault::kCentimetres, "centimetres", "metres",
                              0.01};

void AddUnit(const CheckInput& input, const std::vector<int>& joints,
             const Unit& unit, std::vector<DataHypothesis>* all) {
  DataHypothesis hypothesis;
  std::vector<std::string> columns;
  for (const int j : joints) {
    const std::string& name = input.model->mechanism().joints[j].name;
    hypothesis.subjects.push_back(name + ".q");
    for (const std::string& column : MotionColumns(name)) {
      columns.push_back(column);
    }
  }
  hypothesis.fault = unit.fault;
  hypothesis.says = Words("with " + Join(hypothesis.subjects) + " in " +
                          std::string(unit.name));
  hypothesis.consequence = std::string("read as ") + unit.ours +
                           ", the motion is entirely different";
  hypothesis.corrected = [=](double) { return Scaled(columns, unit.factor); };
  all->push_back(hypothesis);
}

}  // namespace

void UnitHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all) {
  // Who logs one joint in degrees logs them all so.
  std::vector<int> hinges;
  for (const int j : MeasuredJoints(input)) {
    if (IsRotation1(input.model->mechanism().joints[j].type)) {
      hinges.push_back(j);
    }
  }
  if (hinges.size() > 1) AddUnit(input, hinges, kDegree, all);
  for (const int j : MeasuredJoints(input)) {
    if (IsRotation1(input.model->mechanism().joints[j].type)) {
      AddUnit(input, {j}, kDegree, all);
    } else {
      AddUnit(input, {j}, kMillimetre, all);
      AddUnit(input, {j}, kCentimetre, all);
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
  hypothesis.corrected = [](double) { return Scaled({"t"}, 0.001); };
  all->push_back(hypothesis);
}

}  // namespace sysid
