#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"
#include "sysid/parameters/fit_specification.h"

namespace sysid {

// Joints held still: --lock 'wheel_*,head_1=0.3', and `lock` of a
// specification.

// The joints that `locks` name or match (a pattern of fnmatch(3): * ? [..]),
// each once with its position, rad or m; without one it is zero, a ball's the
// identity, and a mimic's where it is with its leader at zero, or nothing where
// that is held too and puts it somewhere. Of locks that meet the later wins.
// Throws InputError at its place for one that meets no joint which moves, and
// for a ball at a number.
std::vector<NamedValue> ResolveLocks(const Mechanism& mechanism,
                                     const std::vector<NamedValue>& locks);

// The mechanism with these held (hold_joints.h); a notice for those that are
// held beyond their limits. Throws InputError where nothing is left to move.
Mechanism LockJoints(const Mechanism& mechanism,
                     const std::vector<NamedValue>& resolved,
                     std::vector<std::string>* notices);

// Leaves out effects on joints that are held still, which have no meaning, with
// a notice that names them.
void DropHeldEffects(const Mechanism& mechanism,
                     std::vector<Located<std::string>>* effects,
                     std::vector<std::string>* notices);

// The specification without effects on joints that are held still, nor what it
// says of their parameters.
FitSpecification WithoutHeld(const Mechanism& mechanism,
                             FitSpecification specification,
                             std::vector<std::string>* notices);

// A line that names the joints of which no run has a column, with the flag that
// holds them still; "" where there are none, or frames' positions measure them.
std::string UnmeasuredNotice(const Mechanism& mechanism,
                             const std::vector<const Run*>& runs,
                             const std::vector<NamedValue>& flag_locks);

// A run of a mechanism as one of the same with joints held still: without what
// is measured of those, and their efforts.
void DropHeldChannels(const Mechanism& mechanism, const Mechanism& held,
                      Run* run);

}  // namespace sysid
