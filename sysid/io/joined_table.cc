#include "sysid/io/joined_table.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <utility>

#include "models/error.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// One of the files, read to its end.
struct Part {
  std::string prefix;  // "velocity.csv/"; "" of the run's own file
  std::unique_ptr<TableFile> file;
  Expression time;
  int first = 0;            // of its columns in the joined header
  std::vector<int> wanted;  // of its columns
  std::vector<double> t;
  std::vector<double> cells;  // by row

  double At(size_t row, size_t i) const {
    return cells[row * wanted.size() + i];
  }
};

// The expression for "t".
std::string TimeText(const ColumnMap& map) {
  for (const ColumnMapping& entry : map) {
    if (entry.name == "t") return std::string(Trim(entry.expression));
  }
  return "t";
}

Expression TimeOf(const TableFile& file, const ColumnMap& map) {
  Expression time;
  ExpressionFault fault;
  const std::string text = TimeText(map);
  if (ParseExpression(text, file.header(), &time, &fault)) return time;
  throw InputError(file.HeaderPlace(0), "there is no time " + Shown(text),
                   "the files of one run are joined by time, which each has "
                   "under the same name: --columns t=NAME");
}

// The prefixes "velocity.csv/" of an expression that are files beside `run`.
std::set<std::string> FilesIn(const std::string& expression,
                              const fs::path& run) {
  constexpr std::string_view kBefore = "'\"(+-*/ \t,";
  std::set<std::string> prefixes;
  for (size_t slash = expression.find('/'); slash != std::string::npos;
       slash = expression.find('/', slash + 1)) {
    for (size_t begin = 0; begin < slash; ++begin) {
      if (begin > 0 && kBefore.find(expression[begin - 1]) == kBefore.npos) {
        continue;
      }
      const std::string name = expression.substr(begin, slash - begin);
      std::error_code error;
      if (name.empty() ||
          !fs::is_regular_file(run.parent_path() / name, error)) {
        continue;
      }
      prefixes.insert(name + "/");
      break;
    }
  }
  return prefixes;
}

class JoinedTable : public TableFile {
 public:
  JoinedTable(std::vector<Part> parts, const std::string& path)
      : TableFile(path), parts_(std::move(parts)) {
    for (Part& part : parts_) {
      part.first = static_cast<int>(header_.size());
      for (const std::string& name : part.file->header()) {
        header_.push_back(name.empty() ? "" : part.prefix + name);
      }
      for (const int column : part.time.columns()) {
        if (!part.prefix.empty()) header_[part.first + column].clear();
      }
      const std::vector<std::string>& units = part.file->units();
      for (size_t i = 0; i < part.file->header().size(); ++i) {
        units_.push_back(i < units.size() ? units[i] : "");
      }
    }
    if (std::all_of(units_.begin(), units_.end(),
                    [](const std::string& unit) { return unit.empty(); })) {
      units_.clear();
    }
    no_header_ = parts_[0].file->no_header();
  }

  std::string HeaderPlace(int column) const override {
    const Part& part = PartOf(column);
    return part.file->HeaderPlace(column - part.first);
  }
  std::string Place(int row, int column) const override {
    const Part& part = PartOf(column);
    const int own = rows_[row][&part - parts_.data()];
    return own >= 0 ? part.file->Place(own, column - part.first)
                    : part.file->HeaderPlace(column - part.first);
  }
  std::string RowName(int row) const override {
    for (size_t p = 0; p < parts_.size(); ++p) {
      const int own = rows_[row][p];
      if (own >= 0) {
        return parts_[p].prefix + (p == 0 ? "" : " ") +
               parts_[p].file->RowName(own);
      }
    }
    return "";
  }

  void ReadRows(const std::vector<int>& wanted, const Visit& visit) override {
    for (Part& part : parts_) ReadPart(wanted, &part);
    Merge();
    // The time is that of the row, whichever file it is from.
    const std::vector<int>& of_time = parts_[0].time.columns();
    std::vector<double> cells(wanted.size());
    for (const std::vector<int>& row : rows_) {
      const Part* timed = nullptr;
      for (size_t p = 0; p < parts_.size() && timed == nullptr; ++p) {
        if (row[p] >= 0) timed = &parts_[p];
      }
      for (size_t i = 0; i < wanted.size(); ++i) {
        const Part* part = &PartOf(wanted[i]);
        int column = wanted[i] - part->first;
        const auto at = std::find(of_time.begin(), of_time.end(), wanted[i]);
        if (at != of_time.end() && timed != &parts_[0]) {
          part = timed;
          column = timed->time.columns()[at - of_time.begin()];
        }
        const int own = row[part - parts_.data()];
        const auto found =
            std::find(part->wanted.begin(), part->wanted.end(), column);
        cells[i] = own < 0 ? kNaN : part->At(own, found - part->wanted.begin());
      }
      visit(cells);
    }
    for (const Part& part : parts_) {
      for (const std::string& notice : part.file->notices()) {
        notices_.push_back(part.prefix.empty() ? notice
                                               : part.prefix + ": " + notice);
      }
    }
  }

 private:
  const Part& PartOf(int column) const {
    size_t p = parts_.size() - 1;
    while (p > 0 && parts_[p].first > column) --p;
    return parts_[p];
  }

  void ReadPart(const std::vector<int>& wanted, Part* part) {
    part->wanted = part->time.columns();
    for (const int column : wanted) {
      if (&PartOf(column) != part) continue;
      if (!Contains(part->wanted, column - part->first)) {
        part->wanted.push_back(column - part->first);
      }
    }
    const size_t of_time = part->time.columns().size();
    part->file->ReadRows(part->wanted, [&](std::span<const double> cells) {
      const double t = part->time.Evaluate(cells.first(of_time));
      const auto row = static_cast<int>(part->t.size());
      if (!std::isfinite(t) || (row > 0 && t < part->t.back())) {
        throw InputError(part->file->Place(row, part->time.columns()[0]),
                         std::isfinite(t) ? "time goes back" : "no time",
                         "the files of one run are joined by time: each must "
                         "be in its order");
      }
      part->t.push_back(t);
      part->cells.insert(part->cells.end(), cells.begin(), cells.end());
    });
  }

  // The rows of all by time: of each part the row that stands there, or -1.
  void Merge() {
    constexpr double kAlike = 1e-6;  // s
    std::vector<size_t> next(parts_.size(), 0);
    while (true) {
      double t = std::numeric_limits<double>::infinity();
      for (size_t p = 0; p < parts_.size(); ++p) {
        if (next[p] < parts_[p].t.size()) {
          t = std::min(t, parts_[p].t[next[p]]);
        }
      }
      if (std::isinf(t)) return;
      std::vector<int> row(parts_.size(), -1);
      for (size_t p = 0; p < parts_.size(); ++p) {
        if (next[p] < parts_[p].t.size() && parts_[p].t[next[p]] < t + kAlike) {
          row[p] = static_cast<int>(next[p]++);
        }
      }
      rows_.push_back(std::move(row));
    }
  }

  std::vector<Part> parts_;
  std::vector<std::vector<int>> rows_;
};

}  // namespace

std::unique_ptr<TableFile> JoinOtherFiles(std::unique_ptr<TableFile> file,
                                          const ColumnMap& map) {
  std::set<std::string> prefixes;
  for (const ColumnMapping& entry : map) {
    if (Contains(file->header(), std::string(Trim(entry.expression)))) continue;
    prefixes.merge(FilesIn(entry.expression, file->path()));
  }
  if (prefixes.empty()) return file;
  const std::string path = file->path();
  std::vector<Part> parts;
  parts.emplace_back().file = std::move(file);
  for (const std::string& prefix : prefixes) {
    const fs::path other =
        fs::path(path).parent_path() / prefix.substr(0, prefix.size() - 1);
    Part& part = parts.emplace_back();
    part.prefix = prefix;
    part.file = OpenTable(other.string());
  }
  for (Part& part : parts) part.time = TimeOf(*part.file, map);
  return std::make_unique<JoinedTable>(std::move(parts), path);
}

}  // namespace sysid
