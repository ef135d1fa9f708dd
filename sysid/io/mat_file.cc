#include "sysid/io/mat_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/child_process.h"
#include "sysid/io/mat_arrays.h"

namespace sysid {
namespace {

constexpr uint64_t kHeader = 128;

bool ReadAt(std::istream* file, uint64_t at, std::span<unsigned char> bytes) {
  file->clear();
  file->seekg(static_cast<std::streamoff>(at));
  file->read(reinterpret_cast<char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return !file->fail();
}

uint64_t LittleEndian(std::span<const unsigned char> bytes) {
  uint64_t value = 0;
  for (size_t i = bytes.size(); i > 0; --i) value = value << 8 | bytes[i - 1];
  return value;
}

// The superblock holds the address of the end, behind MATLAB's 512 bytes.
uint64_t Hdf5Length(std::istream* file) {
  constexpr uint64_t kSuperblock = 512;
  constexpr size_t kEnd[] = {40, 44, 28, 28};  // by its version
  unsigned char block[52];
  if (!ReadAt(file, kSuperblock, block)) return kSuperblock + sizeof(block);
  const bool is_hdf5 = std::memcmp(block, "\x89HDF", 4) == 0;
  const size_t version = block[8];
  if (!is_hdf5 || version >= std::size(kEnd)) return 0;
  if (block[version < 2 ? 13 : 9] != 8) return 0;  // bytes of an address
  return LittleEndian(std::span(block).subspan(kEnd[version], 8));
}

// Each variable is behind its type and its number of bytes.
uint64_t ChainLength(std::istream* file, uint64_t size, bool big_endian) {
  constexpr uint64_t kMatrix = 14, kCompressed = 15;
  uint64_t end = kHeader;
  while (end < size) {
    unsigned char tag[8];
    if (!ReadAt(file, end, tag)) return end + sizeof(tag);
    if (big_endian) {
      std::reverse(tag, tag + 4);
      std::reverse(tag + 4, tag + 8);
    }
    const uint64_t type = LittleEndian(std::span(tag).first(4));
    if (type != kMatrix && type != kCompressed) return 0;
    end += sizeof(tag) + LittleEndian(std::span(tag).last(4));
  }
  return end;
}

// How many bytes a MATLAB file would have at least, by what stands in its first
// `size`, which are all there are: more where it is cut off, 0 where it does
// not say. A file that is cut between two variables does not show it.
//
// Version 5 and 7: MAT-File Format, MathWorks, chapter 1. Version 7.3: HDF5
// File Format Specification, "Superblock".
uint64_t MatFileLength(std::istream* file, uint64_t size) {
  unsigned char header[kHeader];
  if (!ReadAt(file, 0, header)) return kHeader;
  const bool big_endian = header[126] == 'M';
  const unsigned char major = header[big_endian ? 124 : 125];
  return major == 2 ? Hdf5Length(file) : ChainLength(file, size, big_endian);
}

using Json = nlohmann::json;

// What passes between the processes; both are this program: the size of an
// answer's head, as a number, the head as CBOR, and rows of doubles. The head
// is an InputError's place, text and hint as a list, or what was asked for.
void WriteHead(std::FILE* out, const Json& head) {
  const std::vector<uint8_t> bytes = Json::to_cbor(head);
  const uint64_t size = bytes.size();
  std::fwrite(&size, sizeof(size), 1, out);
  std::fwrite(bytes.data(), 1, bytes.size(), out);
}

// Discarded where it cannot be read.
Json ReadHead(std::FILE* in) {
  constexpr uint64_t kLargest = uint64_t{1} << 28;
  uint64_t size;
  if (std::fread(&size, sizeof(size), 1, in) != 1 || size > kLargest) {
    return Json::value_t::discarded;
  }
  std::vector<uint8_t> bytes(size);
  bytes.resize(std::fread(bytes.data(), 1, size, in));
  return Json::from_cbor(bytes, true, false);
}

class MatFile : public TableFile {
 public:
  explicit MatFile(const ByteSource& source)
      : TableFile(source.path()), size_(source.size()) {
    MatContents contents;
    Ask([&](std::FILE* out) { WriteHead(out, ListMatFile(path_, size_)); },
        [&](const Json& head, std::FILE*) {
          head.get_to(contents);
          return true;
        });
    columns_ = contents.columns;
    for (const MatColumn& column : columns_) header_.push_back(column.name);
    NoteLeftOut(contents.left_out);
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

  void ReadRows(const std::vector<int>& wanted, const Visit& visit) override {
    if (wanted.empty()) return;
    std::vector<MatColumn> columns;
    const MatColumn& first = columns_[wanted[0]];
    for (const int w : wanted) {
      columns.push_back(columns_[w]);
      if (columns_[w].rows == first.rows) continue;
      throw InputError(HeaderPlace(w),
                       "has " + CountOf(columns_[w].rows, "sample") + ", but " +
                           Shown(first.name) + " " + std::to_string(first.rows),
                       "columns that are read together have one length");
    }
    std::vector<double> cells(wanted.size());
    Ask(
        [&](std::FILE* out) {
          const std::vector<std::vector<double>> numbers =
              ReadMatColumns(path_, columns);
          WriteHead(out, Json::object());
          for (size_t row = 0; row < first.rows; ++row) {
            for (const std::vector<double>& column : numbers) {
              std::fwrite(&column[row], sizeof(double), 1, out);
            }
          }
        },
        [&](const Json&, std::FILE* in) {
          for (size_t row = 0; row < first.rows; ++row) {
            if (std::fread(cells.data(), sizeof(double), cells.size(), in) !=
                cells.size()) {
              return false;
            }
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

 private:
  // Has `work` done in a process of its own and takes what it writes; throws
  // the InputError that it throws, and one of its own where it fails.
  void Ask(
      const std::function<void(std::FILE* out)>& work,
      const std::function<bool(const Json& head, std::FILE* in)>& take) const {
    // To inflate takes a second for 100 MB of numbers.
    const int64_t cpu_seconds = 20 + static_cast<int64_t>(size_ >> 20);
    ChildProcess child(
        [&](std::FILE* out) {
          try {
            work(out);
          } catch (const InputError& error) {
            WriteHead(out, {error.place(), error.detail(), error.hint()});
          } catch (const std::exception&) {
            std::abort();  // no memory
          }
        },
        cpu_seconds);
    bool complete = false;
    try {
      const Json head = ReadHead(child.out());
      if (head.is_array()) throw InputError(head.at(0), head.at(1), head.at(2));
      complete = head.is_object() && take(head, child.out());
    } catch (const Json::exception&) {
      // A child that lost its senses.
    }
    const std::string failure = child.Finish();
    if (complete && failure.empty()) return;
    throw InputError(path_,
                     "the library that reads MATLAB files failed on it" +
                         (failure.empty() ? "" : ": " + failure),
                     kMatHint);
  }

  void NoteLeftOut(const std::vector<std::string>& left_out) {
    if (columns_.empty()) {
      throw InputError(path_,
                       left_out.empty() ? "holds no variables that can be read"
                                        : "holds no arrays of real numbers",
                       left_out.empty()
                           ? kMatHint
                           : "it has " + JoinSome(left_out) +
                                 "; save vectors and matrices, such as "
                                 "t = ts.Time; q = ts.Data");
    }
    if (left_out.empty()) return;
    notices_.push_back("left out what is no array of real numbers: " +
                       JoinSome(left_out));
  }

  uint64_t size_;
  std::vector<MatColumn> columns_;
};

}  // namespace

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
