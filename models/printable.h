#pragma once

#include <string>

namespace sysid {

// The text with '?' for the control characters but line feeds: what a file says
// must not reach a terminal as commands to it. InputError's texts are so.
std::string Printable(std::string text);

}  // namespace sysid
