// Inertial values that no such body has.

#include <cmath>

#include "models/math/decompositions.h"
#include "sysid/checks/inertia.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

// Whether any joint between the base and the link turns. What only slides shows
// neither inertia nor centre of mass: placeholders stand there.
bool Turns(const Mechanism& mechanism, int link) {
  for (int at = link; at >= 0;) {
    int parent = -1;
    for (const Joint& joint : mechanism.joints) {
      if (joint.child_link != at) continue;
      if (IsRotation1(joint.type) || joint.type == JointType::kSpherical) {
        return true;
      }
      parent = joint.parent_link;
    }
    at = parent;
  }
  return false;
}

}  // namespace

void CheckBodies(const CheckInput& input, std::vector<Finding>* findings) {
  const Mechanism& mechanism = input.model->mechanism();
  for (size_t i = 1; i < mechanism.links.size(); ++i) {
    const Inertial<double>& body = input.model->nominal().links[i];
    if (body.mass <= 0.0 || !Turns(mechanism, static_cast<int>(i))) continue;
    Finding finding;
    finding.severity = Severity::kNote;
    finding.file = input.model_file;
    finding.subject = mechanism.links[i].name;
    const double r = body.com.norm();
    const double largest = EigenOfSymmetric(body.inertia).values[2];
    const double k = std::sqrt(largest / body.mass);  // radius of gyration
    if (CouldBeAboutJoint(body, kPlain)) {
      finding.fault = "inertia_about_joint";
      finding.weight = 2.0;
      finding.evidence = "its radius of gyration about the centre of mass is " +
                         ShortNumber(k) + " m, and the centre lies " +
                         ShortNumber(r) + " m from the joint: a rod has " +
                         ShortNumber(r / std::sqrt(3.0)) + " m";
      finding.consequence =
          "a URDF's inertia is about the centre of mass: one about the joint "
          "counts m r^2 twice";
      Inertial<double> centred = body;
      centred.inertia = AboutCentre(body);
      finding.remedies = {
          "if so, " + InertialLine(centred, finding.subject, input.model_file)};
      findings->push_back(finding);
      continue;
    }
    // No machine is so dense: osmium has 22.6 g/cm^3, and links are hollow.
    constexpr double kDensest = 22600.0;  // kg/m^3
    const double size = std::max(
        {2.0 * r, 2.0 * k,
         LinkLength(mechanism, input.model->nominal(), static_cast<int>(i))});
    if (size > 0.0 && body.mass > 20.0 &&
        body.mass / (size * size * size) > kDensest) {
      finding.fault = "mass_in_grams";
      finding.weight = 3.0;
      finding.evidence = ShortNumber(body.mass) + " kg in a link of about " +
                         ShortNumber(size) + " m";
      finding.consequence = "no body is so dense: is its mass in grams?";
      finding.remedies = {"--fix " + mechanism.links[i].name +
                          ".mass=" + ShortNumber(1e-3 * body.mass)};
      findings->push_back(finding);
      continue;
    }
    constexpr double kReach = 5.0;
    if (r > 0.0 && k > kReach * std::max(r, 0.05) && k > 1.0) {
      finding.fault = "inertia_suspicious";
      finding.weight = 1.0;
      finding.evidence = "its radius of gyration is " + ShortNumber(k) +
                         " m, and its centre of mass " + ShortNumber(r) +
                         " m from the joint";
      finding.consequence = "is its inertia in g m^2, kg mm^2 or kg cm^2?";
      finding.remedies = {"--fix " + mechanism.links[i].name +
                          ".inertia_scale=0.001"};
      findings->push_back(finding);
    }
  }
}

}  // namespace sysid
