#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace sysid {

// What matio gives of a MATLAB file. It may crash or hang on damaged files: to
// be called in a ChildProcess.

// A column: every stride-th number of an array from `begin` on.
struct MatColumn {
  std::string name;      // "log.q(:,2)"
  std::string variable;  // that it is in: "log"
  size_t begin = 0;
  size_t stride = 1;
  size_t rows = 0;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(MatColumn, name, variable, begin, stride,
                                   rows)

struct MatContents {
  std::vector<MatColumn> columns;
  std::vector<std::string> left_out;  // what is no array of real numbers
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(MatContents, columns, left_out)

inline constexpr char kMatHint[] =
    "is it damaged? Save it again, by save('run.mat')";

// The columns of a file of `size` bytes. Throws InputError for a file that
// cannot be read and for an array that claims more than it can hold.
MatContents ListMatFile(const std::string& path, uint64_t size);

// The numbers of some of them, all of one length. Throws InputError where they
// cannot be read.
std::vector<std::vector<double>> ReadMatColumns(
    const std::string& path, const std::vector<MatColumn>& wanted);

}  // namespace sysid
