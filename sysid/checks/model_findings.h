#pragma once

#include <string>
#include <vector>

#include "models/model.h"
#include "sysid/checks/finding.h"

namespace sysid {

// What is wrong with the model that a file gave, one finding for each kind of
// fault, whatever the number of links: a URDF as it is published.
std::vector<Finding> ModelFindings(const Model& model, const std::string& file);

}  // namespace sysid
