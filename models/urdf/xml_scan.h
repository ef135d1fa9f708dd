#pragma once

#include <string>

namespace sysid {

// Checks that a text is well-formed XML as far as TinyXML does not: one root
// element with nothing but comments around it, every element closed by its own
// end tag, attributes quoted and in UTF-8, no control characters, neither as
// they are nor by their number (&#0;), nothing left open, no more than 100
// elements inside each other (TinyXML would recurse into them). Throws
// InputError with line and column; `path` is what messages call the file.
void CheckWellFormed(const std::string& text, const std::string& path);

}  // namespace sysid
