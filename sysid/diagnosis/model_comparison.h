#pragma once

#include <string>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// The models of a search beside each other (docs/theory.md, section 7): how
// well each predicts, over segments of one length.

// What a model leaves of the data.
struct ModelErrors {
  // Of the catalogue, in the model beside what it was given with.
  std::vector<std::string> effects;
  std::string change;      // the effect by which it differs; of a neighbour
  double segment_s = 0.0;  // over which the errors are
  ErrorSummary train, holdout;
  CrossValidation cv;
};

struct ModelComparison {
  // As given, and after each step; the last is the final model.
  std::vector<ModelErrors> path;
  // The final model, fitted again without each of its effects.
  std::vector<ModelErrors> left_out;
  // The same with one more, as it was tried last; the best first.
  std::vector<ModelErrors> added;
};

ModelErrors ErrorsOf(const EvaluatedModel& evaluated);

// A model at its values over the segments of the final one, unless it was
// fitted over such.
ModelErrors ErrorsOver(const DiagnosisProblem& problem,
                       const EvaluatedModel& evaluated,
                       const EvaluatedModel& final);

// Those of the models that were tried which differ from the final one by one
// effect, over its segments: in `left_out` and `added`.
void SetNeighbours(const std::vector<ModelErrors>& tried,
                   const EvaluatedModel& final, ModelComparison* comparison);

}  // namespace sysid
