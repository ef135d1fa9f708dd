#pragma once

#include <string>
#include <utility>
#include <vector>

#include "models/mechanism.h"
#include "sysid/io/column_map.h"
#include "sysid/io/run_columns.h"
#include "sysid/io/table_file.h"

namespace sysid {

// What a file has of a run of a mechanism, and from where.
struct RunSources {
  // A group of the mechanism's columns that the file has: all of it, or of a
  // frame position those along some axes.
  struct Group {
    ColumnGroup group;
    std::vector<int> axes;     // as of the channel
    std::vector<int> sources;  // of group.columns: indices into `sources`
    // Of an effort: what is added, of joints that follow; where the joint has
    // no column of its own, all there is.
    std::vector<std::pair<int, double>> added = {};  // source, multiplier
  };

  std::vector<ColumnSource> sources;  // of t and of the groups' columns
  std::vector<Group> channels;
  std::vector<Group> efforts;
  struct InputSource {
    InputColumn column;
    int source;
  };
  std::vector<InputSource> inputs;
  std::vector<Group> held;          // of joints that are held still: not used
  std::vector<std::string> unread;  // the file's other columns

  // The index of the source of our column `name`, or -1.
  int Find(const std::string& name) const;
};

// What a file must have, one of it at least.
// kPositions: measurements of which no other is missed.
// kInputs: what effects read.
enum class RunContent { kMeasurements, kPositions, kEfforts, kInputs };

// The map first, then the columns that have our names. `ignored` is a notice of
// the file's other columns, "" where there are none; it begins with the joints
// whose position or effort no column gives, since one of those may be it.
//
// Throws InputError for what ResolveColumns refuses, and where there is only a
// part of a quaternion or vector; UnnamedColumns where there is no time or
// nothing of the content, and the names of the file's columns say what it is.
RunSources FindRunSources(const TableFile& file, const ColumnMap& map,
                          const Mechanism& mechanism, RunContent content,
                          std::string* ignored);

}  // namespace sysid
