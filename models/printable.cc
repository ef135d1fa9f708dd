#include "models/printable.h"

namespace sysid {
namespace {

// Bytes of the letter that begins at `i`; 0: none does. A lead byte has as many
// that follow as it announces, and none is longer than it must be.
size_t LetterLength(std::string_view text, size_t i) {
  const auto byte = [&](size_t k) {
    return static_cast<unsigned char>(i + k < text.size() ? text[i + k] : 0);
  };
  const unsigned char lead = byte(0);
  size_t length = 1;
  if (lead >= 0xC2 && lead <= 0xDF) {
    length = 2;
  } else if (lead >= 0xE0 && lead <= 0xEF) {
    length = 3;
  } else if (lead >= 0xF0 && lead <= 0xF4) {
    length = 4;
  } else if (lead >= 0x80) {
    return 0;
  }
  for (size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0) != 0x80) return 0;
  }
  if ((lead == 0xE0 && byte(1) < 0xA0) || (lead == 0xED && byte(1) > 0x9F) ||
      (lead == 0xF0 && byte(1) < 0x90) || (lead == 0xF4 && byte(1) > 0x8F)) {
    return 0;
  }
  return length;
}

bool IsControl(std::string_view letter) {
  const auto byte = [&](size_t k) {
    return static_cast<unsigned char>(letter[k]);
  };
  if (letter.size() == 1) return byte(0) < 0x20 || byte(0) == 0x7F;
  return letter.size() == 2 && byte(0) == 0xC2 && byte(1) < 0xA0;
}

}  // namespace

bool IsUtf8(std::string_view text) {
  for (size_t i = 0; i < text.size();) {
    const size_t length = LetterLength(text, i);
    if (length == 0) return false;
    i += length;
  }
  return true;
}

bool HasControls(std::string_view text) {
  for (size_t i = 0; i < text.size();) {
    const size_t length = LetterLength(text, i);
    if (IsControl(text.substr(i, length))) return true;
    i += length == 0 ? 1 : length;
  }
  return false;
}

std::string Printable(std::string_view text) {
  std::string shown;
  for (size_t i = 0; i < text.size();) {
    const size_t length = LetterLength(text, i);
    const std::string_view letter = text.substr(i, length);
    if (length == 0 || (IsControl(letter) && letter != "\n")) {
      shown += '?';
    } else {
      shown += letter;
    }
    i += length == 0 ? 1 : length;
  }
  return shown;
}

std::string Shown(std::string_view text) {
  constexpr size_t kMost = 40;
  std::string shown = "'";
  for (const char c : text.substr(0, kMost)) {
    // Bytes of UTF-8 are kept whole only as long as the text is not cut.
    const bool printable = static_cast<unsigned char>(c) >= 0x80
                               ? text.size() <= kMost
                               : c >= ' ' && c != 0x7f;
    shown += printable ? c : '?';
  }
  if (text.size() > kMost) shown += "...";
  return shown + "'";
}

std::string_view Trim(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

}  // namespace sysid
