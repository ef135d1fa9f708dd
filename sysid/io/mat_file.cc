#include "sysid/io/mat_file.h"

#include <matio.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
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
constexpr char kHint[] = "is it damaged? Save it again, by save('run.mat')";

// A column: every stride-th number of an array from `begin` on.
struct Column {
  std::string name;
  std::string variable;  // that it is in
  size_t begin = 0;
  size_t stride = 1;
  size_t rows = 0;
};

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
void Copy(const matvar_t& v, const Column& column, std::vector<double>* out) {
  const T* const data = static_cast<const T*>(v.data);
  for (size_t i = 0; i < column.rows; ++i) {
    out->push_back(static_cast<double>(data[column.begin + i * column.stride]));
  }
}

// False where the class is none of the numeric ones.
bool CopyNumbers(const matvar_t& v, const Column& column,
                 std::vector<double>* out) {
  switch (v.class_type) {
    case MAT_C_DOUBLE:
      return Copy<double>(v, column, out), true;
    case MAT_C_SINGLE:
      return Copy<float>(v, column, out), true;
    case MAT_C_INT8:
      return Copy<int8_t>(v, column, out), true;
    case MAT_C_UINT8:
      return Copy<uint8_t>(v, column, out), true;
    case MAT_C_INT16:
      return Copy<int16_t>(v, column, out), true;
    case MAT_C_UINT16:
      return Copy<uint16_t>(v, column, out), true;
    case MAT_C_INT32:
      return Copy<int32_t>(v, column, out), true;
    case MAT_C_UINT32:
      return Copy<uint32_t>(v, column, out), true;
    case MAT_C_INT64:
      return Copy<int64_t>(v, column, out), true;
    case MAT_C_UINT64:
      return Copy<uint64_t>(v, column, out), true;
    default:
      return false;
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

class MatFile : public TableFile {
 public:
  explicit MatFile(const ByteSource& source)
      : TableFile(source.path()),
        size_(source.size()),
        file_(Mat_Open(path_.c_str(), MAT_ACC_RDONLY), &Mat_Close) {
    if (file_ == nullptr) {
      throw InputError(path_, "is no MATLAB file that can be read", kHint);
    }
    FindColumns();
  }

  std::string HeaderPlace(int column) const override {
    return path_ + ":" + header_[column];
  }
  std::string Place(int row, int column) const override {
    return HeaderPlace(column) + ": " + RowName(row);
  }
  std::string RowName(int row) const override {
    return "sample " + std::to_string(row + 1);
  }
  void ReadRows(const std::vector<int>& wanted, const Visit& visit) override;

 private:
  void FindColumns();
  void AddArray(const std::string& variable, const std::string& name,
                const matvar_t& v);
  void CheckSize(const std::string& name, const matvar_t& v) const;
  void ReadVariable(const std::string& variable, const std::vector<int>& wanted,
                    std::vector<std::vector<double>>* numbers) const;

  uint64_t size_;
  std::unique_ptr<mat_t, decltype(&Mat_Close)> file_;
  std::vector<Column> columns_;
  std::vector<std::string> left_out_;
};

// A byte of the file is a number at most, and of deflated data 1032 (its best
// ratio).
void MatFile::CheckSize(const std::string& name, const matvar_t& v) const {
  constexpr uint64_t kBestRatio = 1032;
  size_t rows, columns;
  if (!Dimensions(v, &rows, &columns)) return;
  if (rows * columns / kBestRatio <= size_) return;
  throw InputError(path_ + ":" + name,
                   "claims " + std::to_string(rows) + " x " +
                       std::to_string(columns) +
                       " numbers, more than a file "
                       "of " +
                       std::to_string(size_) + " bytes can hold",
                   kHint);
}

void MatFile::AddArray(const std::string& variable, const std::string& name,
                       const matvar_t& v) {
  size_t rows, columns;
  if (!IsNumeric(v) || !Dimensions(v, &rows, &columns)) {
    left_out_.push_back(name);
    return;
  }
  CheckSize(name, v);
  const bool by_row = columns > rows;
  const size_t count = std::min(rows, columns);
  if (columns_.size() + count > kMostColumns) {
    left_out_.push_back(name);
    return;
  }
  for (size_t i = 0; i < count; ++i) {
    Column column;
    column.name = name;
    column.variable = variable;
    if (count > 1) {
      const std::string number = std::to_string(i + 1);
      column.name += by_row ? "(" + number + ",:)" : "(:," + number + ")";
    }
    column.begin = by_row ? i : i * rows;
    column.stride = by_row ? rows : 1;
    column.rows = std::max(rows, columns);
    columns_.push_back(column);
    header_.push_back(column.name);
  }
}

void MatFile::FindColumns() {
  std::set<std::string> seen;
  while (true) {
    const Variable v(Mat_VarReadNextInfo(file_.get()), &Mat_VarFree);
    if (v == nullptr) break;
    const std::string name = v->name == nullptr ? "" : v->name;
    if (name.empty() || !seen.insert(name).second) {
      throw InputError(path_, "a variable without a name of its own", kHint);
    }
    VisitArrays(name, *v, 0, [&](const std::string& array, const matvar_t& a) {
      AddArray(name, array, a);
    });
  }
  if (columns_.empty()) {
    throw InputError(path_,
                     left_out_.empty() ? "holds no variables that can be read"
                                       : "holds no arrays of real numbers",
                     left_out_.empty()
                         ? kHint
                         : "it has " + Join(left_out_) +
                               "; save vectors and matrices, such as "
                               "t = ts.Time; q = ts.Data");
  }
  if (left_out_.empty()) return;
  constexpr size_t kMostNames = 24;
  if (left_out_.size() > kMostNames) {
    const size_t more = left_out_.size() - kMostNames;
    left_out_.resize(kMostNames);
    left_out_.push_back("and " + std::to_string(more) + " more");
  }
  notices_.push_back("left out what is no array of real numbers: " +
                     Join(left_out_));
}

void MatFile::ReadVariable(const std::string& variable,
                           const std::vector<int>& wanted,
                           std::vector<std::vector<double>>* numbers) const {
  const Variable v(Mat_VarRead(file_.get(), variable.c_str()), &Mat_VarFree);
  if (v == nullptr) {
    throw InputError(path_ + ":" + variable, "cannot be read", kHint);
  }
  std::set<std::string> done;
  VisitArrays(variable, *v, 0, [&](const std::string& name, const matvar_t& a) {
    for (size_t i = 0; i < wanted.size(); ++i) {
      const Column& column = columns_[wanted[i]];
      const bool mine =
          column.variable == variable &&
          (column.name == name || column.name.starts_with(name + "("));
      size_t rows, columns;
      if (!mine || !IsNumeric(a) || a.data == nullptr ||
          !Dimensions(a, &rows, &columns) ||
          column.begin + (column.rows - 1) * column.stride >= rows * columns ||
          a.nbytes < rows * columns * Mat_SizeOfClass(a.class_type) ||
          !(*numbers)[i].empty()) {
        continue;
      }
      (*numbers)[i].reserve(column.rows);
      CopyNumbers(a, column, &(*numbers)[i]);
    }
  });
}

void MatFile::ReadRows(const std::vector<int>& wanted, const Visit& visit) {
  std::vector<std::vector<double>> numbers(wanted.size());
  std::set<std::string> variables;
  for (const int w : wanted) {
    const Column& first = columns_[wanted[0]];
    const Column& column = columns_[w];
    variables.insert(column.variable);
    if (column.rows == first.rows) continue;
    throw InputError(
        HeaderPlace(w),
        "has " + CountOf(static_cast<long>(column.rows), "sample") + ", but " +
            Shown(first.name) + " " + std::to_string(first.rows),
        "columns that are read together have one length");
  }
  for (const std::string& variable : variables) {
    ReadVariable(variable, wanted, &numbers);
  }
  std::vector<double> cells(wanted.size());
  const size_t rows = wanted.empty() ? 0 : columns_[wanted[0]].rows;
  for (size_t i = 0; i < wanted.size(); ++i) {
    if (numbers[i].size() == rows) continue;
    throw InputError(HeaderPlace(wanted[i]), "cannot be read", kHint);
  }
  for (size_t row = 0; row < rows; ++row) {
    for (size_t i = 0; i < wanted.size(); ++i) {
      cells[i] = numbers[i][row];
      if (!std::isinf(cells[i])) continue;
      throw InputError(Place(static_cast<int>(row), wanted[i]), "is not finite",
                       "NaN is a missing measurement");
    }
    visit(cells);
  }
}

}  // namespace

bool BeginsMatFile(std::string_view first_bytes) {
  return first_bytes.starts_with("MATLAB ");
}

std::unique_ptr<TableFile> OpenMatFile(ByteSource source, const std::string&) {
  if (!source.is_file()) {
    throw InputError(source.path(), "is a MATLAB file, which cannot be a pipe",
                     "save it as a file");
  }
  return std::make_unique<MatFile>(source);
}

}  // namespace sysid
