#pragma once

#include <string>

#include "models/effects/effect.h"
#include "sysid/session/session.h"

namespace sysid {

// Whether a parameter is given and never fitted: one with a single value to
// try, as the range of a force table.
inline bool IsGiven(const EffectParameter& parameter) {
  return parameter.grid.size() == 1;
}

// Whether an effect is a table (force_table.h).
bool IsForceTable(const Effect& effect);

// Lets the tables of the session's model (force_table.h) reach over the
// positions and speeds of its runs, by a fortieth more, where nobody fixed
// their range; nearly a whole turn of a continuous joint is one. Their weights
// are believed to be zero, give or take a thirtieth of the joint's measured
// efforts (of all joints', where it has none; else of 1 N m or N): with that a
// table is smooth, and none where there is no data.
void CoverTables(Session* session);

}  // namespace sysid
