#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"

namespace sysid {

// One entry of --columns, or of `columns:` in a fit specification.
struct ColumnMapping {
  std::string name;        // ours: "joint1.q"
  std::string expression;  // as written: "pos1 * 0.0174532925"
  std::string place;       // for errors: "--columns", "fit.yaml:12:3"
};
using ColumnMap = std::vector<ColumnMapping>;

// "joint1.q=pos_meas1,t=time_ms*0.001". Spaces around names are dropped. The
// expressions are taken as they are: what they mean depends on the file's
// header (ResolveColumns). Throws InputError for an entry without '=', an empty
// side, or a name that is given twice.
ColumnMap ParseColumnMap(const std::string& text,
                         const std::string& place = "--columns");

// Flags win over the file: the entries of `winner`, then those of `base` whose
// names it does not have.
ColumnMap MergeColumnMaps(const ColumnMap& base, const ColumnMap& winner);

// Where one of our columns comes from: value = factor * cell + offset.
struct ColumnSource {
  std::string name;  // ours
  int column = -1;   // index into the header
  double factor = 1.0;
  double offset = 0.0;
  bool has_factor = false;  // one was written, be it 1
};

// Reads the map's expressions against a header:
//   [-] column { (*|/) number } [ (+|-) number ]
// A column that has exactly the name of the whole expression wins, then the
// longest column that begins it: so "/joint_states/pos[0]" needs no quoting.
// `path` names the file in errors.
//
// Throws InputError at the entry's place for a name that is not one of the
// mechanism's columns, a column that the header does not have (each with the
// nearest) and a factor or offset that is not a finite number or a zero factor.
std::vector<ColumnSource> ResolveColumns(const ColumnMap& map,
                                         const std::vector<std::string>& header,
                                         const std::string& path,
                                         const Mechanism& mechanism);

}  // namespace sysid
