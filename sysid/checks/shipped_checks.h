#pragma once

#include "sysid/checks/check.h"

// Every check of the numbers: a file and a line in each list (docs/checks.md).

namespace sysid {

// Of the numbers alone (numbers/).
void CheckJitter(const CheckInput& input, std::vector<Finding>* findings);
void CheckGaps(const CheckInput& input, std::vector<Finding>* findings);
void CheckSamples(const CheckInput& input, std::vector<Finding>* findings);
void CheckRates(const CheckInput& input, std::vector<Finding>* findings);
void CheckSpikes(const CheckInput& input, std::vector<Finding>* findings);
void CheckEffortSpikes(const CheckInput& input, std::vector<Finding>* findings);
void CheckSaturation(const CheckInput& input, std::vector<Finding>* findings);
void CheckFrozen(const CheckInput& input, std::vector<Finding>* findings);
void CheckStill(const CheckInput& input, std::vector<Finding>* findings);
void CheckQuantisation(const CheckInput& input, std::vector<Finding>* findings);
void CheckVelocities(const CheckInput& input, std::vector<Finding>* findings);
void CheckDegrees(const CheckInput& input, std::vector<Finding>* findings);
void CheckRanges(const CheckInput& input, std::vector<Finding>* findings);
void CheckLimits(const CheckInput& input, std::vector<Finding>* findings);
void CheckBodies(const CheckInput& input, std::vector<Finding>* findings);
void CheckMissingEfforts(const CheckInput& input,
                         std::vector<Finding>* findings);
void CheckModel(const CheckInput& input, std::vector<Finding>* findings);
void CheckUnmapped(const CheckInput& input, std::vector<Finding>* findings);

inline constexpr NumbersCheck kNumbersChecks[] = {
    CheckJitter,       CheckGaps,           CheckSamples,  CheckRates,
    CheckSpikes,       CheckSaturation,     CheckFrozen,   CheckStill,
    CheckQuantisation, CheckVelocities,     CheckRanges,   CheckBodies,
    CheckDegrees,      CheckEffortSpikes,   CheckUnmapped, CheckModel,
    CheckLimits,       CheckMissingEfforts,
};

}  // namespace sysid
