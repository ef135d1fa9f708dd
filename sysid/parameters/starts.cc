#include "sysid/parameters/starts.h"

#include <algorithm>
#include <set>

#include "models/dynamics.h"
#include "models/error.h"
#include "models/physical.h"
#include "sysid/io/cell.h"

namespace sysid {
namespace {

Model AtStarts(const Model& model, const std::vector<FreeParameter>& free) {
  std::vector<Parameter> parameters;
  std::vector<double> values;
  for (const FreeParameter& f : free) {
    parameters.push_back(f.parameter);
    values.push_back(f.initial);
  }
  Model start = model;
  SetParameters(parameters, values, &start);
  return start;
}

// The joint that moves a link, itself or by one that follows it; -1: none.
int JointMoving(const Model& model, int link) {
  const int body = model.placement(link).body;
  if (body < 0) return -1;
  const int leader = model.bodies()[body].leader;
  return model.bodies()[leader < 0 ? body : leader].joint;
}

// The joint whose inertia a parameter is when it leaves zero, or -1.
int JointOf(const Model& model, const Parameter& parameter) {
  if (parameter.kind == ParameterKind::kMass) {
    return JointMoving(model, parameter.index);
  }
  if (parameter.kind != ParameterKind::kEffect) return -1;
  for (int i = 0; i < model.effects().size(); ++i) {
    const Effect& effect = model.effects().effect(i);
    const int at = parameter.index - model.effects().offset(i);
    if (at < 0 || at >= static_cast<int>(effect.parameters().size())) continue;
    if (!(effect.hooks() & kJointInertiaHook)) return -1;
    const Joint& joint = model.mechanism().joints[effect.joint()];
    return JointMoving(model, joint.child_link);
  }
  return -1;
}

}  // namespace

void StartPossible(const std::vector<std::string>& names,
                   const std::vector<std::string>& held, Model* model,
                   std::vector<std::string>* notices) {
  std::set<int> links, without_mass;
  MechanismParameters<double> values = model->nominal();
  std::vector<std::string> negative;
  for (const Parameter& parameter : FindParameters(*model, names, "")) {
    if (parameter.kind == ParameterKind::kInertia) {
      links.insert(parameter.index);
    }
    if (parameter.kind == ParameterKind::kMass && parameter.nominal < 0.0) {
      values.links[parameter.index].mass = -parameter.nominal;
      negative.push_back(model->mechanism().links[parameter.index].name);
    }
    if (parameter.kind == ParameterKind::kMass && parameter.nominal == 0.0) {
      without_mass.insert(parameter.index);
    }
  }
  model->SetNominal(values);
  for (const Parameter& parameter : FindParameters(*model, held, "")) {
    if (parameter.kind == ParameterKind::kInertia) {
      links.erase(parameter.index);
    }
  }
  std::vector<std::string> nearest, balls, weightless;
  double farthest = 0.0;
  for (const int link : links) {
    // A body with an inertia of its own has a mass.
    if (without_mass.contains(link)) {
      values.links[link].mass =
          StartingMass(model->mechanism(), model->nominal());
      weightless.push_back(model->mechanism().links[link].name);
    }
    const Eigen::Matrix3d given = values.links[link].inertia;
    if (CanStart(given)) continue;
    const Eigen::Matrix3d start =
        StartingInertia(model->mechanism(), model->nominal(), link);
    values.links[link].inertia = start;
    const std::string& name = model->mechanism().links[link].name;
    if (given.isZero(0)) {
      balls.push_back(name);
    } else {
      nearest.push_back(name);
      farthest = std::max(farthest, (start - given).norm() / given.norm());
    }
  }
  model->SetNominal(values);
  if (!negative.empty()) {
    notices->push_back("the mass of " + Join(negative) +
                       " is free and negative: the fit starts from its size");
  }
  if (!weightless.empty()) {
    notices->push_back("the mass of " + Join(weightless) +
                       " is free and zero: the fit starts from a mean mass, "
                       "unless it is given a start");
  }
  if (!nearest.empty()) {
    notices->push_back("the inertia of " + Join(nearest) +
                       " is free and no body's: the fit starts from the "
                       "nearest possible one, " +
                       (nearest.size() > 1 ? "at most " : "") +
                       Format("%.2g", 100.0 * farthest) + " % away");
  }
  if (!balls.empty()) {
    notices->push_back("the inertia of " + Join(balls) +
                       " is free and zero: the fit starts from that of a solid "
                       "ball which reaches from the centre of mass to the "
                       "joint");
  }
}

Model StartRegular(const Model& model, const std::vector<bool>& given,
                   std::vector<FreeParameter>* free,
                   std::vector<std::string>* notices) {
  std::vector<std::string> moved;
  while (true) {
    Model start = AtStarts(model, *free);
    const size_t before = moved.size();
    for (const SingularJoint& singular : SingularJoints(start)) {
      for (size_t i = 0; i < free->size(); ++i) {
        FreeParameter& f = (*free)[i];
        if (given[i] || f.initial != 0.0) continue;
        if (JointOf(model, f.parameter) != singular.joint) continue;
        const double size =
            f.parameter.kind == ParameterKind::kMass
                ? StartingMass(model.mechanism(), model.nominal())
                : f.parameter.typical_scale;
        f.initial = std::clamp(size, f.lower, f.upper);
        if (f.initial == 0.0) continue;
        moved.push_back(f.parameter.name + " at " + Format("%.3g", f.initial) +
                        " " + f.parameter.unit);
      }
    }
    if (moved.size() > before) continue;
    if (!moved.empty()) {
      notices->push_back("nothing else has inertia there: the fit starts " +
                         Join(moved));
    }
    return start;
  }
}

Model AssumeInertia(const std::vector<FreeParameter>& free, Model* model,
                    std::vector<std::string>* assumed,
                    std::vector<std::string>* notices) {
  const Mechanism& mechanism = model->mechanism();
  MechanismParameters<double> values = model->nominal();
  std::vector<std::string> names;
  for (const SingularJoint& singular : SingularJoints(AtStarts(*model, free))) {
    const int link = mechanism.joints[singular.joint].child_link;
    Inertial<double>& body = values.links[link];
    if (!body.inertia.isZero(0)) continue;
    body.inertia = StartingInertia(mechanism, model->nominal(), link);
    const std::string& name = mechanism.links[link].name;
    if (!(body.mass > 0)) {
      body.mass = StartingMass(mechanism, model->nominal());
      assumed->push_back(name + Format(".mass=%.6g", body.mass));
    }
    for (const char* moment : {".ixx", ".iyy", ".izz"}) {  // of a ball
      assumed->push_back(name + moment + Format("=%.6g", body.inertia(0, 0)));
    }
    names.push_back(name);
  }
  if (!names.empty()) {
    model->SetNominal(values);
    notices->push_back(
        Join(names) +
        (names.size() == 1 ? " has no inertia, and its joint"
                           : " have no inertia, and their joints") +
        " nothing else to move: assumed is that of a solid ball which reaches "
        "from the centre of mass to the joint");
  }
  return AtStarts(*model, free);
}

}  // namespace sysid
