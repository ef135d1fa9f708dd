#include "sysid/checks/model_findings.h"

#include <algorithm>

#include "models/dynamics.h"
#include "models/error.h"
#include "models/physical.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

// "a, b, c and 9 more".
std::string Listed(const std::vector<std::string>& names) {
  constexpr size_t kShown = 5;
  if (names.size() <= kShown + 1) return Join(names);
  return Join({names.begin(), names.begin() + kShown}) + " and " +
         std::to_string(names.size() - kShown) + " more";
}

Finding Note(const std::string& fault, const std::string& file,
             const std::vector<std::string>& names) {
  Finding finding;
  finding.fault = fault;
  finding.severity = Severity::kNote;
  finding.weight = 4.0;
  finding.file = file;
  finding.subject = Listed(names);
  return finding;
}

// By how much second moments are negative, as a share of all.
double Excess(const Inertial<double>& body) {
  if (body.mass < 0) return 1.0;
  const Eigen::Matrix3d nearest = NearestPossible(body.inertia);
  return (nearest - body.inertia).norm() / body.inertia.norm();
}

void FindImpossible(const Mechanism& mechanism, const std::string& file,
                    std::vector<Finding>* findings) {
  std::vector<PhysicalFault> faults =
      PhysicalFaults(mechanism, mechanism.nominal);
  for (size_t i = 1; i < mechanism.links.size(); ++i) {
    const Inertial<double>& body = mechanism.nominal.links[i];
    if (body.mass == 0 && CanStart(body.inertia)) {
      faults.push_back(
          {static_cast<int>(i), "a rotational inertia without a mass"});
    }
  }
  if (faults.empty()) return;
  std::vector<std::string> names;
  for (const PhysicalFault& fault : faults) {
    names.push_back(mechanism.links[fault.link].name);
  }
  const PhysicalFault& worst = *std::max_element(
      faults.begin(), faults.end(), [&](const auto& a, const auto& b) {
        return Excess(mechanism.nominal.links[a.link]) <
               Excess(mechanism.nominal.links[b.link]);
      });
  Finding finding = Note("inertia_not_physical", file, names);
  finding.evidence =
      names.size() == 1
          ? worst.text
          : "no body has such masses and moments; the worst is '" +
                mechanism.links[worst.link].name + "', " + worst.text;
  finding.consequence =
      "they are used as given; a free one starts from the nearest physically "
      "possible inertia";
  findings->push_back(finding);
}

void FindEmpty(const Mechanism& mechanism, const std::string& file,
               std::vector<Finding>* findings) {
  std::vector<std::string> names;
  for (const SingularJoint& joint : SingularJoints(Model(mechanism))) {
    names.push_back(mechanism.joints[joint.joint].name);
  }
  if (names.empty()) return;
  Finding finding = Note("no_inertia", file, names);
  finding.evidence = std::string("the links that ") +
                     (names.size() == 1 ? "it moves" : "they move") +
                     " have no inertia in the file";
  finding.consequence =
      "the only inertia there is what is added or free: a rotor, a mass, a "
      "rotational inertia";
  findings->push_back(finding);
}

void FindAxes(const Mechanism& mechanism, const std::string& file,
              std::vector<Finding>* findings) {
  // More than the digits that are lost in writing.
  constexpr double kRounding = 1e-3;
  std::vector<std::string> names;
  double first = 0.0;
  for (const Joint& joint : mechanism.joints) {
    if (std::abs(joint.axis_length - 1.0) <= kRounding) continue;
    if (names.empty()) first = joint.axis_length;
    names.push_back(joint.name);
  }
  if (names.empty()) return;
  Finding finding = Note("axis_not_unit", file, names);
  finding.evidence = "the axis has the length " + ShortNumber(first);
  finding.consequence = "only its direction is used";
  findings->push_back(finding);
}

void FindNegativeDynamics(const Mechanism& mechanism, const std::string& file,
                          std::vector<Finding>* findings) {
  std::vector<std::string> names;
  std::string first;
  for (const Joint& joint : mechanism.joints) {
    if (joint.damping >= 0.0 && joint.friction >= 0.0) continue;
    if (names.empty()) {
      first = joint.damping < 0.0 ? "damping " + ShortNumber(joint.damping)
                                  : "friction " + ShortNumber(joint.friction);
    }
    names.push_back(joint.name);
  }
  if (names.empty()) return;
  Finding finding = Note("dynamics_negative", file, names);
  finding.evidence = first + " would drive the joint";
  finding.consequence = "it is not used";
  findings->push_back(finding);
}

void FindReversedLimits(const Mechanism& mechanism, const std::string& file,
                        std::vector<Finding>* findings) {
  std::vector<std::string> names;
  std::string first;
  for (const Joint& joint : mechanism.joints) {
    const JointType type = joint.held ? joint.held->type : joint.type;
    if (type != JointType::kRevolute && type != JointType::kPrismatic) continue;
    if (!joint.has_limits || joint.lower <= joint.upper) continue;
    if (names.empty()) {
      first = ShortNumber(joint.lower) + " to " + ShortNumber(joint.upper);
    }
    names.push_back(joint.name);
  }
  if (names.empty()) return;
  Finding finding = Note("limits_reversed", file, names);
  finding.evidence = "the lower limit is above the upper one, " + first;
  finding.consequence = "these limits are not used";
  findings->push_back(finding);
}

}  // namespace

std::vector<Finding> ModelFindings(const Model& model,
                                   const std::string& file) {
  std::vector<Finding> findings;
  FindImpossible(model.mechanism(), file, &findings);
  FindEmpty(model.mechanism(), file, &findings);
  FindAxes(model.mechanism(), file, &findings);
  FindNegativeDynamics(model.mechanism(), file, &findings);
  FindReversedLimits(model.mechanism(), file, &findings);
  return findings;
}

void CheckModel(const CheckInput& input, std::vector<Finding>* findings) {
  for (const Finding& finding : ModelFindings(*input.model, input.model_file)) {
    findings->push_back(finding);
  }
}

}  // namespace sysid
