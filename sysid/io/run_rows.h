#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"

namespace sysid {

// Samples [first, last) of a run.
Run RowsOf(const Run& run, int first, int last);

// Takes out the rows before anything was measured: a state there would be free,
// and everything is predicted from the state at the first row. A notice where
// there are any.
void BeginMeasured(Run* run, std::vector<std::string>* notices);

// Counts the turns of hinges on where a sensor wraps: all it says lies within
// one turn, and a step by nearly all of it (to a fifth) from one measured
// sample to the next is none of the hinge. A notice names the columns and how
// often.
void CountTurns(const Mechanism& mechanism, Run* run,
                std::vector<std::string>* notices);

}  // namespace sysid
