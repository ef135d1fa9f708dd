#pragma once

#include <string>
#include <vector>

namespace sysid {

// Notices as a terminal shows them, where many runs have some: what several
// runs have in common is said once, with the first of them and their number,
// and of what is left the first dozen, with the number of the others. Notices
// of runs begin with the run's name, a colon and a space; all others, and those
// of up to three runs, stay as they are.
std::vector<std::string> GatherNotices(const std::vector<std::string>& notices,
                                       const std::vector<std::string>& runs);

// Those that are not there yet.
void AddNewNotices(const std::vector<std::string>& notices,
                   std::vector<std::string>* all);

}  // namespace sysid
