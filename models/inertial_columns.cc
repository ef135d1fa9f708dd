#include "models/inertial_columns.h"

namespace sysid {

bool HasInertialColumns(const Workspace<double>& ws) {
  return ws.model().followers().empty() && ws.link_force_effects.empty();
}

void InertialColumns(const Workspace<double>& ws, int link,
                     Eigen::Ref<RowMatrixXd> columns) {
  using Vector = Eigen::Vector3d;
  constexpr int kTen = 10;
  constexpr int kRow[] = {0, 1, 2, 0, 0, 1}, kColumn[] = {0, 1, 2, 1, 2, 2};
  columns.setZero();
  const Model& model = ws.model();
  const Placement& placement = model.placement(link);
  if (placement.body < 0) return;
  const BodyData<double>& own = ws.bodies[placement.body];
  const Eigen::Matrix3d R = own.R_WB * placement.R_BL;
  const Vector arm = own.R_WB * ws.p_BL[link];
  const Vector w = R.transpose() * own.w;
  const Vector alpha = R.transpose() * own.alpha;
  const Vector a = R.transpose() * (own.a + own.alpha.cross(arm) +
                                    own.w.cross(own.w.cross(arm)));
  Eigen::Matrix<double, 3, kTen> f, n;  // (2.30) by column
  f.setZero();
  n.setZero();
  f.col(0) = a;
  for (int c = 0; c < 3; ++c) {
    const Vector e = Vector::Unit(c);
    f.col(1 + c) = alpha.cross(e) + w.cross(w.cross(e));
    n.col(1 + c) = e.cross(a);
  }
  for (int i = 0; i < 6; ++i) {
    Vector I_alpha = Vector::Zero(), I_w = Vector::Zero();
    I_alpha[kRow[i]] = alpha[kColumn[i]];
    I_alpha[kColumn[i]] = alpha[kRow[i]];
    I_w[kRow[i]] = w[kColumn[i]];
    I_w[kColumn[i]] = w[kRow[i]];
    n.col(4 + i) = I_alpha + w.cross(I_w);
  }
  f = R * f;
  n = R * n;
  // To the body's origin, then joint by joint to the base.
  Vector lever = arm;
  for (int j = placement.body; j >= 0; j = model.bodies()[j].parent) {
    for (int c = 0; c < kTen; ++c) n.col(c) += lever.cross(f.col(c));
    const Body& body = model.bodies()[j];
    const BodyData<double>& b = ws.bodies[j];
    if (body.type == JointType::kSpherical) {
      columns.middleRows(body.v_index, 3) = b.R_WB.transpose() * n;
    } else {
      columns.row(body.v_index) =
          b.axis.transpose() * (body.type == JointType::kPrismatic ? f : n);
    }
    lever = b.r;
  }
}

}  // namespace sysid
