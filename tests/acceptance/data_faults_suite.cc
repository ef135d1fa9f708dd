// How often sysid_check names a planted fault first, and how often it finds
// something in recordings without one: the table of docs/checks.md.
//
//   data_faults_suite [FIRST:LAST [REAL_DATA [FAULT,... [CASE,...]]]]
//
// Seeds FIRST to LAST (1:2); "none" for FAULT are the recordings without one;
// "all" is every fault; a CASE is a model's name.
// What is not as it should be goes to stderr, case by case.

#include <glog/logging.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <set>
#include <sstream>
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

struct Request {
  int first = 1, last = 2;              // seeds
  std::string folder;                   // of the real recordings
  std::set<std::string> faults, cases;  // all of them where it is empty

  bool Wants(const std::string& fault) const {
    return faults.empty() || faults.contains("all") || faults.contains(fault);
  }
  bool WantsCase(const CleanCase& clean) const {
    return cases.empty() || cases.contains(clean.name);
  }
};

std::set<std::string> ListOf(const std::string& text) {
  std::set<std::string> list;
  std::stringstream stream(text);
  for (std::string item; std::getline(stream, item, ',');) list.insert(item);
  return list;
}

void Tell(const std::string& what, const CleanCase& clean, int seed,
          const std::vector<Finding>& findings) {
  std::fprintf(
      stderr, "%s in %s, seed %d: %s\n", what.c_str(), clean.name.c_str(), seed,
      findings.empty() ? "nothing" : FullText(findings.front()).c_str());
}

void PrintTable(const Request& request) {
  const std::string& folder = request.folder;
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
    if (!request.Wants(fault.name)) continue;
    Count counts[2];
    for (int seed = request.first; seed <= request.last; ++seed) {
      std::vector<CleanCase> cases = SimulatedCases(seed, false);
      cases.insert(cases.end(), recorded.begin(), recorded.end());
      for (const CleanCase& clean : cases) {
        if (!request.WantsCase(clean)) continue;
        const auto planted = fault.plant(clean, 1000 + seed);
        if (!planted) continue;
        const std::vector<Finding> findings = check(*planted);
        if (!IsNamed(fault, findings)) Tell(fault.name, clean, seed, findings);
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
  if (!request.Wants("none")) return;
  Count clean[2];
  const auto judge = [&](const CleanCase& one, int seed) {
    if (!request.WantsCase(one)) return;
    const std::vector<Finding> findings = check(one.session);
    if (!findings.empty()) Tell("none", one, seed, findings);
    ++clean[one.real].cases;
    if (findings.empty()) {
      ++clean[one.real].named;
    } else {
      ++clean[one.real].instead[First(findings) + " (" + one.name + ")"];
    }
  };
  for (int seed = 4 * request.first - 3; seed <= 4 * request.last; ++seed) {
    for (const bool missing : {false, true}) {
      for (const CleanCase& one : SimulatedCases(100 + seed, missing)) {
        judge(one, 100 + seed);
      }
    }
  }
  for (const CleanCase& one : recorded) judge(one, 0);
  Print("no fault: nothing found", clean[0], clean[1]);
  std::printf("\nlongest check: %.1f s\n", longest);
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  FLAGS_minloglevel = google::GLOG_FATAL;  // Ceres reports each bad step
  sysid::Request request;
  if (argc > 1 &&
      std::sscanf(argv[1], "%d:%d", &request.first, &request.last) != 2) {
    std::fprintf(stderr, "seeds are FIRST:LAST, not %s\n", argv[1]);
    return 2;
  }
  request.folder = argc > 2 ? argv[2] : SYSID_REAL_DATA_DEFAULT;
  if (argc > 3) request.faults = sysid::ListOf(argv[3]);
  if (argc > 4) request.cases = sysid::ListOf(argv[4]);
  sysid::PrintTable(request);
}
