#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sysid/checks/check.h"
#include "sysid/hypotheses/data_hypothesis.h"

namespace sysid {

// What hypotheses about the data explain of what a model misses.
struct HypothesisReport {
  std::vector<Finding> findings;
  std::optional<Supposition> found;  // of the findings
  // Of the held-out windows of a coarse fit as the data were read, in times the
  // noise. NaN where there is no motion to ask, or none that is smooth.
  double error = std::numeric_limits<double>::quiet_NaN();
  // Faults that the budget left no work for, as ToString names them.
  std::vector<std::string> not_asked;
  // Models with more physics and faults of the data, in one table.
  std::vector<ComparedExplanation> compared;
  double work = 0.0;  // spent
};

// Fits and judges hypotheses about the data in competition with effects and the
// augmented model (docs/checks.md), the most promising first. `budget`: work in
// samples that are rolled out without derivatives (EstimationWork); infinity
// asks all.
HypothesisReport TestHypotheses(const CheckInput& input, double budget);

}  // namespace sysid
