#include "models/physical.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "models/error.h"

namespace sysid {
namespace {

using Eigensystem = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

std::string FaultOf(const Inertial<double>& body) {
  if (body.mass < 0) return "mass " + Number(body.mass) + " kg is negative";
  const Eigen::Vector3d moments = Eigensystem(body.inertia).eigenvalues();
  const double scale = moments.cwiseAbs().maxCoeff();
  const std::string listed = "principal moments " + Number(moments[0]) + ", " +
                             Number(moments[1]) + ", " + Number(moments[2]) +
                             " kg m^2 ";
  if (moments[0] < -1e-9 * scale) return listed + "are not all positive";
  if (moments[0] + moments[1] < moments[2] * (1 - 1e-6)) {
    return listed + "violate the triangle inequality";
  }
  return "";
}

}  // namespace

std::vector<PhysicalFault> PhysicalFaults(
    const Mechanism& mechanism, const MechanismParameters<double>& values) {
  std::vector<PhysicalFault> faults;
  for (size_t i = 1; i < mechanism.links.size(); ++i) {
    const std::string fault = FaultOf(values.links[i]);
    if (!fault.empty()) faults.push_back({static_cast<int>(i), fault});
  }
  return faults;
}

std::string ToString(const std::vector<PhysicalFault>& faults,
                     const Mechanism& mechanism) {
  std::vector<std::string> texts;
  for (const PhysicalFault& fault : faults) {
    texts.push_back("link '" + mechanism.links[fault.link].name +
                    "': " + fault.text);
  }
  return Join(texts, "; ");
}

Eigen::Matrix3d NearestPossible(const Eigen::Matrix3d& inertia) {
  constexpr double kLeast = 1e-3;
  const Eigensystem eigen(SecondMoments<double>(inertia));
  const Eigen::Vector3d& s = eigen.eigenvalues();
  const Eigen::Vector3d inside = s.cwiseMax(kLeast * s.cwiseAbs().sum());
  const Eigen::Matrix3d& Q = eigen.eigenvectors();
  const Eigen::Matrix3d S = Q * inside.asDiagonal() * Q.transpose();
  return inside.sum() * Eigen::Matrix3d::Identity() - 0.5 * (S + S.transpose());
}

bool CanStart(const Eigen::Matrix3d& inertia) {
  const Eigen::Vector3d s =
      Eigensystem(SecondMoments<double>(inertia)).eigenvalues();
  return s[2] > 0.0 && s[0] >= -1e-10 * s[2];
}

double StartingMass(const Mechanism& mechanism,
                    const MechanismParameters<double>& values) {
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < mechanism.links.size(); ++i) {
    if (values.links[i].mass > 0) least = std::min(least, values.links[i].mass);
  }
  return std::isfinite(least) ? least : 1.0;
}

Eigen::Matrix3d StartingInertia(const Mechanism& mechanism,
                                const MechanismParameters<double>& values,
                                int link) {
  const Inertial<double>& body = values.links[link];
  if (CanStart(body.inertia)) return body.inertia;
  if (!body.inertia.isZero(0)) return NearestPossible(body.inertia);
  constexpr double kSmall = 0.05;  // m, of a link that has no extent either
  const double length = LinkLength(mechanism, values, link);
  const double r = body.com.norm() > 1e-9 ? body.com.norm()
                   : length > 1e-9        ? 0.5 * length
                                          : kSmall;
  const double m = body.mass > 0 ? body.mass : StartingMass(mechanism, values);
  return 0.4 * m * r * r * Eigen::Matrix3d::Identity();
}

}  // namespace sysid
