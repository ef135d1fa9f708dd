#include "sysid/session/gather_notices.h"

#include <algorithm>
#include <map>
#include <set>

#include "sysid/io/cell.h"

namespace sysid {
namespace {

// So many runs are read one by one, so many lines at most (a screen has 24).
constexpr size_t kFewRuns = 3, kMostLines = 12;

// The length of the run's name at the beginning of a notice; 0: of no run.
size_t RunOf(const std::string& notice, const std::set<std::string>& runs) {
  size_t longest = 0;
  for (size_t at = notice.find(": "); at != std::string::npos;
       at = notice.find(": ", at + 1)) {
    if (runs.contains(notice.substr(0, at))) longest = at;
  }
  return longest;
}

}  // namespace

std::vector<std::string> GatherNotices(const std::vector<std::string>& notices,
                                       const std::vector<std::string>& runs) {
  const std::set<std::string> names(runs.begin(), runs.end());
  std::map<std::string, std::vector<std::string>> runs_of;  // by what is said
  std::set<std::string> concerned;
  for (const std::string& notice : notices) {
    const size_t run = RunOf(notice, names);
    if (run == 0) continue;
    runs_of[notice.substr(run)].push_back(notice.substr(0, run));
    concerned.insert(notice.substr(0, run));
  }
  if (concerned.size() <= kFewRuns) return notices;
  std::vector<std::string> gathered;
  std::set<std::string> left_out;  // runs
  size_t lines = 0, more = 0, last = 0;
  for (const std::string& notice : notices) {
    const size_t run = RunOf(notice, names);
    if (run == 0) {
      gathered.push_back(notice);
      continue;
    }
    const auto group = runs_of.find(notice.substr(run));
    if (group == runs_of.end()) continue;  // said
    const std::vector<std::string>& those = group->second;
    if (lines < kMostLines) {
      gathered.push_back(those.front() +
                         (those.size() > 1
                              ? " and " + CountOf(those.size() - 1, "more run")
                              : "") +
                         group->first);
      last = gathered.size();
      ++lines;
    } else {
      more += those.size();
      left_out.insert(those.begin(), those.end());
    }
    runs_of.erase(group);
  }
  if (more > 0) {
    gathered.insert(gathered.begin() + last,
                    CountOf(more, "more notice") + " of " +
                        CountOf(left_out.size(), "run") +
                        ": --json FILE has all");
  }
  return gathered;
}

void AddNewNotices(const std::vector<std::string>& notices,
                   std::vector<std::string>* all) {
  for (const std::string& notice : notices) {
    if (std::find(all->begin(), all->end(), notice) == all->end()) {
      all->push_back(notice);
    }
  }
}

}  // namespace sysid
