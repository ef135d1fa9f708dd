#include "tests/support/mjcf.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cstdio>
#include <sstream>

namespace sysid {
namespace {

// Every digit, so that the text carries the numbers themselves.
template <class V>
std::string Numbers(const V& values) {
  std::string text;
  for (int i = 0; i < values.size(); ++i) {
    char number[32];
    std::snprintf(number, sizeof(number), i == 0 ? "%.17g" : " %.17g",
                  static_cast<double>(values[i]));
    text += number;
  }
  return text;
}

std::string QuaternionOf(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return Numbers(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
}

// Principal moments and axes: MuJoCo's own diagonalisation of `fullinertia`
// stops at 1e-12.
std::string InertialElement(const Inertial<double>& body) {
  if (body.mass == 0.0) return "";
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(body.inertia);
  Eigen::Matrix3d axes = eigen.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1.0;
  std::ostringstream out;
  out << "<inertial mass=\"" << Numbers(Eigen::Matrix<double, 1, 1>(body.mass))
      << "\" pos=\"" << Numbers(body.com) << "\" quat=\"" << QuaternionOf(axes)
      << "\" diaginertia=\"" << Numbers(eigen.eigenvalues()) << "\"/>";
  return out.str();
}

const char* MujocoType(JointType type) {
  if (IsRotation1(type)) return "hinge";
  return type == JointType::kPrismatic ? "slide" : "ball";
}

void WriteBody(const Mechanism& mechanism, const std::vector<double>& armature,
               int index, std::ostream* out) {
  const Joint& joint = mechanism.joints[index];
  const int link = joint.child_link;
  Eigen::Vector3d p = mechanism.nominal.joint_p[index];
  if (joint.held) p += joint.held->slide;
  *out << "<body name=\"l" << link << "\" pos=\"" << Numbers(p) << "\" quat=\""
       << QuaternionOf(joint.R_PJ) << "\">"
       << InertialElement(mechanism.nominal.links[link]);
  if (joint.type != JointType::kFixed) {
    const double rotor = armature.empty() ? 0.0 : armature[index];
    *out << "<joint name=\"j" << link << "\" type=\"" << MujocoType(joint.type)
         << "\" pos=\"0 0 0\" axis=\"" << Numbers(joint.axis) << "\" damping=\""
         << Numbers(Eigen::Matrix<double, 1, 1>(joint.damping))
         << "\" armature=\"" << Numbers(Eigen::Matrix<double, 1, 1>(rotor))
         << "\" limited=\"false\"";
    // As hard as MuJoCo's softened constraints can be.
    if (joint.friction > 0.0) {
      *out << " frictionloss=\""
           << Numbers(Eigen::Matrix<double, 1, 1>(joint.friction))
           << "\" solimpfriction=\"0.9999 0.9999 0.001\"";
    }
    *out << "/>";
  }
  *out << "\n";
  for (const int child : mechanism.links[link].child_joints) {
    WriteBody(mechanism, armature, child, out);
  }
  *out << "</body>\n";
}

}  // namespace

std::string ToMjcf(const Mechanism& mechanism,
                   const std::vector<double>& armature) {
  std::ostringstream out;
  out << "<mujoco>\n<compiler angle=\"radian\" inertiafromgeom=\"false\" "
         "balanceinertia=\"false\" boundmass=\"0\" boundinertia=\"0\"/>\n"
      << "<option gravity=\""
      << Numbers(Eigen::Vector3d(0.0, 0.0, -mechanism.nominal.gravity))
      << "\"><flag contact=\"disable\"/></option>\n<worldbody>\n";
  for (const int child : mechanism.links[0].child_joints) {
    WriteBody(mechanism, armature, child, &out);
  }
  out << "</worldbody>\n</mujoco>\n";
  return out.str();
}

}  // namespace sysid
