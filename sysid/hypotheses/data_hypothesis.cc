#include "sysid/hypotheses/data_hypothesis.h"

#include <algorithm>
#include <cmath>

#include "models/error.h"
#include "sysid/checks/inertia.h"
#include "sysid/hypotheses/families/families.h"
#include "sysid/io/cell.h"
#include "sysid/io/channel_edits.h"
#include "sysid/io/column_map.h"
#include "sysid/io/run_columns.h"

namespace sysid {
namespace {

constexpr HypothesisFamily kFamilies[] = {
    SignHypotheses,   OrderHypotheses, AbsoluteHypotheses, UnitHypotheses,
    QuaternionOrders, BodyHypotheses,  DelayHypotheses,    EffortHypotheses,
    DriftHypotheses,  ClockHypotheses,
};

// In the order of DataFault.
constexpr const char* kFaultNames[] = {
    "axis_flipped",
    "effort_flipped",
    "joints_swapped",
    "efforts_swapped",
    "absolute_angle",
    "degrees",
    "millimetres",
    "centimetres",
    "milliseconds",
    "quaternion_order",
    "quaternion_inverse",
    "inertia_about_joint",
    "mass_in_grams",
    "channel_late",
    "effort_scale",
    "effort_idle",
    "drift",
    "clock_scale",
};
static_assert(std::size(kFaultNames) ==
              static_cast<size_t>(DataFault::kClockScale) + 1);

// The numbers of a column of a run, which may be const; none where it has not
// got it.
template <typename R>
using ColumnOf =
    Eigen::Map<std::conditional_t<std::is_const_v<R>, const Eigen::VectorXd,
                                  Eigen::VectorXd>,
               0, Eigen::InnerStride<>>;
template <typename R>
ColumnOf<R> Find(const Mechanism& mechanism,
                 const std::vector<ColumnGroup>& groups,
                 const std::string& name, R* run) {
  const auto of = [&](auto* first, Eigen::Index stride) {
    return ColumnOf<R>(first, run->size(), Eigen::InnerStride<>(stride));
  };
  if (name == "t") return of(run->t.data(), 1);
  for (const ColumnGroup& group : groups) {
    if (!Contains(group.columns, name)) continue;
    const auto slot_in = [&](const ColumnGroup& own) {
      const auto at = std::find(own.columns.begin(), own.columns.end(), name);
      return at == own.columns.end() ? -1 : own.slots[at - own.columns.begin()];
    };
    if (group.is_effort) {
      const int v = mechanism.joints[group.target].v_index;
      return of(run->effort.data() + v + slot_in(group), run->effort.cols());
    }
    for (auto& channel : run->channels) {
      if (channel.kind != group.kind || channel.target != group.target) {
        continue;
      }
      const int slot = slot_in(AlongAxes(group, channel.axes));
      if (slot < 0) continue;  // an axis that was not measured
      return of(channel.values.data() + slot, channel.values.cols());
    }
  }
  return ColumnOf<R>(nullptr, 0, Eigen::InnerStride<>(1));
}

// A factor as it is pasted: an estimated one to the digits that it is known to.
std::string FactorText(const DataHypothesis& hypothesis, double factor) {
  return hypothesis.is_continuous() ? ShortNumber(factor)
                                    : ShortestText(factor);
}

// What the corrected columns are read from, of those that were measured.
NewColumns Expressions(const CheckInput& input, const Supposition& supposed) {
  const Mechanism& mechanism = input.model->mechanism();
  const std::vector<ColumnGroup> groups = RunColumnGroups(mechanism);
  const auto is_measured = [&](const std::string& column) {
    return std::any_of(input.runs.begin(), input.runs.end(),
                       [&](const Run* run) {
                         return Find(mechanism, groups, column, run).size() > 0;
                       });
  };
  NewColumns columns;
  for (const CorrectedColumn& corrected :
       supposed.hypothesis->corrected(supposed.p)) {
    bool measured = is_measured(corrected.column);
    std::string sum;
    for (const auto& [factor, column] : corrected.terms) {
      measured = measured && is_measured(column);
      std::string term = SourceOf(input, column);
      if (std::abs(factor) != 1.0) {
        term = Times(term, FactorText(*supposed.hypothesis, std::abs(factor)));
      }
      if (sum.empty()) {
        sum = factor < 0 ? Negated(term) : term;
      } else {
        sum = Minus(sum, factor < 0 ? term : Negated(term));
      }
    }
    if (measured && sum != SourceOf(input, corrected.column)) {
      columns.push_back({corrected.column, sum});
    }
  }
  return columns;
}

}  // namespace

bool IsOfRun(const std::vector<int>& runs, int run) {
  return runs.empty() || std::find(runs.begin(), runs.end(), run) != runs.end();
}

std::string ToString(DataFault fault) {
  return kFaultNames[static_cast<int>(fault)];
}

std::vector<DataHypothesis> AllHypotheses(const CheckInput& input) {
  std::vector<DataHypothesis> all;
  for (const HypothesisFamily family : kFamilies) family(input, &all);
  return all;
}

Supposition Suppose(const DataHypothesis& hypothesis,
                    const std::vector<int>& runs, double p) {
  auto of_runs = std::make_shared<DataHypothesis>(hypothesis);
  of_runs->runs = runs;
  return {std::move(of_runs), p};
}

void Undo(const Supposition& supposed, const Mechanism& mechanism,
          int run_index, Run* run) {
  if (supposed.hypothesis == nullptr) return;
  const DataHypothesis& hypothesis = *supposed.hypothesis;
  if (!IsOfRun(hypothesis.runs, run_index)) return;
  if (!hypothesis.late.empty() && supposed.p != 0.0) {
    ChannelEdits edits;
    for (const std::string& column : hypothesis.late) {
      edits.shifts.push_back({column, supposed.p, "check"});
    }
    ApplyEdits(edits, mechanism, run, nullptr);
  }
  if (!hypothesis.corrected) return;
  const std::vector<ColumnGroup> groups = RunColumnGroups(mechanism);
  const Run as_read = *run;
  for (const CorrectedColumn& corrected : hypothesis.corrected(supposed.p)) {
    ColumnOf<Run> place = Find(mechanism, groups, corrected.column, run);
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(place.size());
    bool all = place.size() > 0;
    for (const auto& [factor, column] : corrected.terms) {
      const auto values = Find(mechanism, groups, column, &as_read);
      all = all && values.size() > 0;
      if (all) sum += factor * values;
    }
    if (all) place = sum;
  }
}

double LogUnit(const Supposition& supposed, const std::string& column) {
  if (supposed.hypothesis == nullptr || !supposed.hypothesis->corrected) {
    return 0.0;
  }
  for (const CorrectedColumn& corrected :
       supposed.hypothesis->corrected(supposed.p)) {
    if (corrected.column != column) continue;
    for (const CorrectedColumn::Term& term : corrected.terms) {
      if (term.column == column) return std::log(std::abs(term.factor));
    }
  }
  return 0.0;
}

double LogUnit(const Supposition& supposed, const Mechanism& mechanism,
               const Channel& channel) {
  if (supposed.hypothesis == nullptr) return 0.0;
  const std::vector<std::string> columns = GroupOf(mechanism, channel).columns;
  double sum = 0.0;
  for (const std::string& column : columns) sum += LogUnit(supposed, column);
  return sum / static_cast<double>(columns.size());
}

std::vector<std::string> FixTexts(const CheckInput& input,
                                  const Supposition& supposed) {
  const DataHypothesis& hypothesis = *supposed.hypothesis;
  if (hypothesis.change_model) {
    Model changed = *input.model;
    hypothesis.change_model(&changed);
    std::vector<std::string> lines;
    for (const std::string& link : hypothesis.subjects) {
      const int l = changed.mechanism().FindLink(link);
      lines.push_back(
          InertialLine(changed.nominal().links[l], link, input.model_file));
    }
    return lines;
  }
  const auto flag = [&](const CheckInput& of_runs) {
    return hypothesis.late.empty()
               ? ColumnsFlag(of_runs, Expressions(of_runs, supposed))
               : ShiftFlag(of_runs, hypothesis.late, supposed.p);
  };
  if (hypothesis.runs.empty()) return {flag(input)};
  // One flag for all of them: each repeats what that of the run before says.
  std::string text;
  CheckInput all = input;
  for (const int run : hypothesis.runs) {
    text = flag(OfOneRun(all, *input.runs[run]));
    const std::string value = FlagValue(text);
    if (hypothesis.late.empty()) {
      all.flag_columns = ParseColumnMap(value, "--columns");
    } else {
      all.flag_edits.shifts = value.empty() ? std::vector<ChannelShift>()
                                            : ParseShifts(value, "--shift");
    }
  }
  return {text};
}

}  // namespace sysid
