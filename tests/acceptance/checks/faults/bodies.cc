// What somebody wrote wrongly into a URDF.

#include <map>

#include "sysid/estimation/fit.h"
#include "tests/acceptance/checks/faults/plant.h"
#include "tests/acceptance/checks/faults/shipped_faults.h"

namespace sysid {
namespace {

// The model of a clean case: of a real one fitted to it, for what stands in its
// URDF is as rough as its data sheet.
const Model& CleanModel(const CleanCase& clean) {
  if (!clean.real) return clean.session.model;
  static std::map<std::string, Model>& fitted =
      *new std::map<std::string, Model>;
  const Session& session = clean.session;
  const std::string& name = session.runs.front().name;
  const auto known = fitted.find(name);
  if (known != fitted.end()) return known->second;
  ShootingProblem problem(session.model, session.free, session.runs,
                          session.options);
  return fitted.emplace(name, FitLevenbergMarquardt(problem).model)
      .first->second;
}

Fault OfModel(const std::string& name,
              const std::function<bool(const CleanCase&, int link)>& can,
              const std::function<void(Inertial<double>*)>& change) {
  return {name, {}, [=](const CleanCase& clean, std::uint64_t seed) -> Planted {
            Dice dice(seed);
            std::vector<int> links;
            const Model& model = CleanModel(clean);
            for (size_t i = 1; i < model.mechanism().links.size(); ++i) {
              if (can(clean, static_cast<int>(i))) {
                links.push_back(static_cast<int>(i));
              }
            }
            const int link = DrawJoint(links, &dice);
            if (link < 0) return std::nullopt;
            Session planted = clean.session;
            MechanismParameters<double> values = model.nominal();
            change(&values.links[link]);
            planted.model = model;
            planted.model.SetNominal(values);
            planted.free.clear();
            return planted;
          }};
}

}  // namespace

std::vector<Fault> BodyFaults() {
  return {
      OfModel(
          "inertia_about_joint",
          [](const CleanCase& clean, int link) {
            const Inertial<double>& body =
                clean.session.model.nominal().links[link];
            return body.mass * body.com.squaredNorm() > 1e-3 &&
                   clean.session.model_name != "video_pendulum" &&
                   clean.session.model_name != "emps";
          },
          [](Inertial<double>* body) {
            const Eigen::Vector3d& r = body->com;
            body->inertia +=
                body->mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() -
                              r * r.transpose());
          }),
      OfModel(
          "mass_in_grams",
          [](const CleanCase& clean, int link) {
            return clean.session.model.nominal().links[link].mass > 0.0 &&
                   !DrivenJoints(clean.session).empty() &&
                   clean.session.model_name != "emps";
          },
          [](Inertial<double>* body) { body->mass *= 1000.0; }),
  };
}

}  // namespace sysid
