#include "sysid/hypotheses/data_hypothesis.h"

#include <algorithm>

#include "models/error.h"
#include "sysid/hypotheses/families/families.h"
#include "sysid/io/channel_edits.h"
#include "sysid/io/column_map.h"

namespace sysid {
namespace {

constexpr HypothesisFamily kFamilies[] = {
    SignHypotheses,   OrderHypotheses, AbsoluteHypotheses, UnitHypotheses,
    QuaternionOrders, BodyHypotheses,  DelayHypotheses,    EffortHypotheses,
    DriftHypotheses,  ClockHypotheses,
};

// The value of "--columns 'value'".
std::string ValueOf(const std::string& flag) {
  std::string value = flag.substr(flag.find(' ') + 1);
  if (value.size() > 1 && value.front() == '\'' && value.back() == '\'') {
    value = value.substr(1, value.size() - 2);
  }
  return value;
}

}  // namespace

std::string ToString(DataFault fault) {
  switch (fault) {
    case DataFault::kAxisFlipped:
      return "axis_flipped";
    case DataFault::kEffortFlipped:
      return "effort_flipped";
    case DataFault::kJointsSwapped:
      return "joints_swapped";
    case DataFault::kEffortsSwapped:
      return "efforts_swapped";
    case DataFault::kAbsoluteAngle:
      return "absolute_angle";
    case DataFault::kDegrees:
      return "degrees";
    case DataFault::kMillimetres:
      return "millimetres";
    case DataFault::kCentimetres:
      return "centimetres";
    case DataFault::kMilliseconds:
      return "milliseconds";
    case DataFault::kQuaternionOrder:
      return "quaternion_order";
    case DataFault::kQuaternionInverse:
      return "quaternion_inverse";
    case DataFault::kInertiaAboutJoint:
      return "inertia_about_joint";
    case DataFault::kMassInGrams:
      return "mass_in_grams";
    case DataFault::kChannelLate:
      return "channel_late";
    case DataFault::kEffortScale:
      return "effort_scale";
    case DataFault::kEffortIdle:
      return "effort_idle";
    case DataFault::kDrift:
      return "drift";
    case DataFault::kClockScale:
      return "clock_scale";
  }
  return "";
}

std::vector<DataHypothesis> AllHypotheses(const CheckInput& input) {
  std::vector<DataHypothesis> all;
  for (const HypothesisFamily family : kFamilies) family(input, &all);
  return all;
}

DataHypothesis OfRuns(const DataHypothesis& hypothesis,
                      const std::vector<int>& runs) {
  DataHypothesis of_runs = hypothesis;
  of_runs.runs = runs;
  return of_runs;
}

void Undo(const DataHypothesis& hypothesis, double p, int run_index, Run* run) {
  const std::vector<int>& runs = hypothesis.runs;
  const bool is_of_run = runs.empty() || std::find(runs.begin(), runs.end(),
                                                   run_index) != runs.end();
  if (hypothesis.change && is_of_run) hypothesis.change(p, run);
}

std::vector<std::string> FixTexts(const CheckInput& input,
                                  const DataHypothesis& hypothesis, double p) {
  if (hypothesis.runs.empty()) {
    const SuggestedFix fix = hypothesis.fix(input, p);
    std::vector<std::string> texts = fix.lines;
    if (!fix.columns.empty()) texts.push_back(ColumnsFlag(input, fix.columns));
    if (!fix.shifted.empty()) {
      texts.push_back(ShiftFlag(input, fix.shifted, fix.delay));
    }
    return texts;
  }
  // One flag for all of them: each repeats what that of the run before says.
  std::string columns, shifts;
  CheckInput all = input;
  for (const int run : hypothesis.runs) {
    const CheckInput one = OfOneRun(all, *input.runs[run]);
    const SuggestedFix fix = hypothesis.fix(one, p);
    if (!fix.columns.empty()) {
      columns = ColumnsFlag(one, fix.columns);
      all.flag_columns = ParseColumnMap(ValueOf(columns), "--columns");
    }
    if (!fix.shifted.empty()) {
      shifts = ShiftFlag(one, fix.shifted, fix.delay);
      const std::string value = ValueOf(shifts);
      all.flag_edits.shifts = value.empty() ? std::vector<ChannelShift>()
                                            : ParseShifts(value, "--shift");
    }
  }
  std::vector<std::string> texts;
  if (!columns.empty()) texts.push_back(columns);
  if (!shifts.empty()) texts.push_back(shifts);
  return texts;
}

}  // namespace sysid
