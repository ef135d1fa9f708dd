#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"

namespace sysid {

// What recordings lack of efforts: the joint may have been without a drive, or
// its effort was not recorded. An effort that was recorded as zero is none of
// that (HasEffort).

// A notice of joints of which no run has an effort while it has some of others.
void NotePassive(const std::vector<const Run*>& runs,
                 const Mechanism& mechanism, std::vector<std::string>* notices);

// A notice of each run without the effort of a joint that another run drives.
void NoteUndriven(const std::vector<const Run*>& all,
                  const Mechanism& mechanism,
                  std::vector<std::string>* notices);

}  // namespace sysid
