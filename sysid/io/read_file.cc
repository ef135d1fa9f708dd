#include "sysid/io/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "models/error.h"
#include "sysid/io/memory.h"

namespace sysid {
namespace {

constexpr size_t kChunk = size_t{1} << 20;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

}  // namespace

std::string ReadTextFile(const std::string& path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) {
    const int error = errno;
    if (error == ENOENT) {
      throw InputError(path, "there is no such file",
                       "check the name and the folder that you are in");
    }
    throw InputError(path,
                     std::string("cannot be opened: ") + std::strerror(error));
  }
  struct stat status {};
  if (fstat(file.get(), &status) == 0 && S_ISDIR(status.st_mode)) {
    throw InputError(path, "is a folder, not a file", "name a file in it");
  }
  const std::string what = "a text of that size";
  const std::string hint = "is this the file that you mean?";
  CheckMemory(2.0 * static_cast<double>(status.st_size), path, what, hint);
  std::string text;
  while (true) {
    const size_t size = text.size();
    // A pipe does not say how much comes; the text doubles as it grows.
    if (size == text.capacity()) {
      CheckMemory(3.0 * static_cast<double>(size), path, what, hint);
    }
    text.resize(size + kChunk);
    const ssize_t got = read(file.get(), text.data() + size, kChunk);
    if (got < 0) {
      if (errno == EINTR) {
        text.resize(size);
        continue;
      }
      throw InputError(path,
                       std::string("cannot be read: ") + std::strerror(errno));
    }
    text.resize(size + static_cast<size_t>(got));
    if (got == 0) return text;
    // At once, not at the end: /dev/zero has no end.
    if (std::memchr(text.data() + size, 0, static_cast<size_t>(got))) {
      throw InputError(path, "is not a text file: it holds a NUL byte",
                       "save it as text in UTF-8");
    }
  }
}

}  // namespace sysid
