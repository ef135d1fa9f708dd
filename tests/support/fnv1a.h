#pragma once

#include <cstdint>
#include <string_view>

namespace sysid {

// FNV-1a of 32 bits (Fowler, Noll and Vo): a text as the seed of random
// draws, the same on every machine, which std::hash is not.
constexpr std::uint32_t Fnv1a(std::string_view text) {
  constexpr std::uint32_t kOffsetBasis = 2166136261u, kPrime = 16777619u;
  std::uint32_t hash = kOffsetBasis;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * kPrime;
  }
  return hash;
}

// From the authors' list of test vectors.
static_assert(Fnv1a("") == 0x811c9dc5u && Fnv1a("foobar") == 0xbf9cf968u);

}  // namespace sysid
