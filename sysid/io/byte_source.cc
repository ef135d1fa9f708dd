#include "sysid/io/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "models/error.h"
#include "sysid/io/memory.h"

namespace sysid {

ByteSource::ByteSource(const std::string& path) : path_(path) {
  fd_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd_ < 0) {
    const int error = errno;
    if (error == ENOENT) {
      throw InputError(path, "there is no such file",
                       "check the name and the folder that you are in");
    }
    throw InputError(path,
                     std::string("cannot be opened: ") + std::strerror(error));
  }
  struct stat status;
  if (fstat(fd_, &status) != 0) return;
  if (S_ISDIR(status.st_mode)) {
    close(fd_);
    throw InputError(path, "is a folder, not a file", "name a file in it");
  }
  is_file_ = S_ISREG(status.st_mode);
  size_ = is_file_ ? static_cast<uint64_t>(status.st_size) : 0;
}

ByteSource::ByteSource(const std::string& path, std::string text)
    : path_(path), size_(text.size()), ahead_(std::move(text)) {}

ByteSource::ByteSource(ByteSource&& other) noexcept
    : path_(std::move(other.path_)),
      fd_(std::exchange(other.fd_, -1)),
      is_file_(other.is_file_),
      size_(other.size_),
      ahead_(std::move(other.ahead_)),
      at_(other.at_) {}

ByteSource::~ByteSource() {
  if (fd_ >= 0) close(fd_);
}

size_t ByteSource::ReadFile(char* into, size_t n) {
  if (fd_ < 0) return 0;
  while (true) {
    const ssize_t got = read(fd_, into, n);
    if (got >= 0) return static_cast<size_t>(got);
    if (errno == EINTR) continue;
    throw InputError(path_,
                     std::string("cannot be read: ") + std::strerror(errno));
  }
}

size_t ByteSource::Read(char* into, size_t n) {
  if (at_ == ahead_.size()) return ReadFile(into, n);
  const size_t part = std::min(n, ahead_.size() - at_);
  std::memcpy(into, ahead_.data() + at_, part);
  at_ += part;
  return part;
}

std::string_view ByteSource::Peek(size_t n) {
  while (ahead_.size() - at_ < n) {
    char block[512];
    const size_t got = ReadFile(block, sizeof(block));
    if (got == 0) break;
    ahead_.append(block, got);
  }
  return std::string_view(ahead_).substr(at_, n);
}

void CheckNotUtf16(ByteSource* source) {
  const std::string_view mark = source->Peek(2);
  if (mark != "\xFF\xFE" && mark != "\xFE\xFF") return;
  throw InputError(source->path(), "is text in UTF-16, not UTF-8",
                   "iconv -f UTF-16 -t UTF-8 FILE > NEW, or save it as UTF-8");
}

std::string ReadTextFile(const std::string& path) {
  constexpr size_t kBlock = size_t{1} << 20;
  const std::string what = "a text of that size";
  const std::string hint = "is this the file that you mean?";
  ByteSource source(path);
  CheckNotUtf16(&source);
  if (source.is_file()) CheckMemory(2.0 * source.size(), path, what, hint);
  std::string text;
  while (true) {
    const size_t size = text.size();
    // A pipe does not say how much comes; the text doubles as it grows.
    if (size == text.capacity()) CheckMemory(3.0 * size, path, what, hint);
    text.resize(size + kBlock);
    const size_t got = source.Read(text.data() + size, kBlock);
    text.resize(size + got);
    if (got == 0) return text;
    // At once, not at the end: /dev/zero has no end.
    if (std::memchr(text.data() + size, 0, got)) {
      throw InputError(path, "is not a text file: it holds a NUL byte",
                       "save it as text in UTF-8");
    }
  }
}

}  // namespace sysid
