#pragma once

#include <string_view>

namespace sysid {

// A date with a clock as a number: seconds since 1970, without a zone as if it
// were UTC. "2024-05-01 12:00:00.005", with 'T', 'Z' or "+02:00" too,
// "2024/05/01 ..." and "01.05.2024 ..."; false for all else.
bool ParseTimestamp(std::string_view text, double* seconds);

}  // namespace sysid
