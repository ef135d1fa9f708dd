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

// A column that is in another unit by all signs: what the reader refuses,
// together with the expression that would read it right.
class MisreadColumn : public UnreadableRun {
 public:
  MisreadColumn(const std::string& fault, const std::string& place,
                const std::string& what, const std::string& hint,
                const std::string& name, const std::string& expression)
      : UnreadableRun(fault, place, what, hint),
        name_(name),
        expression_(expression) {}

  const std::string& name() const { return name_; }  // "joint2.q"
  const std::string& expression() const { return expression_; }

 private:
  std::string name_, expression_;
};

}  // namespace sysid
