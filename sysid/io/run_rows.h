#pragma once

#include <string>
#include <vector>

#include "residuals/run.h"

namespace sysid {

// Samples [first, last) of a run.
Run RowsOf(const Run& run, int first, int last);

// Takes out the rows before anything was measured: a state there would be free,
// and everything is predicted from the state at the first row. A notice where
// there are any.
void BeginMeasured(Run* run, std::vector<std::string>* notices);

}  // namespace sysid
