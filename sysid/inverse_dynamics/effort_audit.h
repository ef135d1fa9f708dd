#pragma once

#include <vector>

#include "sysid/inverse_dynamics/equation_rows.h"

namespace sysid {

// Whether what was recorded as the effort u of a joint is one, by least squares
// over all times of
//
//   u = b_0 (u - r) + b_1 qd + b_2 sgn(qd) + b_3 qdd,                  (11.19)
//
// u - r what the bodies of the model need. It is none where the joint's motion
// explains less than 0.3 of it, or where it follows what the
// bodies need, and is another multiple of that than any body so unlike the
// model's would make it.
struct EffortAudit {
  double explained = 1.0;  // of the mean square of u; 1 where nothing is known
  double scale = 1.0;      // b_0
  double rigid = 0.0;      // the part of u that b_0 (u - r) is, by its rms
  bool IsEffort() const;
};
std::vector<EffortAudit> AuditEfforts(const std::vector<EquationRows>& runs);

}  // namespace sysid
