#pragma once

#include <string>
#include <vector>

#include "models/error.h"
#include "models/mechanism.h"
#include "sysid/io/column_map.h"

namespace sysid {

// Hints for a file whose columns have other names or units than ours: the
// --columns flag that would most likely read it, judged by the words in the
// names (match_columns.h). `given` is the map so far; what it has from the flag
// is repeated, so that the hint can be typed as it is.

struct Suggestion {
  std::string before, after;  // the flag
  ColumnMap map;              // what it adds to what is given
  // Whether it can be tried: else COLUMN stands where nothing is known, or no
  // flag at all.
  bool complete = false;
  std::string Text(const ColumnMap& given) const;
};

// "--columns t=time_ms*0.001", with all else that the names say. Where they
// say no time or nothing that is measured, the flag with COLUMN in its place,
// and the file's columns. Of a table without names by the number of columns.
Suggestion SuggestWithTime(const Mechanism& mechanism,
                           const std::vector<std::string>& header,
                           const ColumnMap& given);

// The names that would be read, and "--columns joint1.q=pos1,joint2.q=pos2"
// where columns look like positions; the file's columns where none does.
// `time_column` is taken.
Suggestion SuggestMeasured(const Mechanism& mechanism,
                           const std::vector<std::string>& header,
                           int time_column, const ColumnMap& given);

// A file whose columns have none of our names, with what it may be.
class UnnamedColumns : public InputError {
 public:
  UnnamedColumns(const std::string& place, const std::string& what,
                 const Suggestion& suggestion, const ColumnMap& given)
      : InputError(place, what, suggestion.Text(given)),
        suggestion_(suggestion) {}

  const Suggestion& suggestion() const { return suggestion_; }

 private:
  Suggestion suggestion_;
};

// "pos*0.0174532925".
std::string InRadians(const std::string& column);
// "--columns joint1.q=pos*0.0174532925", and how to say that it is radians.
std::string DegreesHint(const std::string& name, const std::string& column,
                        const ColumnMap& given);
// The first half of it.
std::string DegreesFlag(const std::string& name, const std::string& column,
                        const ColumnMap& given);

}  // namespace sysid
