#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "sysid/estimation/shooting_problem.h"
#include "sysid/session/session.h"

namespace sysid {

// What Identify and Diagnose say while they work, and how they are stopped. All
// of it may be left empty.
struct Callbacks {
  // Called once, where all that was asked for is read and found to be good,
  // before the long work, with the notices and findings that there are by then.
  // What it throws ends the call. A program sees here whether it can write its
  // results. Of several processes each calls it.
  std::function<void(const Session&)> ready;
  // How far the work is.
  std::function<void(const Progress&)> progress;
  // What a user should know at once: where an interrupted fit can go on.
  std::function<void(const std::string&)> remark;
  // Asks the work to end with what there is: the best point so far (not
  // converged), or what was judged by then. Where there is nothing yet,
  // Cancelled is thrown (sysid/estimation/cancelled.h).
  std::stop_token stop;
};

}  // namespace sysid
