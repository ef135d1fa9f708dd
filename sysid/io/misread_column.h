#pragma once

#include <string>

#include "models/error.h"

namespace sysid {

// A column that is in another unit by all signs: what the reader refuses,
// together with the expression that would read it right.
class MisreadColumn : public InputError {
 public:
  MisreadColumn(const std::string& place, const std::string& what,
                const std::string& hint, const std::string& name,
                const std::string& expression)
      : InputError(place, what, hint), name_(name), expression_(expression) {}

  const std::string& name() const { return name_; }  // "joint2.q"
  const std::string& expression() const { return expression_; }

 private:
  std::string name_, expression_;
};

}  // namespace sysid
