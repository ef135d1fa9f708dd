#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "residuals/run.h"
#include "sysid/checks/finding.h"
#include "sysid/estimation/processes.h"

namespace sysid {

// How several processes share out the runs that a user lists.

// So many of a list of weights for each process, neighbours together, that the
// heaviest share is as light as can be.
std::vector<int> ShareOut(const std::vector<double>& weights, int processes);

// The files of this process: by their sizes.
std::vector<std::string> OwnFiles(const Processes& all,
                                  const std::vector<std::string>& files);

// Does work that may throw InputError for what this process has; where it does
// in any, all throw what the first of those did.
void DoAlike(const Processes& all, const std::function<void()>& work);

// Texts of all processes in the order of the runs.
std::vector<std::string> JoinLists(const Processes& all,
                                   const std::vector<std::string>& own);

// What all processes found in their runs, worst first; what several found, such
// as a fault of the model, once.
std::vector<Finding> FindingsOfAll(const Processes& all,
                                   std::vector<Finding> own);

// Runs of all processes without their samples: what there is, what moves, and
// what drives it. Of the times there are the ends, of a channel its least and
// its largest numbers, of an effort whether it acts (1) or never does (0), of
// an input its name.
std::vector<Run> OutlinesOfAll(const Processes& all,
                               const std::vector<Run>& own);

}  // namespace sysid
