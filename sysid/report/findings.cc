#include "sysid/report/findings.h"

#include "sysid/io/cell.h"

namespace sysid {

std::string CheckJson(const std::string& model,
                      const std::vector<std::string>& runs,
                      const CheckResult& result,
                      const std::vector<std::string>& notices) {
  return Dump({{"schema", "sysid.check/1"},
               {"model", model},
               {"runs", runs},
               {"error", Finite(result.error)},
               {"findings", result.findings},
               {"notices", notices}});
}

std::string CheckText(const std::string& model, size_t runs,
                      const CheckResult& result) {
  const std::vector<Finding>& findings = result.findings;
  const std::string count = CountOf(runs, "run");
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
  std::string text = model + ": " + CountOf(findings.size(), "finding") +
                     " in " + count + ", the worst first\n";
  for (size_t i = 0; i < findings.size(); ++i) {
    text += "\n" + std::to_string(i + 1) + ". " + FullText(findings[i]);
  }
  return text;
}

}  // namespace sysid
