#pragma once

#include <functional>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/checks/check.h"
#include "sysid/checks/remedy.h"

namespace sysid {

// A fault that a recording or a model may have, as an explanation of what a
// fit misses (docs/checks.md, "Hypotheses about the data"): the recording
// undone of it is fitted and judged as a model with one more effect is.

enum class DataFault {
  kAxisFlipped,
  kEffortFlipped,
  kJointsSwapped,
  kEffortsSwapped,
  kAbsoluteAngle,
  kDegrees,
  kMillimetres,
  kCentimetres,
  kMilliseconds,
  kQuaternionOrder,
  kQuaternionInverse,
  kInertiaAboutJoint,
  kMassInGrams,
  kChannelLate,
  kEffortScale,
  kEffortIdle,
  kDrift,
  kClockScale,
};
std::string ToString(DataFault fault);  // "axis_flipped"

// What a user would change: flags, or lines of the URDF.
struct SuggestedFix {
  NewColumns columns;                // as ColumnsFlag takes them
  std::vector<std::string> shifted;  // as ShiftFlag takes them
  double delay = 0.0;
  std::vector<std::string> lines;
};

struct DataHypothesis {
  DataFault fault;
  std::vector<std::string> subjects;  // our columns, joints or links
  std::vector<int> runs;              // of CheckInput::runs; empty: all

  // The recording without the fault, or the model; the other one is empty. A
  // discrete hypothesis ignores `p`, a continuous one changes nothing at 0.
  std::function<void(double p, Run* run)> change;
  std::function<void(Model* model)> change_model;
  // log |dy'/dy| of a channel where y' = f(y) is in another unit: errors
  // compare in the unit of the recording, (10.2). Empty: 0.
  std::function<double(const Channel& channel, double p)> log_unit;
  // The same of an effort.
  std::function<double(int v, double p)> log_effort;

  // Of a continuous hypothesis only. The step of its secant is `probe`; p is
  // sought from `starts` and the secant's own, within `most`; nothing below
  // `least` is worth a word; multiples of `grain` are meant where they do as
  // well.
  double probe = 0.0, least = 0.0, most = 0.0, grain = 0.0;
  std::vector<double> starts;
  bool is_continuous() const { return probe > 0.0; }

  // Whether masses, inertias or lengths with other values do the same: then
  // those are as the user gave them in what it competes with.
  bool like_bodies = false;

  // In words, with half the width of the 95 % interval.
  std::function<std::string(double p, double within)> says;
  std::string consequence;
  std::function<SuggestedFix(const CheckInput& of_run, double p)> fix;

  std::string subject() const { return Join(subjects); }
};

// A family: the hypotheses of one kind that this input could have. A family is
// a file in families/ and a line in the list of all, likelier kinds first.
using HypothesisFamily = void (*)(const CheckInput& input,
                                  std::vector<DataHypothesis>* hypotheses);
std::vector<DataHypothesis> AllHypotheses(const CheckInput& input);

// The same hypothesis of these runs alone.
DataHypothesis OfRuns(const DataHypothesis& hypothesis,
                      const std::vector<int>& runs);

// The hypothesis of a run, undone; nothing where it is not of that run.
void Undo(const DataHypothesis& hypothesis, double p, int run_index, Run* run);

// The fix as flags that can be pasted, and lines.
std::vector<std::string> FixTexts(const CheckInput& input,
                                  const DataHypothesis& hypothesis, double p);

}  // namespace sysid
