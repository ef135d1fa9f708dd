#include "sysid/io/degrees.h"

#include <algorithm>
#include <cmath>

#include "sysid/io/cell.h"

namespace sysid {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kTwoTurns = 4.0 * M_PI;

// The samples where the angle was measured.
struct Track {
  std::vector<double> t, q;
  std::vector<size_t> sample;
};

Track Measured(const std::vector<double>& t, const std::vector<double>& q) {
  Track track;
  for (size_t i = 0; i < q.size(); ++i) {
    if (!std::isfinite(q[i])) continue;
    track.t.push_back(t[i]);
    track.q.push_back(q[i]);
    track.sample.push_back(i);
  }
  return track;
}

// The median of each sample and its neighbours: a single outlier is neither a
// jump nor a swing.
Track WithoutOutliers(const Track& track) {
  Track smooth = track;
  for (size_t i = 1; i + 1 < track.q.size(); ++i) {
    const double a = track.q[i - 1], b = track.q[i], c = track.q[i + 1];
    smooth.q[i] = std::max(std::min(a, b), std::min(std::max(a, b), c));
  }
  return smooth;
}

// Slope of the position's differences over the velocity's integral, 0 where
// they do not go together. Over about 50 windows, so that the noise of single
// samples (differences at 1 kHz are little else) does not matter.
double PositionOverVelocity(const Track& track, const std::vector<double>& qd) {
  std::vector<double> q, integral;
  double sum = 0.0;
  for (size_t i = 0; i < track.q.size(); ++i) {
    const double v = qd[track.sample[i]];
    if (!std::isfinite(v)) continue;
    if (i > 0 && std::isfinite(qd[track.sample[i - 1]])) {
      sum +=
          0.5 * (v + qd[track.sample[i - 1]]) * (track.t[i] - track.t[i - 1]);
    }
    q.push_back(track.q[i]);
    integral.push_back(sum);
  }
  const size_t stride = std::max<size_t>(1, q.size() / 50);
  double xx = 0.0, xy = 0.0, yy = 0.0;
  int windows = 0;
  for (size_t i = stride; i < q.size(); i += stride) {
    const double dq = q[i] - q[i - stride];
    const double dv = integral[i] - integral[i - stride];
    xx += dv * dv;
    xy += dv * dq;
    yy += dq * dq;
    ++windows;
  }
  constexpr int kFewest = 8;
  if (windows < kFewest || xx <= 0.0 || yy <= 0.0) return 0.0;
  const double correlation = xy / std::sqrt(xx * yy);
  return correlation > 0.9 ? xy / xx : 0.0;
}

// A jump by nearly a full turn in degrees between neighbours.
double WrapJump(const Track& track) {
  for (size_t i = 1; i < track.q.size(); ++i) {
    if (track.sample[i] != track.sample[i - 1] + 1) continue;
    const double jump = std::abs(track.q[i] - track.q[i - 1]);
    const bool within =
        std::max(std::abs(track.q[i]), std::abs(track.q[i - 1])) <= 361.0;
    if (within && jump > 330.0 && jump < 361.0) return jump;
  }
  return 0.0;
}

struct Swings {
  int count = 0;         // half-swings of more than two turns
  int fast = 0;          // of them, those at a mean speed beyond kFast
  double largest = 0.0;  // of them
  double speed = 0.0;    // mean speed of the fastest of them
};
constexpr double kFast = 40.0;  // rad/s; see the header

// Half-swings between turning points (a turn back of more than kTwoTurns makes
// a turning point). The first and the last are not bounded by two of them and
// count too. One that takes fewer than three samples is a fault of the sensor.
Swings FindSwings(const Track& track) {
  std::vector<size_t> turns = {0};
  size_t extreme = 0;
  int direction = 0;
  for (size_t i = 1; i < track.q.size(); ++i) {
    const double from_extreme = track.q[i] - track.q[extreme];
    if (direction == 0) {
      const double from_start = track.q[i] - track.q[0];
      if (std::abs(from_start) > kTwoTurns) {
        direction = from_start > 0 ? 1 : -1;
        extreme = i;
      }
    } else if (from_extreme * direction > 0) {
      extreme = i;
    } else if (std::abs(from_extreme) > kTwoTurns) {
      turns.push_back(extreme);
      direction = -direction;
      extreme = i;
    }
  }
  if (direction != 0) turns.push_back(extreme);
  Swings swings;
  for (size_t i = 1; i < turns.size(); ++i) {
    if (turns[i] - turns[i - 1] < 3) continue;
    const double swing = std::abs(track.q[turns[i]] - track.q[turns[i - 1]]);
    const double speed = swing / (track.t[turns[i]] - track.t[turns[i - 1]]);
    swings.largest = std::max(swings.largest, swing);
    swings.speed = std::max(swings.speed, speed);
    ++swings.count;
    if (speed > kFast) ++swings.fast;
  }
  return swings;
}

}  // namespace

DegreesReport LookForDegrees(const Joint& joint, const std::vector<double>& t,
                             const std::vector<double>& q,
                             const std::vector<double>& qd) {
  const Track measured = Measured(t, q);
  if (!IsRotation1(joint.type) || measured.q.size() < 2) return {};
  if (!qd.empty()) {
    const double slope = PositionOverVelocity(measured, qd);
    if (std::abs(slope * kDegree - 1.0) < 0.2) {
      return {DegreesVerdict::kPosition, true,
              Format("its changes are %.1f times what its velocity column says "
                     "(180/pi is %.1f)",
                     slope, 1.0 / kDegree)};
    }
    if (std::abs(slope / kDegree - 1.0) < 0.2) {
      return {DegreesVerdict::kVelocity, true,
              Format("it is %.1f times what the position's changes say (180/pi "
                     "is %.1f)",
                     1.0 / slope, 1.0 / kDegree)};
    }
  }
  const Track track = WithoutOutliers(measured);
  if (const double jump = WrapJump(track); jump > 0.0) {
    return {DegreesVerdict::kPosition, true,
            Format("it jumps by %.1f from one sample to the next, as a sensor "
                   "does that wraps at %.0f degrees",
                   jump, 360.0)};
  }
  const auto [low, high] = std::minmax_element(track.q.begin(), track.q.end());
  const double most = std::max(std::abs(*low), std::abs(*high));
  const Swings swings = FindSwings(track);
  if (swings.count < 2 || most > 400.0) return {};
  // A wheel turns as fast as it likes.
  if (swings.fast >= 2 && joint.type != JointType::kContinuous) {
    return {DegreesVerdict::kPosition, false,
            Format("it swings to and fro over %.0f at up to %.0f a second: in "
                   "radians that is %.0f turns, %.0f turns a second",
                   swings.largest, swings.speed, swings.largest / (2.0 * M_PI),
                   swings.speed / (2.0 * M_PI))};
  }
  return {DegreesVerdict::kPerhaps, false,
          Format("it swings to and fro over %.1f: in radians %.1f turns",
                 swings.largest, swings.largest / (2.0 * M_PI))};
}

}  // namespace sysid
