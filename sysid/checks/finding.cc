#include "sysid/checks/finding.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "sysid/io/cell.h"

namespace sysid {

std::string ToString(Severity severity) {
  constexpr const char* kNames[] = {"unreadable", "wrong", "harmful", "note"};
  return kNames[static_cast<int>(severity)];
}

std::string ShortNumber(double value) { return Format("%.4g", value); }

void NameAlso(const std::string& says, const std::vector<std::string>& remedies,
              Finding* finding) {
  const bool is_second = finding->remedies.size() == 1;
  finding->evidence +=
      (is_second ? "; undecided between this and reading it " : ", or ") + says;
  finding->remedies.insert(finding->remedies.end(), remedies.begin(),
                           remedies.end());
}

void Sort(std::vector<Finding>* findings) {
  const auto rank = [](const Finding& finding) {
    const bool is_guess = finding.error_left > kExplained;  // not of NaN
    const Severity severity =
        is_guess ? std::max(finding.severity, Severity::kHarmful)
                 : finding.severity;
    return std::make_tuple(severity, is_guess, -finding.weight);
  };
  std::stable_sort(
      findings->begin(), findings->end(),
      [&](const Finding& a, const Finding& b) { return rank(a) < rank(b); });
}

std::vector<Finding> Gathered(const std::vector<Finding>& findings) {
  constexpr size_t kFew = 3;
  using Kind = std::tuple<std::string, std::string, Severity>;
  const auto kind_of = [](const Finding& finding) {
    return Kind{finding.fault, finding.file, finding.severity};
  };
  std::map<Kind, std::vector<std::string>> subjects;
  for (const Finding& finding : findings) {
    subjects[kind_of(finding)].push_back(finding.subject);
  }
  std::vector<Finding> gathered;
  std::set<Kind> done;
  for (const Finding& finding : findings) {
    const Kind kind = kind_of(finding);
    std::vector<std::string>& all = subjects[kind];
    if (done.contains(kind)) continue;
    if (all.size() > kFew) {
      done.insert(kind);
      gathered.push_back(finding);
      all.erase(all.begin());
      gathered.back().evidence +=
          "; so too " + std::to_string(all.size()) + " more: " + JoinSome(all);
    } else {
      gathered.push_back(finding);
    }
  }
  return gathered;
}

std::string PlaceOf(const Finding& finding) {
  std::string place = finding.file;
  const auto add = [&](const std::string& separator, const std::string& text) {
    if (text.empty()) return;
    place += (place.empty() ? "" : separator) + text;
  };
  add(": ", finding.subject);
  if (std::isfinite(finding.t_start)) {
    add(", ", ShortNumber(finding.t_start) + " s to " +
                  ShortNumber(finding.t_end) + " s");
  }
  return place;
}

std::string BriefText(const Finding& finding) {
  const std::string place = PlaceOf(finding);
  std::string text = finding.fault + (place.empty() ? "" : ": ") + place +
                     ": " + finding.evidence;
  if (!finding.remedies.empty()) text += "; try " + finding.remedies.front();
  return text;
}

std::string FullText(const Finding& finding) {
  const std::string place = PlaceOf(finding);
  std::string text = finding.fault + (place.empty() ? "" : "  ") + place + "\n";
  text += "    " + finding.evidence + "\n";
  if (!finding.consequence.empty()) text += "    " + finding.consequence + "\n";
  for (size_t i = 0; i < finding.remedies.size(); ++i) {
    text += (i == 0 ? "    suggested fix: " : "             or: ") +
            finding.remedies[i] + "\n";
  }
  return text;
}

}  // namespace sysid
