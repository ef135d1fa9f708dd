#pragma once

#include <string>
#include <vector>

#include "sysid/session/session.h"

namespace sysid {

// The first input that an effect reads and a run does not have; null where
// there is none.
const EffectInput* MissingInput(const Effect& effect, const Run& run);

// Whether one of the runs has the position of a joint's motor.
bool MeasureMotor(const std::vector<const Run*>& runs, int joint);
// Whether one has that and the joint's own.
bool MeasureBothEnds(const std::vector<const Run*>& runs, int joint);

// Throws InputError at `place` where a run lacks what an effect reads, or all
// of them the motor's sensor that it is of.
void CheckCanRead(const Effect& effect, const std::vector<const Run*>& runs,
                  const std::string& place);
bool CanRead(const Effect& effect, const std::vector<const Run*>& runs);

// The columns of these runs that a law reads which a user typed, by their own
// names, as wind in "custom@joint1: k*wind". A file that cannot be read has
// none.
ColumnMap InputsOfLaws(const std::vector<std::string>& effects,
                       const std::vector<std::string>& files,
                       const Mechanism& mechanism);

// The fitted runs of a session, then those that are held out.
std::vector<const Run*> AllRunsOf(const Session& session);

}  // namespace sysid
