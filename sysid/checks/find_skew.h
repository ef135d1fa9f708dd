#pragma once

#include <vector>

#include "sysid/checks/as_read.h"

namespace sysid {

// Whether a joint's column is late beside the others', by the equations of
// motion (EquationError): where the model misses so much of a motion that its
// prediction does not tell. Of mechanisms whose joints are all simple and
// measured, two at least. Appends the finding.
bool FindSkew(const AsRead& as_read, std::vector<Finding>* findings);

}  // namespace sysid
