#pragma once

#include "sysid/checks/check.h"
#include "sysid/checks/knobs.h"

// Every check: a file and a line in each of its lists (docs/checks.md).

namespace sysid {

// Other readings of the data and the model (readings/).
void ReadFlippedSigns(const CheckInput& input, std::vector<Reading>* readings);
void ReadSwappedJoints(const CheckInput& input, std::vector<Reading>* readings);
void ReadAbsoluteAngles(const CheckInput& input,
                        std::vector<Reading>* readings);
void ReadOtherUnits(const CheckInput& input, std::vector<Reading>* readings);
void ReadQuaternions(const CheckInput& input, std::vector<Reading>* readings);
void ReadBodies(const CheckInput& input, std::vector<Reading>* readings);

// Readings with a number (knob_families/).
void FindDelays(const CheckInput& input, std::vector<Knob>* knobs);
void FindDrifts(const CheckInput& input, std::vector<Knob>* knobs);
void FindClock(const CheckInput& input, std::vector<Knob>* knobs);
void FindEffortGains(const CheckInput& input, std::vector<Knob>* knobs);

using KnobFamily = void (*)(const CheckInput& input, std::vector<Knob>* knobs);
inline constexpr KnobFamily kKnobFamilies[] = {FindDelays, FindDrifts,
                                               FindClock, FindEffortGains};

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
void CheckBodies(const CheckInput& input, std::vector<Finding>* findings);

inline constexpr NumbersCheck kNumbersChecks[] = {
    CheckJitter,       CheckGaps,         CheckSamples, CheckRates,
    CheckSpikes,       CheckSaturation,   CheckFrozen,  CheckStill,
    CheckQuantisation, CheckVelocities,   CheckRanges,  CheckBodies,
    CheckDegrees,      CheckEffortSpikes,
};

inline constexpr ReadingFamily kReadingFamilies[] = {
    ReadFlippedSigns, ReadSwappedJoints, ReadAbsoluteAngles,
    ReadOtherUnits,   ReadQuaternions,   ReadBodies,
};

}  // namespace sysid
