// Inertial values of the URDF that are not what a URDF means.

#include <cmath>

#include "sysid/checks/inertia.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

// "the <inertial> of link1: ixx=..." for a URDF.
std::string Line(const Model& model, int link, const std::string& file) {
  const Inertial<double>& body = model.nominal().links[link];
  const Eigen::Matrix3d I = body.inertia;
  return "in " + file + ", link " + model.mechanism().links[link].name +
         ": <mass value=\"" + ShortNumber(body.mass) + "\"/> <inertia ixx=\"" +
         ShortNumber(I(0, 0)) + "\" ixy=\"" + ShortNumber(I(0, 1)) +
         "\" ixz=\"" + ShortNumber(I(0, 2)) + "\" iyy=\"" +
         ShortNumber(I(1, 1)) + "\" iyz=\"" + ShortNumber(I(1, 2)) +
         "\" izz=\"" + ShortNumber(I(2, 2)) + "\"/>";
}

}  // namespace

void ReadBodies(const CheckInput& input, std::vector<Reading>* readings) {
  const Mechanism& mechanism = input.model->mechanism();
  const auto add = [&](const std::vector<int>& links, const std::string& fault,
                       const std::string& says, const std::string& consequence,
                       const std::function<void(Inertial<double>*)>& change) {
    Reading reading;
    reading.fault = fault;
    reading.consequence = consequence;
    reading.change_model = [links, change](Model* model) {
      MechanismParameters<double> values = model->nominal();
      for (const int link : links) change(&values.links[link]);
      model->SetNominal(values);
    };
    Model changed = *input.model;
    reading.change_model(&changed);
    for (const int link : links) {
      reading.subject +=
          (reading.subject.empty() ? "" : ", ") + mechanism.links[link].name;
      reading.remedies.push_back(Line(changed, link, input.model_file));
    }
    reading.says = "with " + says + " of " + reading.subject;
    readings->push_back(reading);
  };
  const auto about_com = [](Inertial<double>* body) {
    body->inertia = AboutCentre(*body);
  };
  const auto from_grams = [](Inertial<double>* body) { body->mass *= 1e-3; };
  const auto all_from_grams = [](Inertial<double>* body) {
    body->mass *= 1e-3;
    body->inertia *= 1e-3;
  };
  std::vector<int> about_joint, heavy;
  for (size_t i = 1; i < mechanism.links.size(); ++i) {
    const Inertial<double>& body = input.model->nominal().links[i];
    if (body.mass <= 0.0) continue;
    if (CouldBeAboutJoint(body, kPossible))
      about_joint.push_back(static_cast<int>(i));
    if (body.mass >= 20.0) heavy.push_back(static_cast<int>(i));
  }
  const std::string twice =
      "a URDF's inertia is about the centre of mass: m r^2 counts twice";
  const std::string thousand =
      "every effort that was measured is a thousandth "
      "of what such a mass would need";
  const auto each_and_all = [&](const std::vector<int>& links,
                                const auto& add_one) {
    for (const int link : links) add_one(std::vector<int>{link});
    if (links.size() > 1) add_one(links);
  };
  each_and_all(about_joint, [&](const std::vector<int>& links) {
    add(links, "inertia_about_joint", "the inertia about the joint", twice,
        about_com);
  });
  each_and_all(heavy, [&](const std::vector<int>& links) {
    add(links, "mass_in_grams", "the mass in grams", thousand, from_grams);
    add(links, "mass_in_grams", "mass and inertia in grams", thousand,
        all_from_grams);
  });
}

}  // namespace sysid
