#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"
#include "sysid/io/expression.h"
#include "sysid/io/scoped_name.h"

namespace sysid {

// One entry of --columns, or of `columns:` in a fit specification.
struct ColumnMapping {
  std::string name;        // ours: "joint1.q", of one run: "b.csv/joint1.q"
  std::string expression;  // as written: "pos1 * 0.0174532925"
  std::string place;       // for errors: "--columns", "fit.yaml:12:3"
};
using ColumnMap = std::vector<ColumnMapping>;

// "joint1.q=pos_meas1,t=time_ms*0.001". Spaces around names are dropped. The
// expressions are taken as they are: what they mean depends on the file's
// header (ResolveColumns). A comma in a column's name needs quotes around the
// name: joint1.q='pos, deg'*2. Throws InputError for an entry without '=', an
// empty side, or a name that is given twice.
ColumnMap ParseColumnMap(const std::string& text,
                         const std::string& place = "--columns");

// A name of the map, split from the run that it is meant for.
ScopedName RunColumn(const std::string& text, const Mechanism& mechanism);

// The entries that hold for the run at `path`, their names without it: of two
// for the same name that for this run alone.
ColumnMap ColumnsOf(const ColumnMap& map, const std::string& path,
                    const Mechanism& mechanism);

// Whether a name that is none of our columns may be an input's of its own: a
// plain word that is no slip of one of them.
bool IsOwnInput(const std::string& name, const Mechanism& mechanism);
// Those of a map, each once.
std::vector<std::string> OwnInputs(const ColumnMap& map,
                                   const Mechanism& mechanism);

// Where one of our columns comes from.
struct ColumnSource {
  std::string name;  // ours
  Expression expression;
  std::string text;     // of the expression: the column's name where it is one
  double factor = 1.0;  // on its value: of a unit that the file says
  // The first column that the expression uses: where errors point.
  int column() const { return expression.columns()[0]; }
  // "column 'pos1' (joint1.q)".
  std::string Describe() const;
};

// Reads the expressions (expression.h) that hold for the run at `path` against
// its header. Those of joints that are held still are in the result where the
// header has what they need.
//
// Throws InputError at the entry's place for a name that is not one of the
// mechanism's columns, a column that the header does not have (each with the
// nearest) and an expression that cannot be read, with the character.
std::vector<ColumnSource> ResolveColumns(const ColumnMap& map,
                                         const std::vector<std::string>& header,
                                         const std::string& path,
                                         const Mechanism& mechanism);

}  // namespace sysid
