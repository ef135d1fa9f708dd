#pragma once

#include <exception>
#include <stop_token>

namespace sysid {

// Thrown out of a fit, a diagnosis or whatever else watches
// EstimationOptions::stop, soon after that asked it to stop: at the next
// iteration of a solver, or the next segment or candidate of other long work.
// Nothing comes of what was begun.
class Cancelled final : public std::exception {
 public:
  const char* what() const noexcept override { return "cancelled"; }
};

inline void ThrowIfCancelled(const std::stop_token& stop) {
  if (stop.stop_requested()) throw Cancelled();
}

}  // namespace sysid
