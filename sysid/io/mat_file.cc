#include "sysid/io/mat_file.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <functional>
#include <vector>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/child_process.h"
#include "sysid/io/mat_arrays.h"
#include "sysid/io/mat_length.h"

namespace sysid {
namespace {

// What passes between the processes; both are this program. Each answer is a
// fault, of an InputError, or "" and what was asked for.
class Writer {
 public:
  explicit Writer(std::FILE* out) : out_(out) {}
  void Put(uint64_t value) { std::fwrite(&value, sizeof(value), 1, out_); }
  void Put(double value) { std::fwrite(&value, sizeof(value), 1, out_); }
  void Put(const std::string& text) {
    Put(uint64_t{text.size()});
    std::fwrite(text.data(), 1, text.size(), out_);
  }

 private:
  std::FILE* out_;
};

// False at the end of what was written.
class Reader {
 public:
  explicit Reader(std::FILE* in) : in_(in) {}
  bool Take(uint64_t* value) {
    return std::fread(value, sizeof(*value), 1, in_) == 1;
  }
  bool Take(double* values, size_t n) {
    return std::fread(values, sizeof(*values), n, in_) == n;
  }
  bool Take(std::string* text) {
    uint64_t size;
    // More would be a child that lost its senses.
    if (!Take(&size) || size > uint64_t{1} << 20) return false;
    text->resize(size);
    return std::fread(text->data(), 1, size, in_) == size;
  }

 private:
  std::FILE* in_;
};

class MatFile : public TableFile {
 public:
  explicit MatFile(const ByteSource& source)
      : TableFile(source.path()), size_(source.size()) {
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
  void Ask(const std::function<void(Writer*)>& work,
           const std::function<bool(Reader*)>& take) const;
  void FindColumns();
  void NoteLeftOut(std::vector<std::string> left_out);

  uint64_t size_;
  std::vector<MatColumn> columns_;
};

// Has `work` done in a process of its own and takes what it writes; throws the
// InputError that it throws, and one of its own where it fails.
void MatFile::Ask(const std::function<void(Writer*)>& work,
                  const std::function<bool(Reader*)>& take) const {
  // To inflate takes a second for 100 MB of numbers.
  const int64_t cpu_seconds = 20 + static_cast<int64_t>(size_ >> 20);
  ChildProcess child(
      [&](std::FILE* out) {
        Writer writer(out);
        try {
          work(&writer);
        } catch (const InputError& error) {
          const std::string text = error.what();
          const size_t what = error.place().size() + 2;
          writer.Put(error.place());
          writer.Put(text.substr(what, text.find("\n  hint: ") - what));
          writer.Put(error.hint());
        } catch (const std::exception&) {
          std::abort();  // no memory
        }
      },
      cpu_seconds);
  Reader reader(child.out());
  std::string place, what, hint;
  bool complete = reader.Take(&place);
  if (complete && !place.empty()) {
    if (reader.Take(&what) && reader.Take(&hint)) {
      throw InputError(place, what, hint);
    }
    complete = false;
  }
  complete = complete && take(&reader);
  const std::string failure = child.Finish();
  if (complete && failure.empty()) return;
  throw InputError(path_,
                   "the library that reads MATLAB files failed on it" +
                       (failure.empty() ? "" : ": " + failure),
                   kMatHint);
}

void MatFile::FindColumns() {
  std::vector<std::string> left_out;
  Ask(
      [&](Writer* writer) {
        const MatContents contents = ListMatFile(path_, size_);
        writer->Put(std::string());
        writer->Put(uint64_t{contents.columns.size()});
        for (const MatColumn& column : contents.columns) {
          writer->Put(column.name);
          writer->Put(column.variable);
          writer->Put(uint64_t{column.begin});
          writer->Put(uint64_t{column.stride});
          writer->Put(uint64_t{column.rows});
        }
        writer->Put(uint64_t{contents.left_out.size()});
        for (const std::string& name : contents.left_out) writer->Put(name);
      },
      [&](Reader* reader) {
        uint64_t columns, names, begin, stride, rows;
        if (!reader->Take(&columns)) return false;
        for (uint64_t i = 0; i < columns; ++i) {
          MatColumn column;
          if (!reader->Take(&column.name) || !reader->Take(&column.variable) ||
              !reader->Take(&begin) || !reader->Take(&stride) ||
              !reader->Take(&rows)) {
            return false;
          }
          column.begin = begin;
          column.stride = stride;
          column.rows = rows;
          header_.push_back(column.name);
          columns_.push_back(column);
        }
        if (!reader->Take(&names)) return false;
        for (uint64_t i = 0; i < names; ++i) {
          left_out.emplace_back();
          if (!reader->Take(&left_out.back())) return false;
        }
        return true;
      });
  NoteLeftOut(left_out);
}

void MatFile::NoteLeftOut(std::vector<std::string> left_out) {
  constexpr size_t kMostNames = 24;
  if (left_out.size() > kMostNames) {
    const size_t more = left_out.size() - kMostNames;
    left_out.resize(kMostNames);
    left_out.push_back("and " + std::to_string(more) + " more");
  }
  if (columns_.empty()) {
    throw InputError(path_,
                     left_out.empty() ? "holds no variables that can be read"
                                      : "holds no arrays of real numbers",
                     left_out.empty()
                         ? kMatHint
                         : "it has " + Join(left_out) +
                               "; save vectors and matrices, such as "
                               "t = ts.Time; q = ts.Data");
  }
  if (left_out.empty()) return;
  notices_.push_back("left out what is no array of real numbers: " +
                     Join(left_out));
}

void MatFile::ReadRows(const std::vector<int>& wanted, const Visit& visit) {
  if (wanted.empty()) return;
  std::vector<MatColumn> columns;
  const MatColumn& first = columns_[wanted[0]];
  for (const int w : wanted) {
    columns.push_back(columns_[w]);
    if (columns_[w].rows == first.rows) continue;
    throw InputError(
        HeaderPlace(w),
        "has " + CountOf(static_cast<long>(columns_[w].rows), "sample") +
            ", but " + Shown(first.name) + " " + std::to_string(first.rows),
        "columns that are read together have one length");
  }
  std::vector<double> cells(wanted.size());
  Ask(
      [&](Writer* writer) {
        const std::vector<std::vector<double>> numbers =
            ReadMatColumns(path_, columns);
        writer->Put(std::string());
        for (size_t row = 0; row < first.rows; ++row) {
          for (const std::vector<double>& column : numbers) {
            writer->Put(column[row]);
          }
        }
      },
      [&](Reader* reader) {
        for (size_t row = 0; row < first.rows; ++row) {
          if (!reader->Take(cells.data(), cells.size())) return false;
          for (size_t i = 0; i < cells.size(); ++i) {
            if (!std::isinf(cells[i])) continue;
            throw InputError(Place(static_cast<int>(row), wanted[i]),
                             "is not finite", "NaN is a missing measurement");
          }
          visit(cells);
        }
        return true;
      });
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
  std::ifstream file(source.path(), std::ios::binary);
  const uint64_t length = MatFileLength(&file, source.size());
  if (length > source.size()) {
    throw InputError(source.path(),
                     "is cut off: it has " + std::to_string(source.size()) +
                         " bytes, and should have " + std::to_string(length) +
                         " or more",
                     "copy it again, or save it again; was the disk full?");
  }
  return std::make_unique<MatFile>(source);
}

}  // namespace sysid
