#pragma once

#include "models/workspace.h"

namespace sysid {

// Derivatives of the inverse dynamics, (2.15), by the ten inertial parameters
// of a link, in which they are linear:
//
//   (m, m c_x, m c_y, m c_z, I_xx, I_yy, I_zz, I_xy, I_xz, I_yz),      (2.29)
//
// kg, kg m and kg m^2, in the link's axes, moments about its origin. With w,
// alpha and a the angular velocity, the angular acceleration and the
// acceleration of the origin less gravity, in those axes, the link needs about
// its origin
//
//   f = m a + alpha x mc + w x (w x mc),
//   n = I alpha + w x I w + mc x a                                     (2.30)
//
// (Khalil and Dombre 2002, section 9.3.5), which each joint that carries it
// bears. `columns`, nv x 10, N m or N by those units. `ws` as InverseDynamics
// of the same state left it; of a model without followers, and without forces
// of effects on links, which depend on where a link's centre is.
void InertialColumns(const Workspace<double>& ws, int link,
                     Eigen::Ref<RowMatrixXd> columns);

// Whether a model is of those.
bool HasInertialColumns(const Workspace<double>& ws);

}  // namespace sysid
