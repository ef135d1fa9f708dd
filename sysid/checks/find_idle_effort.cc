#include "sysid/checks/find_idle_effort.h"

#include <algorithm>
#include <cmath>

#include "sysid/checks/knobs.h"
#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"

namespace sysid {
namespace {

// The largest gain of an effort that does nothing: two efforts of some seconds
// are alike to a half by chance.
constexpr double kIdle = 0.6;
constexpr double kSignificance = 4.0;  // standard errors, from a gain of one
constexpr double kNoBetter = 1.05;

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
TurnedKnob GainOf(int v, const LooseModel& stiff, const QuickFit& given,
                  const AsRead& as_read) {
  TurnedKnob best;
  for (const double start : {0.0, -0.5, -1.0}) {
    const TurnedKnob turned = TurnKnob(stiff, given, as_read.excerpt(),
                                       as_read.options(), Gain(v), start);
    if (turned.error < best.error) best = turned;
  }
  return best;
}

}  // namespace

bool FindIdleEffort(const AsRead& as_read, std::vector<Finding>* findings) {
  const CheckInput& input = as_read.input();
  std::vector<const Joint*> driven;
  for (const Joint& joint : input.model->mechanism().joints) {
    if (IsSimple(joint) && IsDriven(input, joint)) driven.push_back(&joint);
  }
  if (driven.empty()) return false;
  const LooseModel stiff = WithGivenBodies(as_read.lean());
  const QuickFit given =
      FitQuickly(stiff, as_read.excerpt().Windows({}), as_read.options());
  if (!std::isfinite(given.error)) return false;
  NewColumns columns;
  std::string names, gains;
  double without = 0.0;
  for (const Joint* joint : driven) {
    const TurnedKnob turned = GainOf(joint->v_index, stiff, given, as_read);
    const double gain = 1.0 + turned.value;
    if (!(std::abs(gain) < kIdle &&
          1.0 - gain > kSignificance * turned.std_error &&
          turned.error < given.error)) {
      continue;
    }
    const double error =
        as_read
            .Fit([&](Run* run) { run->effort.col(joint->v_index).setZero(); })
            .error;
    if (!(error <= kNoBetter * as_read.fit().error)) continue;
    const std::string column = joint->name + ".tau";
    columns.push_back({column, Times(SourceOf(input, column), "1e-9")});
    const std::string comma = names.empty() ? "" : ", ";
    names += comma + column;
    gains += comma + ShortNumber(gain) + " (+- " +
             ShortNumber(1.96 * turned.std_error) + ")";
    without = std::max(without, error);
  }
  if (columns.empty()) return false;
  Finding finding;
  finding.fault = "effort_idle";
  finding.severity = Severity::kWrong;
  finding.weight = as_read.fit().error;
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
