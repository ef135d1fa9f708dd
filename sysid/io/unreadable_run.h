#pragma once

#include <string>

#include "models/error.h"

namespace sysid {

// What the reader refuses in a recording, by a short stable name: the fault of
// the finding that sysid_check makes of it ("time_repeats").
class UnreadableRun : public InputError {
 public:
  UnreadableRun(const std::string& fault, const std::string& place,
                const std::string& what, const std::string& hint = "")
      : InputError(place, what, hint), fault_(fault) {}

  const std::string& fault() const { return fault_; }

 private:
  std::string fault_;
};

}  // namespace sysid
