#pragma once

#include <vector>

#include "residuals/run.h"

namespace sysid {

// Parts of runs: to judge by, joined again, or fewer samples.

// Where no held-out runs are given: the last quarter of every run, which leaves
// `runs`. Its times go on.
std::vector<Run> HoldOutLastQuarter(std::vector<Run>* runs);

// The whole runs again.
std::vector<Run> JoinEnds(const std::vector<Run>& runs,
                          const std::vector<Run>& ends);

// Every n-th sample of runs that are faster than twice `rate`, Hz, with the
// mean efforts between: a search among models needs no more, and repeats the
// same rollouts hundreds of times. Returns the largest n.
int ThinRuns(double rate, std::vector<Run>* runs);

}  // namespace sysid
