#pragma once

#include <string>

#include "sysid/diagnosis/diagnose.h"

namespace sysid {

// What is said of a diagnosis by the equations of motion (Diagnosis::look).

// Of an arm, whose motion nothing follows that misses so much.
std::string ArmSentence(const Diagnosis& diagnosis);

// What a diagnosis of an arm has found, by effect.
std::string ArmText(const Diagnosis& diagnosis);

}  // namespace sysid
