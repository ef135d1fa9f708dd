#pragma once

#include <vector>

#include "tests/acceptance/checks/planted_fault.h"

// Every kind of fault: a file here and a line in each of these lists.

namespace sysid {

std::vector<Fault> UnitFaults();
std::vector<Fault> SignFaults();
std::vector<Fault> OrderFaults();
std::vector<Fault> QuaternionFaults();
std::vector<Fault> TimeFaults();
std::vector<Fault> ValueFaults();
std::vector<Fault> SampleFaults();
std::vector<Fault> IdleEffortFaults();
std::vector<Fault> VelocityFaults();
std::vector<Fault> BodyFaults();

using FaultKind = std::vector<Fault> (*)();
inline constexpr FaultKind kFaultKinds[] = {
    UnitFaults,  SignFaults,   OrderFaults,      QuaternionFaults, TimeFaults,
    ValueFaults, SampleFaults, IdleEffortFaults, VelocityFaults,   BodyFaults,
};

}  // namespace sysid
