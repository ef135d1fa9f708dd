#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/diagnosis/candidate_refits.h"

namespace sysid {

// The candidates of a round as a reader wants them: ranked, with what the
// refits said, and with what the data cannot tell from each.

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

// The chosen first (`best` of the refits, -1: none), then the accepted, the
// refused, and the rest as screened.
std::vector<CandidateEffect> ListCandidates(
    const Screening& screening, const std::vector<CandidateRefit>& refits,
    int best);

// Whether two effects of a screening that were both refitted explain the data
// equally well, and the same part of it or all.
bool StandFor(const Screening& screening, int a, int b,
              const EvaluatedModel& with_a, const EvaluatedModel& with_b);

// Of a screening, those that would explain most of what an effect does and
// leave nearly as little, with no more parameters: the best few.
std::vector<std::string> AlikeTo(const Screening& screening,
                                 const std::string& effect);

// Single effects whose refits were accepted, and explain the same part of what
// the model misses as that of `best` does, with no more parameters.
std::vector<std::string> ThatExplainTheSame(
    const Screening& screening, const std::vector<CandidateRefit>& refits,
    int best);

// The motion in which two effects differ.
std::string ToldApartBy(const Effect& one, const Effect& other);

// The estimates that a evaluated has of the effects' parameters.
std::vector<ParameterEstimate> EstimatesOf(
    const EvaluatedModel& evaluated, const std::vector<const Effect*>& effects);

}  // namespace sysid
