#pragma once

#include <functional>
#include <memory>
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

// A column without its fault: a sum of columns as they were read, each times a
// factor.
struct CorrectedColumn {
  std::string column;
  struct Term {
    double factor;
    std::string column;
  };
  std::vector<Term> terms;
};

struct DataHypothesis {
  DataFault fault;
  std::vector<std::string> subjects;  // our columns, joints or links
  std::vector<int> runs;              // of CheckInput::runs; empty: all

  // What is wrong; one of the three. From it follow the recording or the model
  // without the fault, units, and the flags or lines that mend it. A discrete
  // hypothesis ignores `p`, a continuous one changes nothing at 0.
  std::function<std::vector<CorrectedColumn>(double p)> corrected;
  std::vector<std::string> late;  // columns, recorded p seconds late
  std::function<void(Model* model)> change_model;  // links: the subjects

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

  // Whether effects of the catalogue (effort_delay, sensor_delay) say the same:
  // a search for effects decides between them.
  bool is_effect = false;

  // In words, with half the width of the 95 % interval.
  std::function<std::string(double p, double within)> says;
  std::string consequence;

  std::string subject() const { return Join(subjects); }
};

// A family: the hypotheses of one kind that this input could have. A family is
// a file in families/ and a line in the list of all, likelier kinds first.
using HypothesisFamily = void (*)(const CheckInput& input,
                                  std::vector<DataHypothesis>* hypotheses);
std::vector<DataHypothesis> AllHypotheses(const CheckInput& input);

// Whether a run is among these (empty: all are).
bool IsOfRun(const std::vector<int>& runs, int run);

// A hypothesis at a value of its scalar; none: the data as they were read.
struct Supposition {
  std::shared_ptr<const DataHypothesis> hypothesis;
  double p = 0.0;
};

// Of these runs alone (empty: of all).
Supposition Suppose(const DataHypothesis& hypothesis,
                    const std::vector<int>& runs, double p);

// Undoes what is supposed of the run with this index, if it is of that run.
void Undo(const Supposition& supposed, const Mechanism& mechanism,
          int run_index, Run* run);

// log |dy'/dy| of a column where y' = f(y) is what it should have been: errors
// compare in the unit of the recording, (10.2). Of a channel the mean over its
// columns.
double LogUnit(const Supposition& supposed, const std::string& column);
double LogUnit(const Supposition& supposed, const Mechanism& mechanism,
               const Channel& channel);

// The fix as flags that can be pasted, and lines of the URDF.
std::vector<std::string> FixTexts(const CheckInput& input,
                                  const Supposition& supposed);

}  // namespace sysid
