#include "sysid/io/read_file.h"

#include <cstring>

#include "models/error.h"
#include "sysid/io/byte_source.h"
#include "sysid/io/memory.h"

namespace sysid {

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
