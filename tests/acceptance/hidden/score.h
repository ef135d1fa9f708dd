#pragma once

#include <string>
#include <vector>

#include "tests/acceptance/hidden/outcome.h"

namespace sysid {

// A case that was run.
struct Scored {
  HiddenCase info;
  std::vector<double> magnitudes;
  Outcome outcome;
  // Of a pair: the error with only the other effect in the model, for each.
  std::vector<double> without;

  bool complete() const { return info.planted.empty(); }
  // Whether the effects move the error of the plain model enough to be asked
  // for (issue 3: above 1.5 times the noise); of a pair also each by itself,
  // when the other is known.
  bool Shows() const;
  // A planted effect, or one that the data cannot tell from it, is first.
  bool Hit() const;
  // Each planted effect, or one that cannot be told from it, was added.
  bool FoundAll() const;
  // Something was found where nothing is hidden.
  bool FalseAlarm() const;
  bool AtNoise() const;  // the final error is at most 1.1 times the noise
  // Predicted over achieved fall of the error by the first step; NaN where
  // none.
  double PredictedOverAchieved() const;
};

// Markdown: what the suite promises beside what was measured, then a row for
// each effect, each mechanism and each engine.
std::string SuiteTable(const std::vector<Scored>& cases);

// A line a case.
std::string SuiteCsv(const std::vector<Scored>& cases);

}  // namespace sysid
