#include "sysid/io/read_file.h"

#include <cstring>

#include "models/error.h"
#include "sysid/io/byte_source.h"

namespace sysid {

std::string ReadTextFile(const std::string& path) {
  constexpr size_t kBlock = size_t{1} << 20;
  ByteSource source(path);
  std::string text;
  while (true) {
    const size_t size = text.size();
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
