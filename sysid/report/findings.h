#pragma once

#include <string>
#include <vector>

#include "sysid/checks/check.h"
#include "sysid/report/json.h"
#include "sysid/session/session.h"

namespace sysid {

// `findings` of fit.json, diagnosis.json and check.json.
inline void to_json(Json& json, const Severity& severity) {
  json = ToString(severity);
}
SYSID_JSON(Finding, fault, severity, file, subject, t_start, t_end, evidence,
           consequence, remedies)

// `skipped_runs` of fit.json, diagnosis.json and comparison.json.
SYSID_JSON(SkippedRun, run, reason)

// check.json. Results as CheckData has them (check_data.h).
std::string CheckJson(const std::string& model,
                      const std::vector<std::string>& runs,
                      const CheckResult& result,
                      const std::vector<std::string>& notices);

// What sysid_check prints.
std::string CheckText(const std::string& model, size_t runs,
                      const CheckResult& result);

}  // namespace sysid
