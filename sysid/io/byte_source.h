#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace sysid {

// The bytes of a file, a pipe or a text, front to back, a block at a time.
class ByteSource {
 public:
  // Opens a file or pipe. Throws InputError (place: the path) where it is
  // missing, a folder or cannot be opened.
  explicit ByteSource(const std::string& path);
  // The bytes of `text`; `path` only names it in errors.
  ByteSource(const std::string& path, std::string text);
  ByteSource(ByteSource&& other) noexcept;
  ~ByteSource();

  const std::string& path() const { return path_; }
  // Whether it is a file of size() bytes that can be read from anywhere: not a
  // pipe.
  bool is_file() const { return fd_ >= 0 && is_file_; }
  uint64_t size() const { return size_; }

  // At most `n` bytes; 0 only at the end. Throws InputError where reading
  // fails.
  size_t Read(char* into, size_t n);
  // The next bytes, which stay to be read: `n`, or fewer at the end.
  std::string_view Peek(size_t n);

 private:
  size_t ReadFile(char* into, size_t n);

  std::string path_;
  int fd_ = -1;
  bool is_file_ = false;
  uint64_t size_ = 0;
  std::string ahead_;  // of what was peeked, or the text
  size_t at_ = 0;      // in ahead_
};

// Throws InputError where it begins as a text in UTF-16 does.
void CheckNotUtf16(ByteSource* source);

// The text of a file. Throws InputError (place: the path) where it is missing,
// a folder, cannot be read, is binary (holds a NUL byte) or larger than half of
// the memory. Pipes are fine.
std::string ReadTextFile(const std::string& path);

}  // namespace sysid
