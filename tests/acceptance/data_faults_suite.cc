// How often sysid_check names a planted fault first, and how often it finds
// something in recordings without one: the table of docs/checks.md.
//
//   data_faults_suite [SEEDS [REAL_DATA [FAULT]]]

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "sysid/estimation/shooting_stage.h"
#include "tests/acceptance/checks/planted_fault.h"

namespace sysid {
namespace {

struct Count {
  int cases = 0, named = 0;
  std::map<std::string, int> instead;
};

std::string First(const std::vector<Finding>& findings) {
  return findings.empty() ? "nothing" : findings.front().fault;
}

void Print(const std::string& name, const Count& simulated,
           const Count& recorded) {
  const auto cell = [](const Count& count) {
    return count.cases == 0 ? std::string("-")
                            : std::to_string(count.named) + " of " +
                                  std::to_string(count.cases);
  };
  std::string instead;
  for (const Count* count : {&simulated, &recorded}) {
    for (const auto& [fault, times] : count->instead) {
      instead += " " + fault + " x" + std::to_string(times);
    }
  }
  std::printf("| `%s` | %s | %s |%s |\n", name.c_str(), cell(simulated).c_str(),
              cell(recorded).c_str(), instead.c_str());
  std::fflush(stdout);
}

void PrintTable(int seeds, const std::string& folder, const std::string& only) {
  const std::vector<CleanCase> recorded = RecordedCases(folder);
  double longest = 0.0;
  const auto check = [&](const Session& session) {
    const double start = Now();
    std::vector<Finding> findings = CheckCase(session);
    longest = std::max(longest, Now() - start);
    return findings;
  };
  std::printf(
      "| fault | simulated | recorded | named instead |\n|---|---|---|---|\n");
  Count all[2];
  for (const Fault& fault : Faults()) {
    if (!only.empty() && fault.name != only) continue;
    Count counts[2];
    for (int seed = 1; seed <= seeds; ++seed) {
      std::vector<CleanCase> cases = SimulatedCases(seed, false);
      cases.insert(cases.end(), recorded.begin(), recorded.end());
      for (const CleanCase& clean : cases) {
        const auto planted = fault.plant(clean, 1000 + seed);
        if (!planted) continue;
        const std::vector<Finding> findings = check(*planted);
        for (Count* count : {&counts[clean.real], &all[clean.real]}) {
          ++count->cases;
          if (IsNamed(fault, findings)) {
            ++count->named;
          } else if (count == &counts[clean.real]) {
            ++count->instead[First(findings) + " (" + clean.name + ")"];
          }
        }
      }
    }
    Print(fault.name, counts[0], counts[1]);
  }
  Print("all", all[0], all[1]);
  if (!only.empty()) return;
  Count clean[2];
  const auto judge = [&](const CleanCase& one) {
    const std::vector<Finding> findings = check(one.session);
    ++clean[one.real].cases;
    if (findings.empty()) {
      ++clean[one.real].named;
    } else {
      ++clean[one.real].instead[First(findings) + " (" + one.name + ")"];
    }
  };
  for (int seed = 1; seed <= 4 * seeds; ++seed) {
    for (const bool missing : {false, true}) {
      for (const CleanCase& one : SimulatedCases(100 + seed, missing)) {
        judge(one);
      }
    }
  }
  for (const CleanCase& one : recorded) judge(one);
  Print("no fault: nothing found", clean[0], clean[1]);
  std::printf("\nlongest check: %.1f s\n", longest);
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  sysid::PrintTable(argc > 1 ? std::atoi(argv[1]) : 2,
                    argc > 2 ? argv[2] : SYSID_REAL_DATA_DEFAULT,
                    argc > 3 ? argv[3] : "");
}
