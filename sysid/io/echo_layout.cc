#include <algorithm>
#include <string>
#include <vector>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/text_layout.h"

// What `ros2 topic echo --csv /joint_states` prints: no header, and in each row
//
//   seconds, nanoseconds, frame, names of the joints..., their positions...,
//   velocities..., efforts...
//
// in the driver's order; velocities or efforts may be missing.
namespace sysid {
namespace {

constexpr size_t kFirstName = 3;
constexpr const char* kSuffixes[] = {".q", ".qd", ".tau"};

bool IsNumberCell(const std::string& cell) {
  double number;
  return ParseNumber(cell, &number);
}

bool IsWhole(const std::string& cell) {
  return !cell.empty() &&
         cell.find_first_not_of("0123456789") == std::string::npos;
}

}  // namespace

bool ReadEchoLayout(const std::string&, TextRows* rows, TextLayout* layout) {
  rows->set_separator(',');
  const std::vector<std::string> row = rows->NextCells();
  constexpr size_t kMostNanoseconds = 9;  // digits
  if (row.size() < kFirstName + 2 || !IsWhole(row[0]) || !IsWhole(row[1]) ||
      row[1].size() > kMostNanoseconds || IsNumberCell(row[2])) {
    return false;
  }
  const auto names = row.begin() + kFirstName;
  const auto numbers = std::find_if(names, row.end(), IsNumberCell);
  const auto joints = static_cast<size_t>(numbers - names);
  const auto values = static_cast<size_t>(row.end() - numbers);
  if (joints == 0 || values == 0 || values % joints != 0 ||
      values / joints > std::size(kSuffixes) ||
      !std::all_of(numbers, row.end(), IsNumberCell)) {
    return false;
  }
  layout->header.assign(kFirstName + joints, "");
  for (size_t i = 0; i < joints; ++i) {
    layout->fixed_texts.emplace_back(kFirstName + i, names[i]);
  }
  for (size_t k = 0; k < values / joints; ++k) {
    for (size_t i = 0; i < joints; ++i) {
      layout->header.push_back(names[i] + kSuffixes[k]);
    }
  }
  layout->header.push_back("t");
  layout->makes_time = true;
  layout->header_line = rows->line();
  layout->width_hint =
      "each row has its time, the frame, and of the same "
      "joints names and numbers: are there two publishers?";
  layout->notices.push_back(
      "joint states as `ros2 topic echo --csv` prints them: t of seconds and "
      "nanoseconds, joints " +
      JoinSome({names, numbers}) +
      (values / joints == 2 ? "; their second numbers are taken as velocities"
                            : ""));
  return true;
}

}  // namespace sysid
