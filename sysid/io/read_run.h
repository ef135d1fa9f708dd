#pragma once

#include <memory>
#include <string>
#include <vector>

#include "models/mechanism.h"
#include "residuals/run.h"
#include "sysid/io/column_map.h"
#include "sysid/io/run_sources.h"
#include "sysid/io/table_file.h"

namespace sysid {

// Reads a recording of this mechanism (docs/interface.md section 2) in any
// format (table_file.h). SI units; quaternions are normalised (files round
// them); an empty cell or nan is a missing measurement, and one missing number
// of a quaternion or vector makes its row missing. A missing effort holds the
// value before it (zero where there is none).
//
// The rows go straight into the run: it takes the room of its numbers, and once
// more that of one column while they come.
//
// `notices` (may be null) receives one line each for what was ignored or
// assumed: unknown columns, held efforts, positions that may be degrees, and
// what the file's format leaves open. Text that a terminal can show.
//
// Throws InputError, with line, field and column name, for all that OpenTable,
// the file's class and ResolveColumns refuse, and for: no header; no time, or
// one that is missing somewhere or does not increase; nothing measured; an
// incomplete quaternion or vector; a quaternion whose norm is off 1 by more
// than 0.01; a channel without any number; fewer than two rows; angles that
// look like degrees in the first 2^20 samples (see degrees.h; a factor in the
// map switches this off for its column); an expression that is not finite
// somewhere.
Run ReadRun(const std::string& path, const ColumnMap& columns,
            const Mechanism& mechanism, std::vector<std::string>* notices);

// The same of a table that is open; it has what is asked of it.
Run ReadTable(std::unique_ptr<TableFile> table, const ColumnMap& columns,
              const Mechanism& mechanism, std::vector<std::string>* notices,
              RunContent content = RunContent::kMeasurements);

// The same of a file that need not measure anything, but must have an effort
// (kEfforts); of which only positions are used (kPositions), or only inputs
// (kInputs: InputColumns, and any column whose name is a plain word).
Run ReadContent(const std::string& path, RunContent content,
                const Mechanism& mechanism, std::vector<std::string>* notices);
// Those words, as a map of each onto itself.
ColumnMap OwnInputColumns(const std::string& path, const Mechanism& mechanism);
ColumnMap OwnInputColumns(const TableFile& table, const Mechanism& mechanism);

// The same from a text with separators (csv.h); `path` only names it.
Run ParseRun(const std::string& path, const std::string& text,
             const ColumnMap& columns, const Mechanism& mechanism,
             std::vector<std::string>* notices);

}  // namespace sysid
