#pragma once

#include <string>
#include <vector>

#include "sysid/checks/finding.h"
#include "sysid/report/json.h"

namespace sysid {

// `findings` of fit.json, diagnosis.json and check.json.
Json ToJson(const std::vector<Finding>& findings);

// check.json.
std::string CheckJson(const std::string& model,
                      const std::vector<std::string>& runs,
                      const std::vector<Finding>& findings,
                      const std::vector<std::string>& notices);

// What sysid_check prints.
std::string CheckText(const std::string& model, size_t runs,
                      const std::vector<Finding>& findings);

}  // namespace sysid
