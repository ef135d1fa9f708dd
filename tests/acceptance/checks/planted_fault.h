#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sysid/checks/finding.h"
#include "sysid/session/session.h"
#include "tests/acceptance/checks/clean_case.h"

namespace sysid {

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
