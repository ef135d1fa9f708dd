#include "sysid/report/findings.h"

#include <algorithm>
#include <cstdio>

#include "sysid/io/cell.h"

namespace sysid {

std::string CheckJson(const std::string& model,
                      const std::vector<std::string>& runs,
                      const CheckResult& result,
                      const std::vector<std::string>& notices) {
  Json compared = Json::array();
  for (const ComparedExplanation& one : result.compared) {
    compared.push_back({{"explanation", one.what},
                        {"of", one.of_data ? "data" : "model"},
                        {"accepted", one.verdict == DataVerdict::kAccepted},
                        {"undecided", one.verdict == DataVerdict::kUndecided},
                        {"error", Finite(one.error)},
                        {"error_ratio", Finite(one.error_ratio)}});
  }
  return Dump({{"schema", "sysid.check/1"},
               {"model", model},
               {"runs", runs},
               {"error", Finite(result.error)},
               {"findings", result.findings},
               {"compared", compared},
               {"notices", notices}});
}

namespace {

// Effects of the model and the faults of the data that were not rejected, the
// best first.
std::string ComparedText(const std::vector<ComparedExplanation>& compared) {
  if (compared.empty()) return "";
  std::string text =
      "\nheld-out error of each explanation, relative to the model as given:\n";
  for (const ComparedExplanation& one : compared) {
    if (one.of_data && one.verdict == DataVerdict::kRejected) continue;
    char line[32];
    std::snprintf(line, sizeof(line), "  %8.3g  %-5s  ", one.error_ratio,
                  one.of_data ? "data" : "model");
    text += line + one.what +
            (one.verdict == DataVerdict::kUndecided ? " (undecided)" : "") +
            "\n";
  }
  return text;
}

bool HasUndecided(const std::vector<ComparedExplanation>& compared) {
  return std::any_of(compared.begin(), compared.end(),
                     [](const ComparedExplanation& one) {
                       return one.verdict == DataVerdict::kUndecided;
                     });
}

}  // namespace

std::string CheckText(const std::string& model, size_t runs,
                      const CheckResult& result) {
  const std::vector<Finding>& findings = result.findings;
  const std::string count = CountOf(runs, "run");
  if (findings.empty()) {
    std::string text = model + ": nothing wrong with " + count;
    if (result.error > kExplained) {
      text += " was found, but the error of the model is " +
              ShortNumber(result.error) + " times the noise: ";
      if (HasUndecided(result.compared)) {
        text += "whether a fault of the data explains it is undecided; ";
      }
      text += "sysid_diagnose looks for missing effects";
    }
    return text + "\n" + ComparedText(result.compared);
  }
  std::string text = model + ": " + CountOf(findings.size(), "finding") +
                     " in " + count + ", the worst first\n";
  const std::vector<Finding> shown = Gathered(findings);
  for (size_t i = 0; i < shown.size(); ++i) {
    text += "\n" + std::to_string(i + 1) + ". " + FullText(shown[i]);
  }
  return text + ComparedText(result.compared);
}

}  // namespace sysid
