#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// The candidates as a reader wants them: ranked, with what the refits said, and
// with what the data cannot tell from each.

// A candidate that was refitted.
struct Confirmation {
  double train = 0.0, holdout = 0.0;  // normalised errors
  CrossValidation cv;
  double segment_s = 0.0;  // over which they are
  // The effects that were added with it: another one, where only both help, or
  // the others of the model in which the search ended.
  std::vector<std::string> together_with;
  std::vector<ParameterEstimate> parameters;  // the effect's
  bool accepted = false;
  std::string refused;  // why, where it was not accepted
};

struct CandidateEffect {
  ScreenedEffect screened;
  std::optional<Confirmation> confirmed;
  // Others that explain this data as well, and what motion would tell them
  // from it.
  std::vector<std::string> indistinguishable_from;
  std::string told_apart_by;
  // The force that it would add with the expected parameters: of each curve of
  // Where::force at its times (AddForcesToCompare); empty where it acts
  // otherwise, on sensors.
  std::vector<std::vector<double>> force;
};

// The motion in which two effects differ.
std::string ToldApartBy(const Effect& one, const Effect& other);

// The estimates that a evaluated has of the effects' parameters.
std::vector<ParameterEstimate> EstimatesOf(
    const EvaluatedModel& evaluated, const std::vector<const Effect*>& effects);

}  // namespace sysid
