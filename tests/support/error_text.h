#pragma once

#include <functional>
#include <string>

#include "models/error.h"

namespace sysid {

// The whole text of the InputError that `call` throws; "no error" if none.
inline std::string ErrorText(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace sysid
