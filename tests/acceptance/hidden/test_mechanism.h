#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "models/model.h"
#include "sysid/parameters/free_parameter.h"

namespace sysid {

// What makes a mechanism move.
enum class Drive {
  kNone,       // a swing from rest and a push
  kMultisine,  // as sysid_simulate --excite multisine
  kTracking,   // a controller that follows sines in the driven joints
};

// A mechanism of the suite: the plain model that a user has, and how it is
// recorded.
struct TestMechanism {
  std::string name;
  Model plain;  // at the values of its URDF, without any effect
  std::vector<FreeParameter> free;
  Drive drive = Drive::kNone;
  double tilt = 0.0;  // of the start, rad
  double push = 0.0;  // of the start, rad/s
  // Over which a change of the state stays about as large as it is, s: what an
  // effect does is compared over so long.
  double window = 1.0;
  // Of kTracking: joints that are driven, about what and how far, rad or m.
  std::vector<int> driven;
  std::vector<double> middle;
  double sweep = 0.0;

  explicit TestMechanism(const Model& m) : plain(m) {}
};

// The shipped pendulum1, pendulum2, pendulum2_planar, pendulum3_planar,
// cartpole and arm7, free as their specifications say; and
//   pendulum3        three links on balls, among the hidden effects alone
//   pendulum2_balls  pendulum2 with balls of 0.15 m for bobs: friction on a
//                    spherical joint whose bob is nearly a point (an axial
//                    moment of 7.5e-5) is so stiff that a fit takes minutes;
//   rail             cartpole with a controlled cart and a free pole;
//   arm3             a light arm of three joints with names of its own.
// CHECKs the name.
TestMechanism MakeTestMechanism(const std::string& name);
std::vector<std::string> TestMechanismNames();

// The mechanism that is recorded: free parameters within 10 % of their start.
Model TrueModel(const TestMechanism& mechanism, std::uint64_t seed);

// Where a recording starts, x = (q, qd). Every joint is away from rest by at
// least half of what it may be.
Eigen::VectorXd StartOf(const TestMechanism& mechanism, std::uint64_t seed);

// What the driven joints of kTracking follow.
class Reference {
 public:
  Reference(const TestMechanism& mechanism, std::uint64_t seed);
  // q, qd and qdd of driven joint i.
  void At(int i, double t, double* q, double* qd, double* qdd) const;

 private:
  struct Sine {
    double amplitude, rate, phase;
  };
  std::vector<double> middle_;
  std::vector<std::vector<Sine>> sines_;  // per driven joint
};

}  // namespace sysid
