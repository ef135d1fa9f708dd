#pragma once

#include "sysid/diagnosis/diagnose.h"

namespace sysid {

// Whether the fit of the model as it was given is one to search from.

// Why the base is not to be trusted.
void AddDoubts(Diagnosis* diagnosis);

}  // namespace sysid
