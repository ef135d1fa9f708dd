#pragma once

#include <string>
#include <vector>

#include "residuals/run.h"
#include "sysid/io/channel_edits.h"
#include "sysid/io/column_map.h"

namespace sysid {

// Throws InputError for a recording that is given twice: it would count as
// twice the evidence, and one that is fitted is none to judge by.
void CheckDistinct(const std::vector<std::string>& traj,
                   const std::vector<std::string>& holdout);

// Throws InputError for a name that is meant for one run alone, of none of
// these files.
void CheckRunNames(const ColumnMap& columns, const ChannelEdits& edits,
                   const Mechanism& mechanism,
                   const std::vector<std::string>& files);

// Throws InputError for runs whose times allow no fit: too few samples; samples
// more than a second apart (milliseconds? a factor for the time switches this
// off); pauses that no prediction crosses.
void CheckTimes(const std::vector<Run>& runs);

// The largest range of a component of a channel, SI; 0 where nothing of it was
// measured.
double Range(const Channel& channel);

// Throws InputError where no channel of any run ever changes.
void CheckMotion(const std::vector<Run>& runs);

// Of a run that was made in memory: throws InputError, which names the run,
// where times do not rise, channels, efforts or inputs have not as many numbers
// as they must, a target is none of the mechanism's, or an effort or an input
// is no number.
void CheckShape(const Run& run, const Mechanism& mechanism);

}  // namespace sysid
