// A clock that runs too fast or too slow.

#include <cmath>

#include "sysid/hypotheses/families/families.h"

namespace sysid {

// t was recorded exp(p) times too long. A mechanism that only swings then seems
// to feel a gravity of g exp(-2 p).
void ClockHypotheses(const CheckInput& input,
                     std::vector<DataHypothesis>* all) {
  DataHypothesis hypothesis;
  hypothesis.fault = DataFault::kClockScale;
  hypothesis.subjects = {"t"};
  hypothesis.probe = 1e-4;  // far above rounding, and linear there
  hypothesis.least = 0.03;  // lengths of a data sheet are no better than 6 %
  hypothesis.most = 1.5;
  hypothesis.starts = {-0.6, -0.3, -0.1, 0.1, 0.3, 0.6};
  hypothesis.like_bodies = true;
  hypothesis.corrected = [](double p) { return Scaled({"t"}, std::exp(-p)); };
  const double g = input.model->nominal().gravity;
  hypothesis.says = [g](double p, double within) {
    return "with times " + ShortNumber(std::exp(-p)) + " (+- " +
           ShortNumber(within * std::exp(-p)) + ") as long (or a gravity of " +
           ShortNumber(g * std::exp(-2 * p)) +
           " m/s^2: a wrong clock, or wrong lengths)";
  };
  hypothesis.consequence =
      "fitted lengths, masses or frictions compensate for the wrong clock";
  all->push_back(hypothesis);
}

}  // namespace sysid
