#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sysid/session/session.h"

namespace sysid {

// A recording without a fault.
struct CleanCase {
  std::string name;
  Session session;  // model, what is free, runs
  bool real = false;
};

// The shipped models, simulated with noise of 1e-3; a seed each. Where
// `missing` is true the mechanism has an effect that the model lacks: no fault
// of the data.
std::vector<CleanCase> SimulatedCases(std::uint64_t seed, bool missing);

// The recordings of SYSID_REAL_DATA with their models; empty where they are
// absent.
std::vector<CleanCase> RecordedCases(const std::string& folder);

}  // namespace sysid
