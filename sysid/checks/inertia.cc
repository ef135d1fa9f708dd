#include "sysid/checks/inertia.h"

#include "models/math/decompositions.h"
#include "sysid/checks/finding.h"

namespace sysid {

Eigen::Matrix3d AboutCentre(const Inertial<double>& body) {
  const Eigen::Vector3d& r = body.com;
  return body.inertia -
         body.mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() -
                      r * r.transpose());
}

bool CouldBeAboutJoint(const Inertial<double>& body, double share) {
  const double mr2 = body.mass * body.com.squaredNorm();
  const double largest = EigenOfSymmetric(body.inertia).values[2];
  if (!(mr2 > 0.0) || mr2 < share * largest) return false;
  const double least =
      EigenOfSymmetric(SecondMoments<double>(AboutCentre(body))).values[0];
  // Data sheets round: a moment of the mass may be a little negative.
  return least > -0.05 * mr2 && AboutCentre(body).diagonal().minCoeff() > 0.0;
}

std::string InertialLine(const Inertial<double>& body, const std::string& link,
                         const std::string& file) {
  const Eigen::Matrix3d& I = body.inertia;
  return "in " + file + ", link " + link + ": <mass value=\"" +
         ShortNumber(body.mass) + "\"/> <inertia ixx=\"" +
         ShortNumber(I(0, 0)) + "\" ixy=\"" + ShortNumber(I(0, 1)) +
         "\" ixz=\"" + ShortNumber(I(0, 2)) + "\" iyy=\"" +
         ShortNumber(I(1, 1)) + "\" iyz=\"" + ShortNumber(I(1, 2)) +
         "\" izz=\"" + ShortNumber(I(2, 2)) + "\"/>";
}

}  // namespace sysid
