#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sysid/checks/finding.h"
#include "sysid/session/session.h"

namespace sysid {

// Recordings without a fault, and faults to plant in them.

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

// Plants one fault of the kind in a copy, of a size and at a joint that the
// seed draws; nothing where the case cannot have it.
struct Fault {
  std::string name;                  // the finding that is right
  std::vector<std::string> as_good;  // others that say the same
  std::function<std::optional<Session>(const CleanCase&, std::uint64_t seed)>
      plant;
};
const std::vector<Fault>& Faults();

// What sysid_check would say: of times that the reader refuses too.
std::vector<Finding> CheckCase(const Session& session);

// Whether the first finding is the planted one.
bool IsNamed(const Fault& fault, const std::vector<Finding>& findings);

}  // namespace sysid
