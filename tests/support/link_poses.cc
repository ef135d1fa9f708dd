#include "tests/support/link_poses.h"

#include "models/math/rotation.h"
#include "tests/support/ridders.h"

namespace sysid {

using Eigen::Vector3d;
using Eigen::VectorXd;

VectorXd Moved(const Mechanism& mechanism, const VectorXd& q,
               const VectorXd& dq) {
  VectorXd out = q;
  for (const Joint& joint : mechanism.joints) {
    if (joint.type == JointType::kFixed || joint.mimic) continue;
    if (joint.type != JointType::kSpherical) {
      out[joint.q_index] += dq[joint.v_index];
      continue;
    }
    const Vector3d u(dq[joint.v_index], dq[joint.v_index + 1],
                     dq[joint.v_index + 2]);
    const Eigen::Quaterniond at(q[joint.q_index + 3], q[joint.q_index],
                                q[joint.q_index + 1], q[joint.q_index + 2]);
    const Eigen::Quaterniond to = at * Exp<double>(u);
    for (int k = 0; k < 4; ++k) out[joint.q_index + k] = to.coeffs()[k];
  }
  return out;
}

// Of a hinge or slide: that of the joint which it follows, from one <mimic> to
// the next.
double Position(const Mechanism& mechanism, const Joint& joint,
                const VectorXd& q) {
  if (joint.type == JointType::kFixed) return 0.0;
  if (!joint.mimic) return q[joint.q_index];
  const Mimic& mimic = *joint.mimic;
  const Joint& leader = mechanism.joints[mechanism.FindJoint(mimic.joint)];
  return mimic.multiplier * Position(mechanism, leader, q) + mimic.offset;
}

std::vector<Eigen::Isometry3d> LinkPoses(const Mechanism& mechanism,
                                         const VectorXd& q) {
  std::vector<Eigen::Isometry3d> X(mechanism.links.size(),
                                   Eigen::Isometry3d::Identity());
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Joint& joint = mechanism.joints[i];
    Eigen::Isometry3d X_PC = Eigen::Isometry3d::Identity();
    X_PC.translate(mechanism.nominal.joint_p[i]);
    if (joint.held) X_PC.translate(joint.held->slide);
    X_PC.rotate(joint.R_PJ);
    if (IsRotation1(joint.type)) {
      X_PC.rotate(Eigen::AngleAxisd(Position(mechanism, joint, q), joint.axis));
    } else if (joint.type == JointType::kPrismatic) {
      X_PC.translate(Vector3d(joint.axis * Position(mechanism, joint, q)));
    } else if (joint.type == JointType::kSpherical) {
      X_PC.rotate(Eigen::Quaterniond(q[joint.q_index + 3], q[joint.q_index],
                                     q[joint.q_index + 1],
                                     q[joint.q_index + 2]));
    }
    X[joint.child_link] = X[joint.parent_link] * X_PC;
  }
  return X;
}

LinkRates RatesByDifferences(const Mechanism& mechanism, const VectorXd& q,
                             const VectorXd& qd, int link) {
  const Vector3d com = mechanism.nominal.links[link].com;
  const auto rate = RiddersDifference(
      [&](double h) {
        const Eigen::Isometry3d X =
            LinkPoses(mechanism, Moved(mechanism, q, h * qd))[link];
        const Vector3d p = X * com;
        VectorXd out(12);
        for (int k = 0; k < 9; ++k) out[k] = X.matrix()(k % 3, k / 3);
        for (int k = 0; k < 3; ++k) out[9 + k] = p[k];
        return out;
      },
      0.1);
  Eigen::Matrix3d Rd;
  for (int k = 0; k < 9; ++k) Rd(k % 3, k / 3) = rate.value[k];
  const Eigen::Matrix3d R = LinkPoses(mechanism, q)[link].linear();
  const Eigen::Matrix3d W = Rd * R.transpose();  // [w]x
  return {{rate.value[9], rate.value[10], rate.value[11]},
          {W(2, 1), W(0, 2), W(1, 0)}};
}

}  // namespace sysid
