#include "sysid/io/mat_arrays.h"

#include <matio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "models/error.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

using Variable = std::unique_ptr<matvar_t, decltype(&Mat_VarFree)>;

constexpr int kDeepest = 8;             // structures in structures
constexpr size_t kMostElements = 1000;  // of an array of structures
constexpr size_t kMostColumns = 10000;  // of the file

bool IsNumeric(const matvar_t& v) {
  return v.class_type >= MAT_C_DOUBLE && v.class_type <= MAT_C_UINT64 &&
         !v.isComplex;
}

// The two dimensions that count, one or both 1 where there are fewer; false for
// more, or an empty array, or a number of elements that has no room.
bool Dimensions(const matvar_t& v, size_t* rows, size_t* columns) {
  std::vector<size_t> dims;
  size_t elements = 1;
  for (int i = 0; i < v.rank; ++i) {
    if (v.dims[i] == 0 || v.dims[i] > SIZE_MAX / 16 / elements) return false;
    elements *= v.dims[i];
    if (v.dims[i] > 1) dims.push_back(v.dims[i]);
  }
  if (v.rank < 1 || dims.size() > 2) return false;
  *rows = dims.empty() ? 1 : dims[0];
  *columns = dims.size() < 2 ? 1 : dims[1];
  return true;
}

template <typename T>
void Copy(const matvar_t& v, const MatColumn& column,
          std::vector<double>* out) {
  const T* const data = static_cast<const T*>(v.data);
  for (size_t i = 0; i < column.rows; ++i) {
    out->push_back(static_cast<double>(data[column.begin + i * column.stride]));
  }
}

// Of a numeric class.
void CopyNumbers(const matvar_t& v, const MatColumn& column,
                 std::vector<double>* out) {
  using CopyClass =
      void (*)(const matvar_t&, const MatColumn&, std::vector<double>*);
  static constexpr std::pair<matio_classes, CopyClass> kClasses[] = {
      {MAT_C_DOUBLE, Copy<double>}, {MAT_C_SINGLE, Copy<float>},
      {MAT_C_INT8, Copy<int8_t>},   {MAT_C_UINT8, Copy<uint8_t>},
      {MAT_C_INT16, Copy<int16_t>}, {MAT_C_UINT16, Copy<uint16_t>},
      {MAT_C_INT32, Copy<int32_t>}, {MAT_C_UINT32, Copy<uint32_t>},
      {MAT_C_INT64, Copy<int64_t>}, {MAT_C_UINT64, Copy<uint64_t>},
  };
  for (const auto& [numeric, copy] : kClasses) {
    if (v.class_type == numeric) copy(v, column, out);
  }
}

// Calls visit(name, array) for what a variable holds: itself, or the fields of
// its structures, each by its MATLAB name.
using VisitArray = std::function<void(const std::string&, const matvar_t&)>;
void VisitArrays(const std::string& name, const matvar_t& v, int depth,
                 const VisitArray& visit) {
  if (v.class_type != MAT_C_STRUCT || depth == kDeepest) {
    visit(name, v);
    return;
  }
  size_t rows, columns;
  if (v.data == nullptr || !Dimensions(v, &rows, &columns)) return;
  const size_t elements = rows * columns;
  if (elements > kMostElements) return visit(name, v);
  const unsigned fields = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&v));
  char* const* const names = Mat_VarGetStructFieldnames(&v);
  const auto* const data = static_cast<matvar_t* const*>(v.data);
  for (size_t e = 0; e < elements; ++e) {
    const std::string element =
        elements == 1 ? name : name + "(" + std::to_string(e + 1) + ")";
    for (unsigned f = 0; f < fields; ++f) {
      const matvar_t* const field = data[e * fields + f];
      if (field == nullptr || names == nullptr || names[f] == nullptr) continue;
      VisitArrays(element + "." + names[f], *field, depth + 1, visit);
    }
  }
}

// A byte of the file is a number at most, and of deflated data 1032 (its best
// ratio).
void CheckSize(const std::string& path, uint64_t size, const std::string& name,
               const matvar_t& v) {
  constexpr uint64_t kBestRatio = 1032;
  size_t rows, columns;
  if (!Dimensions(v, &rows, &columns)) return;
  if (rows * columns / kBestRatio <= size) return;
  throw InputError(path + ":" + name,
                   "claims " + std::to_string(rows) + " x " +
                       std::to_string(columns) +
                       " numbers, more than a file of " + std::to_string(size) +
                       " bytes can hold",
                   kMatHint);
}

void AddArray(const std::string& variable, const std::string& name,
              const matvar_t& v, MatContents* contents) {
  size_t rows, columns;
  const bool fits = IsNumeric(v) && Dimensions(v, &rows, &columns);
  const size_t count = fits ? std::min(rows, columns) : 0;
  if (!fits || contents->columns.size() + count > kMostColumns) {
    contents->left_out.push_back(name);
    return;
  }
  const bool by_row = columns > rows;
  for (size_t i = 0; i < count; ++i) {
    MatColumn column;
    column.name = name;
    column.variable = variable;
    if (count > 1) {
      const std::string number = std::to_string(i + 1);
      column.name += by_row ? "(" + number + ",:)" : "(:," + number + ")";
    }
    column.begin = by_row ? i : i * rows;
    column.stride = by_row ? rows : 1;
    column.rows = std::max(rows, columns);
    contents->columns.push_back(column);
  }
}

using File = std::unique_ptr<mat_t, decltype(&Mat_Close)>;

File Open(const std::string& path) {
  File file(Mat_Open(path.c_str(), MAT_ACC_RDONLY), &Mat_Close);
  if (file == nullptr) {
    throw InputError(path, "is no MATLAB file that can be read", kMatHint);
  }
  return file;
}

// The numbers of the wanted columns that are in an array.
void CopyColumns(const std::string& variable, const std::string& name,
                 const matvar_t& a, const std::vector<MatColumn>& wanted,
                 std::vector<std::vector<double>>* numbers) {
  size_t rows, columns;
  if (!IsNumeric(a) || a.data == nullptr || !Dimensions(a, &rows, &columns) ||
      a.nbytes < rows * columns * Mat_SizeOfClass(a.class_type)) {
    return;
  }
  for (size_t i = 0; i < wanted.size(); ++i) {
    const MatColumn& column = wanted[i];
    const bool mine =
        column.variable == variable && (*numbers)[i].empty() &&
        (column.name == name || column.name.starts_with(name + "(")) &&
        column.begin + (column.rows - 1) * column.stride < rows * columns;
    if (!mine) continue;
    (*numbers)[i].reserve(column.rows);
    CopyNumbers(a, column, &(*numbers)[i]);
  }
}

}  // namespace

MatContents ListMatFile(const std::string& path, uint64_t size) {
  const File file = Open(path);
  MatContents contents;
  std::set<std::string> seen;
  size_t objects = 0;
  while (true) {
    const Variable v(Mat_VarReadNextInfo(file.get()), &Mat_VarFree);
    if (v == nullptr) break;
    const std::string name = v->name == nullptr ? "" : v->name;
    if (name.empty() && v->class_type == MAT_C_OPAQUE) {
      ++objects;
      continue;
    }
    // Bytes without a name, behind all variables: the data of the objects.
    if (name.empty() && v->class_type == MAT_C_UINT8 &&
        seen.insert("").second) {
      continue;
    }
    if (name.empty() || !seen.insert(name).second) {
      throw InputError(path, "a variable without a name of its own", kMatHint);
    }
    VisitArrays(name, *v, 0, [&](const std::string& array, const matvar_t& a) {
      CheckSize(path, size, array, a);
      AddArray(name, array, a, &contents);
    });
  }
  if (objects > 0) {
    contents.left_out.push_back(CountOf(objects, "object") +
                                " (timeseries, table, string, ...)");
  }
  return contents;
}

std::vector<std::vector<double>> ReadMatColumns(
    const std::string& path, const std::vector<MatColumn>& wanted) {
  const File file = Open(path);
  std::vector<std::vector<double>> numbers(wanted.size());
  std::set<std::string> variables;
  for (const MatColumn& column : wanted) variables.insert(column.variable);
  for (const std::string& variable : variables) {
    const Variable v(Mat_VarRead(file.get(), variable.c_str()), &Mat_VarFree);
    if (v == nullptr) continue;
    VisitArrays(variable, *v, 0,
                [&](const std::string& name, const matvar_t& a) {
                  CopyColumns(variable, name, a, wanted, &numbers);
                });
  }
  for (size_t i = 0; i < wanted.size(); ++i) {
    if (numbers[i].size() == wanted[i].rows) continue;
    throw InputError(path + ":" + wanted[i].name, "cannot be read", kMatHint);
  }
  return numbers;
}

}  // namespace sysid
