#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace sysid {

// A recording as its format gives it: columns of numbers with names. Knows
// nothing of what they mean. One class a format; OpenTable chooses.
class TableFile {
 public:
  virtual ~TableFile() = default;

  const std::string& path() const { return path_; }
  // Names may be empty: such a column cannot be asked for by name. Of two
  // columns none have the same name.
  const std::vector<std::string>& header() const { return header_; }
  // What to say where the file has no names, and its columns are "#1", "#2",
  // ...; else "".
  const std::string& no_header() const { return no_header_; }
  // Of each column the unit that the file says, "" where it says none; empty
  // where it says no units.
  const std::vector<std::string>& units() const { return units_; }
  // How the file was understood where that is not plain: a line for users each.
  // Complete after ReadRows.
  const std::vector<std::string>& notices() const { return notices_; }

  // Where a column's name stands: "run.csv:1:3".
  virtual std::string HeaderPlace(int column) const = 0;
  // Where a cell of a row that was visited stands: "run.csv:12:3".
  virtual std::string Place(int row, int column) const = 0;
  // "line 12": a row as the file's readers count it.
  virtual std::string RowName(int row) const = 0;

  // Calls visit(cells) for each row in order: cells[i] is the number in column
  // wanted[i] (indices into the header), NaN where it is missing. Other columns
  // take no memory and may hold anything. Only once. Throws InputError for a
  // cell that is no finite number and for a file that is damaged.
  using Visit = std::function<void(std::span<const double> cells)>;
  virtual void ReadRows(const std::vector<int>& wanted, const Visit& visit) = 0;

 protected:
  explicit TableFile(const std::string& path) : path_(path) {}

  std::string path_;
  std::vector<std::string> header_;
  std::string no_header_;
  std::vector<std::string> units_;
  std::vector<std::string> notices_;
};

// Opens a recording by what its first bytes are, not by its name. A path may
// have a part behind it that only its format knows ("run.bag:/joint_states").
// Throws InputError for what the format's class refuses, and for a format that
// this build cannot read.
std::unique_ptr<TableFile> OpenTable(const std::string& path);

}  // namespace sysid
