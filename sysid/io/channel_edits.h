#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"
#include "sysid/io/scoped_name.h"

namespace sysid {

// What flags change in a recording once it is read: --shift and --ignore, or
// `shift:` and `ignore:` of a fit specification.

// The column `name` was recorded `delay` seconds late (negative: early): what
// stands at t was so at t - delay. A quaternion or vector moves as a whole,
// whichever of its columns is named; "J.tau" too, and "J" means all that is
// measured of joint J, but for its effort.
struct ChannelShift {
  std::string name;  // "joint1.q", "joint1.tau"; "b.csv/joint1.q" (ScopedName)
  double delay = 0.0;  // s
  std::string place;   // for errors: "--shift"
};

// The measurements of a column from t_start to t_end are taken as missing.
struct IgnoredSpan {
  std::string name;  // "joint1.q", "b.csv/joint1.q" (ScopedName)
  double t_start = 0.0, t_end = 0.0;  // s, both included
  std::string place;
};

struct ChannelEdits {
  std::vector<ChannelShift> shifts;
  std::vector<IgnoredSpan> ignored;
};

// "joint1.q=0.010,joint2.tau=-0.002". Throws InputError for an entry without
// '=', a delay that is no finite number, a column that comes twice.
std::vector<ChannelShift> ParseShifts(const std::string& text,
                                      const std::string& place);
// "joint1.q@12.3:14.5,b.csv/joint2.q@0:1". Throws InputError for what does not
// read so, and a span that ends before it begins.
std::vector<IgnoredSpan> ParseIgnored(const std::string& text,
                                      const std::string& place);

// As they are parsed: "joint1.q=0.01", "joint1.q@12.3:14.5".
std::string ToString(const ChannelShift& shift);
std::string ToString(const IgnoredSpan& span);

// Those of `winner`, then those of `base` of which no one of these shifts all
// columns, of the same runs; ignored spans add up.
ChannelEdits MergeEdits(const ChannelEdits& base, const ChannelEdits& winner,
                        const Mechanism& mechanism);

// Throws InputError at the entry's place for a name that is no column of this
// mechanism's (nearest name).
void CheckEdits(const ChannelEdits& edits, const Mechanism& mechanism);

// A name of the flags, split from the run that it is meant for: of a column, or
// of all that is measured of a joint or link.
ScopedName EditedName(const std::string& text, const Mechanism& mechanism);

// Shifts, then ignores; what is ignored is so at the times of the shifted run.
// Each group of columns is shifted once: of several entries for it one for this
// run alone wins over one for all, then a column over its joint. `notices` (may
// be null) says what was not there to be edited. Throws InputError for a shift
// as long as the run, and for two of one group between which nothing chooses.
//
// Shifted values are a channel's at t + delay: where the samples are even and
// the delay is a whole number of them, those samples; else on the cubic through
// the four samples around (Catmull-Rom with the samples' own times), a
// quaternion by slerp between two. At an end where there is nothing to take the
// measurement is missing. An effort is held from sample to sample, and so is
// its shift: what acts at t is what was recorded at t + delay, at the ends the
// nearest.
void ApplyEdits(const ChannelEdits& edits, const Mechanism& mechanism, Run* run,
                std::vector<std::string>* notices);

// Takes out the channels of which the edits left nothing: they were not
// measured. A notice for each; InputError at `place` where none is left.
void DropUnmeasured(const std::string& place, Run* run,
                    std::vector<std::string>* notices);

}  // namespace sysid
