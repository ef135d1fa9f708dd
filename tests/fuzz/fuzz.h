#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "models/error.h"

// What the fuzz targets share (docs/robustness.md). A target is a program of
// its own: libFuzzer calls LLVMFuzzerTestOneInput with texts that it makes from
// tests/fuzz/corpus/<target>/, and takes an abort for a finding.

namespace sysid {

// A property that must hold for every input. Not glog's CHECK: its flags and
// streams are no part of what is tested.
#define FUZZ_EXPECT(condition)                                             \
  do {                                                                     \
    if (!(condition)) {                                                    \
      std::fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                        \
    }                                                                      \
  } while (false)

inline std::string TextOf(const std::uint8_t* data, std::size_t size) {
  return std::string(reinterpret_cast<const char*>(data), size);
}

// Text that a terminal can show, and obeys nothing of.
inline void ExpectPrintable(const std::string& text) {
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    FUZZ_EXPECT(c == '\n' || c >= ' ');
    FUZZ_EXPECT(c != 0x7f);
    // U+0080 to U+009F: what ESC and a letter mean, too.
    if (c == 0xC2 && i + 1 < text.size()) {
      FUZZ_EXPECT(static_cast<unsigned char>(text[i + 1]) >= 0xA0);
    }
  }
}

// Every error that a user meets says what is wrong.
inline void ExpectReadable(const InputError& error) {
  const std::string what = error.what();
  FUZZ_EXPECT(!what.empty());
  ExpectPrintable(what);
}

}  // namespace sysid
