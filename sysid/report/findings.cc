#include "sysid/report/findings.h"

#include <algorithm>
#include <cstdio>

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
  json["compared"] = Json::array();
  for (const ComparedExplanation& one : result.compared) {
    json["compared"].push_back({{"explanation", one.what},
                                {"of", one.of_data ? "data" : "model"},
                                {"error", Finite(one.error)},
                                {"error_ratio", Finite(one.error_ratio)}});
  }
  json["notices"] = notices;
  return Dump(json);
}

namespace {

// Faults of the data and effects of the model, the best first.
std::string ComparedText(const std::vector<ComparedExplanation>& compared) {
  constexpr size_t kMost = 8;
  if (compared.empty()) return "";
  std::string text =
      "\nexplanations by the error that they leave in windows that were not "
      "fitted,\nrelative to the model as given:\n";
  for (size_t i = 0; i < std::min(kMost, compared.size()); ++i) {
    char line[32];
    std::snprintf(line, sizeof(line), "  %8.3g  %-5s  ",
                  compared[i].error_ratio,
                  compared[i].of_data ? "data" : "model");
    text += line + compared[i].what + "\n";
  }
  return text;
}

}  // namespace

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
    return text + "\n" + ComparedText(result.compared);
  }
  std::string text = model + ": " + std::to_string(findings.size()) +
                     (findings.size() == 1 ? " finding" : " findings") +
                     " in " + count + ", the worst first\n";
  for (size_t i = 0; i < findings.size(); ++i) {
    text += "\n" + std::to_string(i + 1) + ". " + FullText(findings[i]);
  }
  return text + ComparedText(result.compared);
}

}  // namespace sysid
