#include "sysid/report/findings.h"

namespace sysid {

Json ToJson(const std::vector<Finding>& findings) {
  Json list = Json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"fault", finding.fault},
                    {"severity", ToString(finding.severity)},
                    {"file", finding.file},
                    {"subject", finding.subject},
                    {"t_start", Finite(finding.t_start)},
                    {"t_end", Finite(finding.t_end)},
                    {"evidence", finding.evidence},
                    {"consequence", finding.consequence},
                    {"remedies", finding.remedies}});
  }
  return list;
}

std::string CheckJson(const std::string& model,
                      const std::vector<std::string>& runs,
                      const CheckResult& result,
                      const std::vector<std::string>& notices) {
  Json json;
  json["schema"] = "sysid.check/1";
  json["model"] = model;
  json["runs"] = runs;
  json["error"] = Finite(result.error);
  json["findings"] = ToJson(result.findings);
  json["notices"] = notices;
  return Dump(json);
}

std::string CheckText(const std::string& model, size_t runs,
                      const CheckResult& result) {
  const std::vector<Finding>& findings = result.findings;
  const std::string count =
      std::to_string(runs) + (runs == 1 ? " run" : " runs");
  if (findings.empty()) {
    std::string text = model + ": nothing wrong with " + count;
    if (result.error > kExplained) {
      text += " that could be told, but the model misses " +
              std::string(runs == 1 ? "it" : "them") + " by " +
              ShortNumber(result.error) +
              " times the noise: sysid_diagnose says what it lacks";
    }
    return text + "\n";
  }
  std::string text = model + ": " + std::to_string(findings.size()) +
                     (findings.size() == 1 ? " finding" : " findings") +
                     " in " + count + ", the worst first\n";
  for (size_t i = 0; i < findings.size(); ++i) {
    text += "\n" + std::to_string(i + 1) + ". " + FullText(findings[i]);
  }
  return text;
}

}  // namespace sysid
