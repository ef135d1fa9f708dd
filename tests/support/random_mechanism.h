#pragma once

#include <cstdint>
#include <random>

#include "models/effects/catalogue.h"
#include "models/mechanism.h"
#include "models/model.h"

namespace sysid {

// Draws that are the same on every machine: std::mt19937_64 is specified to the
// bit, the distributions of the standard library are not.
class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}

  double Uniform(double lower, double upper);
  int Integer(int n);  // 0 to n - 1
  double Normal();     // mean 0, standard deviation 1
  Eigen::VectorXd NormalVector(int n);
  Eigen::Vector3d Direction();    // unit
  Eigen::Quaterniond Rotation();  // uniform over all rotations

 private:
  std::mt19937_64 engine_;
};

// Mass 0.5 to 2 kg, centre of mass anywhere within some 0.3 m, inertia of a
// real body (about the centre of mass, in link axes) with random principal axes
// and radii of 2 to 20 cm.
Inertial<double> RandomInertial(Random* random);

// A tree of `joints` joints of random types (the first one moves), axes,
// origins and rotations R_PJ; two thirds continue a chain, the others branch
// off anywhere, the root included. Links behind moving joints have mass; every
// third link behind a fixed joint is a massless frame. Links are link1, ...,
// joints joint1, ...; the root is "base_link".
Mechanism RandomMechanism(int joints, Random* random);

// The tree of a number: the same `number` and seed, the same tree. Never less
// than two joints: cond(M) of a single joint is 1, and what its inertia loses
// where its axis passes near the centre of mass is not in it.
Mechanism RandomTree(int number, Random* random);

// Random numbers for the dynamics: positions anywhere, velocities,
// accelerations and efforts of order one.
struct RandomState {
  RandomState(const Mechanism& mechanism, Random* random);
  Eigen::VectorXd q, qd, qdd, tau;
};

// Adds every effect that the catalogue has for the mechanism, with random
// values of the size of their typical scales.
// Leaves out effects with one of the hooks `but`.
void AddEveryEffect(const Catalogue& catalogue, Random* random, Model* model,
                    unsigned but = 0);

}  // namespace sysid
