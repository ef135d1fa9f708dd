#pragma once

#include <algorithm>
#include <utility>
#include <vector>

namespace sysid {

// The line of each row, in the room that the lines without a row take.
class LineNumbers {
 public:
  // The next row stands in this line.
  void Add(int line) {
    const int shift = line - rows_;
    if (shifts_.empty() || shifts_.back().second != shift) {
      shifts_.emplace_back(rows_, shift);
    }
    ++rows_;
  }
  int rows() const { return rows_; }
  int Line(int row) const {
    const auto after = std::upper_bound(
        shifts_.begin(), shifts_.end(), row,
        [](int r, const auto& shift) { return r < shift.first; });
    return row + std::prev(after)->second;
  }

 private:
  int rows_ = 0;
  std::vector<std::pair<int, int>> shifts_;  // from this row on: line - row
};

}  // namespace sysid
