#include "sysid/checks/find_idle_effort.h"

#include <algorithm>
#include <cmath>

#include "sysid/checks/knobs.h"
#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"

namespace sysid {
namespace {

// Gains of an effort that does nothing: two efforts of some seconds are alike
// to a half by chance. A small gain that is positive may be a body's that is
// too heavy.
constexpr double kLeastGain = -0.6, kMostGain = 0.3;
constexpr double kSignificance = 4.0;  // standard errors, from a gain of one
constexpr double kBetter = 1.15;    // with that gain, than with a gain of one
constexpr double kNoBetter = 1.05;  // with the effort, than without
// With that gain, than without: two efforts that are alike to a half by chance
// make 1.15 of it. Of more it is the motion's own, in another unit.
constexpr double kAlike = 1.5;

// The model of the fit with its bodies as they are given: only what effects
// have is free.
LooseModel WithGivenBodies(const LooseModel& lean) {
  LooseModel stiff = lean;
  std::erase_if(stiff.free, [](const FreeParameter& free) {
    return free.parameter.kind != ParameterKind::kEffect;
  });
  return stiff;
}

// tau turned into (1 + p) tau.
Knob Gain(int v) {
  Knob knob;
  knob.probe = 1e-3;
  knob.least = 0.01;
  knob.most = 3.0;
  knob.change = [v](double p, Run* run) { run->effort.col(v) *= 1.0 + p; };
  return knob;
}

// From several gains, for a motion that is far from the model's has more than
// one end: the best.
TurnedKnob GainOf(int v, const LooseModel& stiff, const QuickFit& brief,
                  const QuickFit& given, const AsRead& as_read) {
  TurnedKnob best;
  for (const double start : {0.0, -0.5, -1.0}) {
    const TurnedKnob turned = TurnKnob(stiff, brief, given, as_read.excerpt(),
                                       as_read.options(), Gain(v), start);
    if (turned.error < best.error) best = turned;
  }
  return best;
}

// Fits of the short segments with nothing for that effort.
QuickFit WithoutEffort(int v, const LooseModel& model, const AsRead& as_read,
                       const QuickFit& start) {
  return FitShort(model, as_read.excerpt().Windows([v](Run* run) {
    run->effort.col(v).setZero();
  }),
                  as_read.options(), kShortIterations, &start);
}

}  // namespace

bool FindIdleEffort(const AsRead& as_read, std::vector<Finding>* findings) {
  const CheckInput& input = as_read.input();
  // Those without which all of the user's freedoms do as well.
  struct Effort {
    const Joint* joint;
    double without;
  };
  std::vector<Effort> idle;
  for (const Joint& joint : input.model->mechanism().joints) {
    if (!IsSimple(joint) || !IsDriven(input, joint)) continue;
    const QuickFit short_fit =
        WithoutEffort(joint.v_index, as_read.lean(), as_read, as_read.fit());
    const double without = FitLong(short_fit).error;
    // Of a chaotic motion the short segments say it.
    if (short_fit.error <= kNoBetter * as_read.short_fit().error ||
        without <= kNoBetter * as_read.fit().error) {
      idle.push_back({&joint, without});
    }
  }
  if (idle.empty()) return false;
  const LooseModel stiff = WithGivenBodies(as_read.lean());
  const QuickFit brief = FitShort(stiff, as_read.excerpt().Windows({}),
                                  as_read.options(), kShortIterations, nullptr);
  const QuickFit given = FitLong(brief);
  if (!std::isfinite(given.error)) return false;
  NewColumns columns;
  std::string names, gains;
  double without = 0.0;
  for (const Effort& effort : idle) {
    const TurnedKnob turned =
        GainOf(effort.joint->v_index, stiff, brief, given, as_read);
    const double gain = 1.0 + turned.value;
    if (!(gain > kLeastGain && gain < kMostGain &&
          1.0 - gain > kSignificance * turned.std_error &&
          turned.error * kBetter < given.error)) {
      continue;
    }
    const double none =
        FitLong(WithoutEffort(effort.joint->v_index, stiff, as_read, given))
            .error;
    if (none > kAlike * turned.error) continue;
    const std::string column = effort.joint->name + ".tau";
    columns.push_back({column, Times(SourceOf(input, column), "1e-9")});
    const std::string comma = names.empty() ? "" : ", ";
    names += comma + column;
    gains += comma + ShortNumber(gain) + " (+- " +
             ShortNumber(1.96 * turned.std_error) + ")";
    without = std::max(without, effort.without);
  }
  if (columns.empty()) return false;
  Finding finding;
  finding.fault = "effort_idle";
  finding.severity = Severity::kWrong;
  finding.weight = as_read.fit().error;
  finding.error_left = without;
  if (input.runs.size() == 1) finding.file = input.runs.front()->name;
  finding.subject = names;
  finding.evidence = "the motion follows it by a factor of " + gains +
                     " where 1 is meant; without it the model misses the data "
                     "by " +
                     TimesText(without) + ", with it by " +
                     TimesText(as_read.fit().error);
  finding.consequence =
      "what was recorded there is not what moved the mechanism";
  finding.remedies = {ColumnsFlag(input, columns)};
  findings->push_back(finding);
  return true;
}

}  // namespace sysid
