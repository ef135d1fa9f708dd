#include "sysid/report/progress_line.h"

#include <algorithm>
#include <cstdio>

namespace sysid {

std::string ProgressLine::Next(const Progress& progress, double now) {
  // The same may be done again, of another model.
  if (progress.doing != doing_ || progress.iteration < last_) {
    doing_ = progress.doing;
    began_s_ = now;
    first_ = progress.iteration;
  }
  last_ = progress.iteration;
  char numbers[96];
  std::snprintf(numbers, sizeof numbers,
                ": iteration %d, error %.4g times the noise",
                progress.iteration, progress.error);
  std::string line = doing_ + numbers;
  if (progress.of > 0 && last_ > first_) {
    const double each = (now - began_s_) / (last_ - first_);
    std::snprintf(numbers, sizeof numbers, ", at most %.0f s left",
                  each * std::max(0, progress.of - last_));
    line += numbers;
  }
  return line;
}

}  // namespace sysid
