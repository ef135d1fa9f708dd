#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/acceptance/checks/planted_fault.h"

namespace sysid {

// What the kinds of faults share: what is drawn, joints that can have one, and
// the same change of every run of a case.

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double Uniform(double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(engine_);
  }
  double Sign() { return Uniform(0, 1) < 0.5 ? -1.0 : 1.0; }
  // Of either sign, its size between these.
  double EitherSign(double a, double b) {
    const double sign = Sign();
    return sign * Uniform(a, b);
  }
  int Below(int n) { return static_cast<int>(Uniform(0, n) * (1 - 1e-12)); }

 private:
  std::mt19937_64 engine_;
};

// Joints of one degree of freedom: those whose position is measured, and those
// with an effort; joints that are balls.
std::vector<int> SimpleJoints(const Session& session);
std::vector<int> DrivenJoints(const Session& session);
std::vector<int> BallJoints(const Session& session);

// The simple ones that are measured beside another or an effort: of one alone
// no sign shows, and no lag.
std::vector<int> JointsBesideAnother(const Session& session);

// Of these, those of which a lag shows: a drive that is late by itself has no
// clean reading.
std::vector<int> JointsOnTime(const Session& session);

// The simple ones that turn, or slide.
std::vector<int> Hinges(const Session& session);
std::vector<int> Slides(const Session& session);

// A joint drawn from a list; -1 from an empty one.
int DrawJoint(const std::vector<int>& from, Dice* dice);

// Null where it is not measured.
Channel* PositionOf(Run* run, int joint);

// From the smallest to the largest that is measured.
double SpanOf(const Channel& channel);

using Planted = std::optional<Session>;

// Every run of a copy, changed.
Session Changed(const Session& session,
                const std::function<void(Run*)>& change);

// A fault of a joint's column, the joint drawn of these. The change draws the
// same in every run.
using JointChange = std::function<void(int joint, Dice*, const Session&, Run*)>;
Fault OfJoint(const std::string& name, std::vector<std::string> as_good,
              const std::function<std::vector<int>(const Session&)>& joints,
              const JointChange& change);

// Of the time column, or of a run as a whole; drawn anew in each.
Fault OfRun(const std::string& name,
            const std::function<void(Dice*, Run*)>& change);

}  // namespace sysid
