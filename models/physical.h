#pragma once

#include <string>
#include <vector>

#include "models/mechanism.h"

namespace sysid {

// Whether the values of a mechanism's links are those of bodies. The dynamics
// do not ask: they use what stands there as long as the joint-space inertia is
// positive definite (SingularJoints in dynamics.h).

struct PhysicalFault {
  int link;
  std::string text;  // "principal moments 0.1, 0.1, 0.3 kg m^2 violate ..."
};

// Negative masses, principal moments that are negative or violate the triangle
// inequality; at most one of each link. The root cannot move: nothing is said
// of it.
std::vector<PhysicalFault> PhysicalFaults(
    const Mechanism& mechanism, const MechanismParameters<double>& values);

// "link 'a': <text>; link 'b': <text>".
std::string ToString(const std::vector<PhysicalFault>& faults,
                     const Mechanism& mechanism);

// A body has a rotational inertia I exactly where its second moments
// S = tr(I)/2 - I have no negative eigenvalue; I = tr(S) - S. With
// S = Q diag(s) Q^T, the S' nearest to S in the Frobenius norm among those with
// no eigenvalue below e is Q diag(max(s, e)) Q^T. Here e is a thousandth of
// |s_1| + |s_2| + |s_3|: inside of what is possible, so that a fit can move.
Eigen::Matrix3d NearestPossible(const Eigen::Matrix3d& inertia);

// Whether the logarithms of (4.1) can hold an inertia: its second moments are
// not negative and not all zero.
bool CanStart(const Eigen::Matrix3d& inertia);

// The inertia from which a fit that frees it starts, where CanStart refuses
// that of the link: the nearest possible one; where there is none at all, that
// of a solid ball of the link's mass which reaches from its centre to its
// joint. A link without mass counts as the lightest that moves.
Eigen::Matrix3d StartingInertia(const Mechanism& mechanism,
                                const MechanismParameters<double>& values,
                                int link);

// The mass of the lightest link that has one and moves, else 1 kg: where the
// mass of one without starts.
double StartingMass(const Mechanism& mechanism,
                    const MechanismParameters<double>& values);

}  // namespace sysid
