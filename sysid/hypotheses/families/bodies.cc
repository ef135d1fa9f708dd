// Inertial values of the URDF that are not what a URDF means.

#include "sysid/checks/inertia.h"
#include "sysid/hypotheses/families/families.h"

namespace sysid {
void BodyHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all) {
  // A mass of 20 g is the least that is worth a URDF: in grams it says 20.
  constexpr double kGrams = 20.0;
  const Mechanism& mechanism = input.model->mechanism();
  const auto add = [&](const std::vector<int>& links, DataFault fault,
                       const std::string& says, const std::string& consequence,
                       const std::function<void(Inertial<double>*)>& change) {
    if (links.empty()) return;
    DataHypothesis hypothesis;
    hypothesis.fault = fault;
    hypothesis.consequence = consequence;
    hypothesis.like_bodies = true;
    hypothesis.change_model = [links, change](Model* model) {
      MechanismParameters<double> values = model->nominal();
      for (const int link : links) change(&values.links[link]);
      model->SetNominal(values);
    };
    for (const int link : links) {
      hypothesis.subjects.push_back(mechanism.links[link].name);
    }
    hypothesis.says = Words("with " + says + " of " + hypothesis.subject());
    all->push_back(hypothesis);
  };
  const auto about_centre = [](Inertial<double>* body) {
    body->inertia = AboutCentre(*body);
  };
  const auto mass_alone = [](Inertial<double>* body) { body->mass *= 1e-3; };
  const auto both = [](Inertial<double>* body) {
    body->mass *= 1e-3;
    body->inertia *= 1e-3;
  };
  const std::string twice =
      "a URDF's inertia is about the centre of mass: m r^2 counts twice";
  const std::string thousand =
      "every effort that was measured is a thousandth of what such a mass "
      "would need";
  std::vector<int> about_joint, heavy;
  for (int i = 1; i < static_cast<int>(mechanism.links.size()); ++i) {
    const Inertial<double>& body = input.model->nominal().links[i];
    if (body.mass > 0.0 && CouldBeAboutJoint(body, kPossible)) {
      about_joint.push_back(i);
    }
    if (body.mass >= kGrams) heavy.push_back(i);
  }
  const auto each_and_all = [&](const std::vector<int>& links,
                                const auto& add_one) {
    for (const int link : links) add_one(std::vector<int>{link});
    if (links.size() > 1) add_one(links);
  };
  each_and_all(about_joint, [&](const std::vector<int>& links) {
    add(links, DataFault::kInertiaAboutJoint, "the inertia about the joint",
        twice, about_centre);
  });
  each_and_all(heavy, [&](const std::vector<int>& links) {
    add(links, DataFault::kMassInGrams, "the mass in grams", thousand,
        mass_alone);
    add(links, DataFault::kMassInGrams, "mass and inertia in grams", thousand,
        both);
  });
}

}  // namespace sysid
