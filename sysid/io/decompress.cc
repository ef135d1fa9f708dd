#include "sysid/io/decompress.h"

#include <algorithm>
#include <cstring>

#ifdef SYSID_HAS_BZIP2
#include <bzlib.h>
#endif
#ifdef SYSID_HAS_LZ4
#include <lz4frame.h>
#endif

namespace sysid {
namespace {

[[maybe_unused]] constexpr size_t kBlock = size_t{1} << 18;

// Room for the next block, at most one byte more than `size`: enough to see
// that there is more.
[[maybe_unused]] char* Grow(size_t used, size_t size, std::string* out,
                            size_t* room) {
  *room = std::min(kBlock, size + 1 - used);
  out->resize(used + *room);
  return out->data() + used;
}

[[maybe_unused]] std::string Finish(size_t used, size_t size,
                                    std::string* out) {
  out->resize(std::min(used, out->size()));
  return used == size ? "" : "it does not come to the size that it claims";
}

}  // namespace

#ifdef SYSID_HAS_BZIP2
std::string DecompressBzip2(std::string_view bytes, size_t size,
                            std::string* out) {
  bz_stream stream;
  std::memset(&stream, 0, sizeof(stream));
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return "no memory";
  stream.next_in = const_cast<char*>(bytes.data());
  stream.avail_in = static_cast<unsigned>(bytes.size());
  size_t used = 0;
  int status = BZ_OK;
  while (status == BZ_OK && used <= size) {
    size_t room;
    stream.next_out = Grow(used, size, out, &room);
    stream.avail_out = static_cast<unsigned>(room);
    status = BZ2_bzDecompress(&stream);
    const size_t got = room - stream.avail_out;
    used += got;
    // It wants more than there is.
    if (status == BZ_OK && got == 0 && stream.avail_in == 0) break;
  }
  BZ2_bzDecompressEnd(&stream);
  if (status != BZ_STREAM_END) return "its bzip2 data is damaged";
  return Finish(used, size, out);
}
#else
std::string DecompressBzip2(std::string_view, size_t, std::string*) {
  return kNoDecompression;
}
#endif

#ifdef SYSID_HAS_LZ4
std::string DecompressLz4(std::string_view bytes, size_t size,
                          std::string* out) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) {
    return "no memory";
  }
  size_t used = 0;
  size_t at = 0;
  size_t status = 1;  // 0: the frame is complete
  while (status != 0 && !LZ4F_isError(status) && used <= size) {
    size_t got;
    char* const into = Grow(used, size, out, &got);
    size_t taken = bytes.size() - at;
    status = LZ4F_decompress(context, into, &got, bytes.data() + at, &taken,
                             nullptr);
    used += got;
    at += taken;
    if (status != 0 && got == 0 && taken == 0) break;  // it wants more
  }
  LZ4F_freeDecompressionContext(context);
  if (status != 0) return "its lz4 data is damaged";
  return Finish(used, size, out);
}
#else
std::string DecompressLz4(std::string_view, size_t, std::string*) {
  return kNoDecompression;
}
#endif

}  // namespace sysid
