#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sysid/io/text_rows.h"

namespace sysid {

// What the lines before the numbers of a text say.
struct TextLayout {
  std::vector<std::string> header;  // a name for each cell of a row
  int header_line = 1;              // where the names stand
  std::string last_comment;         // before the header
  std::vector<std::string> notices;
  // What to say where there are no names: the columns are then "#1", "#2", ...
  std::string no_header;
  // Of each column as a row behind the names says, "" where it does not; empty
  // without such a row.
  std::vector<std::string> units;
  // Cells (by column) that must read the same in each row.
  std::vector<std::pair<size_t, std::string>> fixed_texts;

  // Where no column is time: a column "t" behind the others. It is the number
  // of the row (frame_column < 0: from 0) or the number in that column, over
  // the rate; without a rate the first column's seconds and the second's
  // nanoseconds.
  bool makes_time = false;
  double rate_hz = 0.0;
  int frame_column = -1;

  // Motion capture:
  //
  // First of three columns each, a marker's position: three zeros are a marker
  // that was not seen.
  std::vector<int> zero_is_missing;
  // The hint for a row that is none of it, "" for the usual ones.
  std::string width_hint;

  // Cells of a row.
  int width() const {
    return static_cast<int>(header.size()) - (makes_time ? 1 : 0);
  }
};

// Reads the lines before the numbers and sets the separator; false, and nothing
// read, where the text is not of this layout. Throws InputError where it is but
// cannot be read. One file a layout; a new one is a line in ReadTextLayout.
bool ReadMotiveLayout(const std::string& path, TextRows* rows,
                      TextLayout* layout);
bool ReadViconLayout(const std::string& path, TextRows* rows,
                     TextLayout* layout);
bool ReadQualisysLayout(const std::string& path, TextRows* rows,
                        TextLayout* layout);
bool ReadEchoLayout(const std::string& path, TextRows* rows,
                    TextLayout* layout);
// One row of names, perhaps one of units, or numbers from the first row on; the
// separator is found from the first two rows.
bool ReadPlainLayout(const std::string& path, TextRows* rows,
                     TextLayout* layout);

// The layouts in the order in which they are tried.
TextLayout ReadTextLayout(const std::string& path, TextRows* rows);

}  // namespace sysid
