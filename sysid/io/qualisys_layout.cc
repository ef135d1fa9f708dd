#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/text_layout.h"

// What Qualisys' QTM exports as TSV (docs.qualisys.com, "Motion data (.tsv)"):
// a line a fact, the word and its values separated by tabs, in any order,
//
//   NO_OF_FRAMES  300
//   NO_OF_MARKERS 2
//   FREQUENCY     100
//   DATA_INCLUDED 3D
//   EVENT         ...                 any number of them
//   MARKER_NAMES  tip  elbow
//   TRAJECTORY_TYPES  Measured  Mixed
//   Frame  Time  tip X  tip Y ...     if the column header was chosen
//
// and rows of x, y, z of each marker in mm, behind the frame's number and the
// time if they were chosen. A marker that was not seen is 0, 0, 0, or empty.
namespace sysid {
namespace {

bool IsFact(const std::string& word) {
  return !word.empty() && word != "Frame" && word != "Time" &&
         std::all_of(word.begin(), word.end(),
                     [](char c) { return (c >= 'A' && c <= 'Z') || c == '_'; });
}

double Number(const std::string& text) {
  double value;
  return ParseNumber(text, &value) && std::isfinite(value) ? value : 0.0;
}

}  // namespace

bool ReadQualisysLayout(const std::string& path, TextRows* rows,
                        TextLayout* layout) {
  const std::string_view ahead = rows->Ahead();
  if (!ahead.starts_with("NO_OF_FRAMES\t") &&
      !ahead.starts_with("FILE_VERSION\t")) {
    return false;
  }
  rows->set_separator('\t');
  const auto fail = [&](const std::string& what) {
    throw InputError(path + ":" + std::to_string(rows->row_line()) + ":1", what,
                     "export 3D data as TSV again, with its header");
  };
  std::vector<std::string> markers;
  std::string included = "3D";
  double frequency = 0.0;
  // The rows of words end where a number stands first, which must not be taken
  // yet, or behind the names of the columns.
  std::vector<std::string> columns;
  while (true) {
    rows->SkipEmptyLines(nullptr);
    const std::string_view next = rows->Ahead();
    const bool is_word = !next.empty() && ((next[0] >= 'A' && next[0] <= 'Z') ||
                                           (next[0] >= 'a' && next[0] <= 'z'));
    if (!is_word) break;
    std::vector<std::string> cells = rows->ReadCells();
    while (cells.size() > 1 && cells.back().empty()) cells.pop_back();
    if (!IsFact(cells[0])) {
      columns = cells;
      layout->header_line = rows->row_line();
      break;
    }
    const std::string value = cells.size() > 1 ? cells[1] : "";
    if (cells[0] == "FREQUENCY") frequency = Number(value);
    if (cells[0] == "DATA_INCLUDED") included = value;
    if (cells[0] == "MARKER_NAMES") {
      markers.assign(cells.begin() + 1, cells.end());
      layout->header_line = rows->row_line();
    }
  }
  if (included != "3D") {
    fail("an export of QTM with " + Shown(included) + " data, not 3D");
  }
  if (markers.empty()) fail("an export of QTM without MARKER_NAMES");

  // What stands before the markers: by the columns' names or by their number.
  const size_t numbers = 3 * markers.size();
  size_t before = 0;
  if (!columns.empty()) {
    before = columns.size() - std::min(columns.size(), numbers);
  } else if (!rows->AtEnd()) {
    TextRows first(
        ByteSource(path, std::string(rows->Ahead().substr(
                             0, rows->Ahead().find_first_of("\r\n")))));
    first.set_separator('\t');
    std::vector<std::string> cells = first.ReadCells();
    if (cells.size() > numbers && cells.back().empty()) cells.pop_back();
    before = cells.size() - std::min(cells.size(), numbers);
  }
  if (before > 2) {
    fail(CountOf(numbers + before, "column") + " for " +
         CountOf(markers.size(), "marker"));
  }
  const bool has_frame =
      before == 2 || (before == 1 && !columns.empty() && columns[0] == "Frame");
  const bool has_time = before == 2 || (before == 1 && !has_frame);
  if (has_frame) layout->header.push_back("Frame");
  if (has_time) layout->header.push_back("t");
  for (const std::string& marker : markers) {
    layout->zero_is_missing.push_back(static_cast<int>(layout->header.size()));
    for (const char* axis : {".X", ".Y", ".Z"}) {
      layout->header.push_back(marker + axis);
    }
  }
  if (!has_time) {
    if (frequency <= 0.0) {
      fail("an export of QTM with neither a column Time nor a FREQUENCY");
    }
    layout->rate_hz = frequency;
    layout->makes_time = true;
    layout->header.push_back("t");
  }
  layout->notices.push_back("an export of QTM: t is " +
                            (has_time ? "its time"
                                      : "the number of the row / " +
                                            ShortestText(frequency) + " Hz") +
                            ", lengths are in mm (map them by *0.001)");
  return true;
}

}  // namespace sysid
