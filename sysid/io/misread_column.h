#pragma once

#include <string>

#include "sysid/io/unreadable_run.h"

namespace sysid {

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
