#pragma once

#include <string>
#include <string_view>

namespace sysid {

// Whether a text is UTF-8 (RFC 3629).
bool IsUtf8(std::string_view text);

// Whether it holds a control character, line feeds and tabs among them. Where
// it is UTF-8, U+0080 to U+009F too: a terminal takes U+009B for ESC [.
bool HasControls(std::string_view text);

// The text with '?' for the control characters but line feeds, and for what is
// no UTF-8: what a file says must not reach a terminal as commands to it.
// InputError's texts and the notices are so.
std::string Printable(std::string_view text);

// A cell or name as an error shows it: in quotes, at most 40 characters, what
// cannot be printed as '?'.
std::string Shown(std::string_view text);

inline bool IsBlank(char c) { return c == ' ' || c == '\t'; }

// Without the blanks around.
std::string_view Trim(std::string_view text);

}  // namespace sysid
