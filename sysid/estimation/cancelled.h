#pragma once

#include <exception>
#include <stop_token>
#include <string>

namespace sysid {

// Thrown out of a fit, a diagnosis or whatever else watches
// EstimationOptions::stop, soon after that asked it to stop: at the next
// iteration of a solver, or the next segment or candidate of other long work.
// Nothing comes of what was begun, unless EstimationOptions::keep_best or
// DiagnosisOptions::keep_evaluated asks for what there is.
class Cancelled final : public std::exception {
 public:
  const char* what() const noexcept override { return "cancelled"; }
};

inline void ThrowIfCancelled(const std::stop_token& stop) {
  if (stop.stop_requested()) throw Cancelled();
}

// Who ended a work before it was through.
enum class StoppedBy { kNobody, kTime, kUser };
// As results say it: "", "time", "user".
inline std::string ToString(StoppedBy by) {
  return by == StoppedBy::kTime ? "time" : by == StoppedBy::kUser ? "user" : "";
}

// What Fit::termination says of a fit that was stopped: "while joined segments"
// is `when`.
inline std::string InterruptedWords(const std::string& when) {
  return "interrupted " + when +
         ": this is the best point so far, and no minimum";
}

}  // namespace sysid
