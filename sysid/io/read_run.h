#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"
#include "sysid/io/column_map.h"

namespace sysid {

// Reads a recording of this mechanism (contracts.md section 2). SI units;
// quaternions are normalised (files round them); an empty cell or nan is a
// missing measurement, and one missing number of a quaternion or vector makes
// its row missing. A missing effort holds the value before it (zero where there
// is none).
//
// `notices` (may be null) receives one line each for what was ignored or
// assumed: unknown columns, held efforts, positions that may be degrees.
//
// Throws InputError, with line, field and column name, for all that CsvFile and
// ResolveColumns refuse, and for: no header; no time, or one that is missing
// somewhere or does not increase; nothing measured; an incomplete quaternion or
// vector; a quaternion whose norm is off 1 by more than 0.01; a channel without
// any number; fewer than two rows; angles that look like degrees (see
// degrees.h; a factor in the map switches this off for its column).
Run ReadRun(const std::string& path, const ColumnMap& columns,
            const Mechanism& mechanism, std::vector<std::string>* notices);

// The same from text; `path` only names it.
Run ParseRun(const std::string& path, const std::string& text,
             const ColumnMap& columns, const Mechanism& mechanism,
             std::vector<std::string>* notices);

}  // namespace sysid
