#pragma once

#include <string>
#include <string_view>

namespace sysid {

// Decompresses `bytes`, which claim to be `size` bytes then; what is allocated
// follows what comes out, not the claim. "" or what is wrong: data that is
// damaged or does not come to `size`, or a method that this build does not
// have ("needs the library ...").
std::string DecompressBzip2(std::string_view bytes, size_t size,
                            std::string* out);
std::string DecompressLz4(std::string_view bytes, size_t size,
                          std::string* out);

}  // namespace sysid
