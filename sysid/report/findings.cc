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
                      const std::vector<Finding>& findings,
                      const std::vector<std::string>& notices) {
  Json json;
  json["schema"] = "sysid.check/1";
  json["model"] = model;
  json["runs"] = runs;
  json["findings"] = ToJson(findings);
  json["notices"] = notices;
  return Dump(json);
}

std::string CheckText(const std::string& model, size_t runs,
                      const std::vector<Finding>& findings) {
  const std::string count =
      std::to_string(runs) + (runs == 1 ? " run" : " runs");
  if (findings.empty()) {
    return model + ": nothing wrong with " + count + "\n";
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
