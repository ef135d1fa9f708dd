#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace sysid {

inline constexpr char kNoDecompression[] =
    "this sysid was built without the library for it";

// Decompresses `bytes`, which claim to be `size` bytes then; what is allocated
// follows what comes out, not the claim. "" or what is wrong: data that is
// damaged or does not come to `size`, or kNoDecompression.
std::string DecompressBzip2(std::string_view bytes, size_t size,
                            std::string* out);
std::string DecompressLz4(std::string_view bytes, size_t size,
                          std::string* out);

}  // namespace sysid
