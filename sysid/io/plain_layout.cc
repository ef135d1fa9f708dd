#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/text_layout.h"
#include "sysid/io/timestamp.h"
#include "sysid/io/units.h"

namespace sysid {
namespace {

// The header and the first row of numbers, as they would be read with one
// separator.
struct Trial {
  char separator = ',';
  int names = 0;
  int cells = 0;    // of the first row; 0 where there is none
  int numbers = 0;  // of its cells, empty ones too
  // Whether this separator can be meant: it makes columns, and as many cells.
  bool fits() const { return names > 1 && (cells == names || cells == 0); }
};

void ReadTrial(char separator, std::string_view text, Trial* trial_out) {
  Trial& trial = *trial_out;
  TextRows rows(ByteSource("", std::string(text)));
  rows.set_separator(separator);
  rows.SkipEmptyLines(nullptr);
  std::vector<std::string> names = rows.ReadCells();
  // Tabs at a line's end are not seen in an editor.
  const auto drop_end = [&](std::vector<std::string>* cells, size_t least) {
    while (separator == '\t' && cells->size() > least &&
           cells->back().empty()) {
      cells->pop_back();
    }
  };
  drop_end(&names, 1);
  trial.names = static_cast<int>(names.size());
  rows.SkipEmptyLines(nullptr);
  if (rows.AtEnd()) return;
  std::vector<std::string> cells = rows.ReadCells();
  drop_end(&cells, names.size());
  trial.cells = static_cast<int>(cells.size());
  for (const std::string& cell : cells) {
    double value;
    if (cell.empty() || ParseNumber(cell, &value) ||
        (separator != ',' && ParseDecimalComma(cell, &value))) {
      ++trial.numbers;
    }
  }
}

Trial Try(char separator, std::string_view text) {
  Trial trial;
  trial.separator = separator;
  try {
    ReadTrial(separator, text, &trial);
  } catch (const InputError&) {
    // A fault of the text is said where it is read with the separator that was
    // found.
  }
  return trial;
}

// Of the separators that fit, the one that gives more numbers in the first row;
// spaces only where no other one does. A comma where none fits: its errors are
// known.
char FindSeparator(const std::string& path, std::string_view text,
                   int header_line) {
  constexpr size_t kEnough = size_t{1} << 17;
  std::string_view head = text.substr(0, kEnough);
  // A cut row is none; but the header of a very wide file is kept.
  if (head.size() < text.size() &&
      std::count(head.begin(), head.end(), '\n') < 2) {
    head = text;
  }
  std::vector<Trial> best;
  for (const char separator : {',', ';', '\t'}) {
    const Trial trial = Try(separator, head);
    if (!trial.fits()) continue;
    if (!best.empty() && trial.numbers < best[0].numbers) continue;
    if (!best.empty() && trial.numbers > best[0].numbers) best.clear();
    best.push_back(trial);
  }
  if (best.size() > 1) {
    const std::string one = SeparatorName(best[0].separator) + "s";
    const std::string other = SeparatorName(best[1].separator) + "s";
    throw InputError(
        path + ":" + std::to_string(header_line) + ":1",
        "the columns could be separated by " + one + " or by " + other,
        "put names and texts that hold " + one + " or " + other +
            " in quotation marks");
  }
  if (best.size() == 1) return best[0].separator;
  const Trial commas = Try(',', head);
  const Trial spaces = Try(' ', head);
  if (commas.names == 1 && spaces.fits() && spaces.cells > 0) return ' ';
  // One separator in the header, but other cells in the first row: it is said
  // there, with the right name.
  for (const char separator : {';', '\t'}) {
    if (commas.names == 1 && Try(separator, head).names > 1) return separator;
  }
  if (commas.names == 1 && spaces.names > 1 && spaces.cells > 1 &&
      commas.cells == 1 && spaces.numbers == spaces.cells) {
    throw InputError(path + ":" + std::to_string(header_line) + ":1",
                     "the rows are separated by spaces, but the header has " +
                         std::to_string(spaces.names) +
                         " words and the first row " +
                         CountOf(spaces.cells, "number"),
                     "put names that hold spaces in quotation marks");
  }
  return ',';
}

// Whether each cell is a number or a time: no row of names.
bool IsNumbers(const std::vector<std::string>& cells, char separator) {
  const auto is_number = [&](const std::string& cell) {
    double number;
    return ParseNumber(cell, &number) || ParseTimestamp(cell, &number) ||
           (separator != ',' && ParseDecimalComma(cell, &number));
  };
  return !cells.empty() && std::all_of(cells.begin(), cells.end(), is_number);
}

// What to say of a table without names.
std::string NoHeader(const std::vector<std::string>& cells) {
  return "there is no header: the first row is numbers (" + Shown(cells[0]) +
         (cells.size() > 1 ? ", ...)" : ")");
}

// Whether a row stands where numbers should that is all units.
bool IsUnits(const std::vector<std::string>& cells, size_t columns) {
  if (cells.size() != columns) return false;
  return std::all_of(cells.begin(), cells.end(),
                     [](const std::string& cell) {
                       double number;
                       return !ParseNumber(cell, &number) &&
                              ParseUnit(cell).has_value();
                     }) &&
         std::any_of(cells.begin(), cells.end(), [](const std::string& cell) {
           return ParseUnit(cell)->of != Unit::Of::kNone;
         });
}

}  // namespace

bool ReadPlainLayout(const std::string& path, TextRows* rows,
                     TextLayout* layout) {
  const bool is_empty = rows->AtEnd();
  rows->SkipEmptyLines(&layout->last_comment);
  if (rows->AtEnd()) {
    throw InputError(path + ":1:1",
                     is_empty ? "the file is empty"
                              : "the file has no header and no rows, only "
                                "comments or blanks",
                     "a run is a header such as t,joint1.q and a row a sample");
  }
  const char separator = FindSeparator(path, rows->Ahead(), rows->line());
  rows->set_separator(separator);
  layout->header_line = rows->line();
  if (const auto first = rows->NextCells(); IsNumbers(first, separator)) {
    layout->no_header = NoHeader(first);
    for (size_t i = 1; i <= first.size(); ++i) {
      layout->header.push_back("#" + std::to_string(i));
    }
  } else {
    layout->header = rows->ReadCells();
  }
  while (separator == '\t' && layout->header.size() > 1 &&
         layout->header.back().empty()) {
    layout->header.pop_back();
  }
  rows->SkipEmptyLines(nullptr);
  if (const auto next = rows->NextCells();
      layout->no_header.empty() && IsUnits(next, layout->header.size())) {
    layout->units = rows->ReadCells();
  }
  if (separator != ',') {
    layout->notices.push_back("the columns are separated by " +
                              SeparatorName(separator) + "s");
  }
  return true;
}

TextLayout ReadTextLayout(const std::string& path, TextRows* rows) {
  constexpr bool (*kLayouts[])(const std::string&, TextRows*, TextLayout*) = {
      ReadMotiveLayout, ReadViconLayout, ReadQualisysLayout,
      ReadEchoLayout,   ReadPlainLayout,
  };
  TextLayout layout;
  for (const auto read : kLayouts) {
    if (read(path, rows, &layout)) break;
  }
  return layout;
}

}  // namespace sysid
