#pragma once

#include <string>
#include <vector>

#include "sysid/diagnosis/evaluated_model.h"

namespace sysid {

// A law that explains is constant; one that only stands in for it has another
// coefficient at another time, speed, position, effort or amplitude, or in
// another run. Section 6 of docs/judgement.md.

// What the data is ordered by.
enum class Strata { kTime, kSpeed, kPosition, kEffort, kAmplitude, kRun };
const char* NameOf(Strata strata);  // as diagnosis.json has it: "time"

// A parameter of a law where the variable of the strata is between `from` and
// `to` (of runs: their numbers, from 1), all other parameters being the same in
// all strata.
struct StratumEstimate {
  double from = 0.0, to = 0.0, value = 0.0, std_error = 0.0;
};

enum class Trend { kNone, kRises, kFalls };  // of its size
const char* NameOf(Trend trend);             // "none", "rises", "falls"

struct ParameterByStrata {
  std::string effect, parameter, unit;
  Strata strata = Strata::kTime;
  std::string joint;  // whose motion the strata are of
  bool is_slide = false;
  std::vector<StratumEstimate> estimates;
  // tau / |mean|, tau by DerSimonian and Laird (1986).
  double spread = 0.0;
  // How much the law's force changes, at least (at 95 %), of its own: what
  // hardly acts in a stratum says little there.
  double least_spread = 0.0;
  // ln of how much less is left where it has its own value in each stratum.
  double gain = 0.0;
  // How much of what the law does this parameter does, at most 1.
  double part = 1.0;
  Trend trend = Trend::kNone;

  // Whether it varies by less than kStandsIn, or that does not matter (J.2).
  bool IsConstant() const;
};

// Of the effects that were added to a fitted model; by effect, parameter and
// strata. Strata in which nothing varies are left out. Nothing where the
// dynamics fail.
std::vector<ParameterByStrata> ParametersByStrata(
    const EvaluatedModel& evaluated);

// Of each effect with a parameter that is not constant where that tells most.
std::vector<ParameterByStrata> StandIns(
    const std::vector<ParameterByStrata>& all);

}  // namespace sysid
