#pragma once

#include <string>

namespace sysid {

// A value and where it was read ("fit.yaml:3:5"), for errors that come later.
template <typename T>
struct Located {
  T value{};
  std::string place;
};

}  // namespace sysid
