#pragma once

#include <string>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// The live line of long work: what is done, the iteration, the error, and the
// seconds left at the pace since this began, if it takes all the iterations
// that it may.
class ProgressLine {
 public:
  // Of each report in turn; `now` of a steady clock, s.
  std::string Next(const Progress& progress, double now);

 private:
  std::string doing_;
  double began_s_ = 0.0;
  int first_ = 0, last_ = 0;  // iterations that were reported of it
};

}  // namespace sysid
