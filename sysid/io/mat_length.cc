#include "sysid/io/mat_length.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <span>

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

}  // namespace

uint64_t MatFileLength(std::istream* file, uint64_t size) {
  unsigned char header[kHeader];
  if (!ReadAt(file, 0, header)) return kHeader;
  const bool big_endian = header[126] == 'M';
  const unsigned char major = header[big_endian ? 124 : 125];
  return major == 2 ? Hdf5Length(file) : ChainLength(file, size, big_endian);
}

}  // namespace sysid
