#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"

namespace sysid {

// Whether a hinge's angles are degrees rather than radians. There is no proof
// in numbers alone, so each rule needs something that radians do not do:
//
//  1. The joint's own velocity column disagrees by 180/pi: the slope of the
//     position's differences over the velocity's integral is 57.3 within 20 %
//     at a correlation above 0.9. (A slope of pi/180: the velocity is in
//     degrees.)
//  2. The angle jumps by nearly 360 from one sample to the next (a sensor that
//     wraps), within +-360.
//  3. It swings to and fro, within +-400: at least two half-swings of more than
//     two turns (4 pi), each of three samples or more, at a mean speed beyond
//     40 rad/s, of a joint that is no continuous one. Spinning pendulums turn
//     as far, but slower, or do not come back. Two half-swings that are slower,
//     or of a wheel, are only `kPerhaps`.
//
// Rules 2 and 3 look at the median of three samples: outliers are no evidence.
// A joint that turns on and on in radians meets none of them. What is beyond
// the URDF's limits is no proof either: they may be wrong, or the unit another
// (CheckLimits).
enum class DegreesVerdict { kNo, kPerhaps, kPosition, kVelocity };

struct DegreesReport {
  DegreesVerdict verdict = DegreesVerdict::kNo;
  bool certain = false;  // degrees, by rules 1 and 2: else only no radians
  std::string reason;    // for the user: "it swings over 120.0 ..."
};

// t in s; q and, where measured, qd (else empty) as they were read, NaN where
// missing.
DegreesReport LookForDegrees(const Joint& joint, const std::vector<double>& t,
                             const std::vector<double>& q,
                             const std::vector<double>& qd);

}  // namespace sysid
