#include "models/model.h"

#include <algorithm>
#include <map>
#include <set>

#include "glog/logging.h"
#include "models/error.h"
#include "models/parameters.h"

namespace sysid {

int VelocitySize(const Body& body) {
  return body.leader < 0 ? VelocitySize(body.type) : 0;
}

Model::Model(Mechanism mechanism)
    : mechanism_(std::move(mechanism)),
      layout_(mechanism_),
      nominal_(mechanism_.nominal) {
  placements_.resize(mechanism_.links.size());
  for (size_t i = 0; i < mechanism_.joints.size(); ++i) {
    const Joint& joint = mechanism_.joints[i];
    const Placement& parent = placements_[joint.parent_link];
    const Eigen::Matrix3d R = parent.R_BL * joint.R_PJ;
    Placement& child = placements_[joint.child_link];
    if (joint.type == JointType::kFixed) {
      child.body = parent.body;
      child.R_BL = R;
      continue;
    }
    child.body = static_cast<int>(bodies_.size());
    Body body;
    body.parent = parent.body;
    body.joint = static_cast<int>(i);
    body.type = joint.type;
    body.q_index = joint.q_index;
    body.v_index = joint.v_index;
    body.axis = joint.axis;
    for (int k = 0; k < 3; ++k) {
      if (body.axis == Eigen::Vector3d::Unit(k)) body.along = k;
    }
    body.R_PJ = R;
    body.turned = R != Eigen::Matrix3d::Identity();
    bodies_.push_back(body);
  }
  for (Body& body : bodies_) {
    if (mechanism_.joints[body.joint].mimic) {
      SetFollower(&body);
      followers_.push_back(body);
    } else {
      movers_.push_back(body);
    }
  }
}

void Model::SetFollower(Body* body) const {
  const Followed followed = FollowedBy(mechanism_, body->joint);
  const Joint& leader = mechanism_.joints[followed.joint];
  CHECK_EQ(VelocitySize(leader), 1)
      << mechanism_.joints[body->joint].name << " follows " << leader.name
      << ", which is " << ToString(leader.type);
  body->leader = placements_[leader.child_link].body;
  body->multiplier = followed.multiplier;
  body->offset = followed.offset;
  const int place = static_cast<int>(followers_.size());
  body->q_index = mechanism_.nq + place;
  body->v_index = mechanism_.nv + place;
}

namespace {

// That a law's parameters, joint1.x, are not the mechanism's.
void RefuseNamesOfMechanism(const Model& model,
                            const std::set<std::string>& names,
                            const Effect& effect, const std::string& place) {
  for (const Parameter& parameter : AllParameters(model)) {
    if (parameter.kind == ParameterKind::kEffect ||
        !names.contains(parameter.name)) {
      continue;
    }
    throw InputError(place,
                     effect.name() + ": " + parameter.name +
                         " is a parameter of the mechanism already",
                     "call it otherwise, such as " +
                         parameter.name.substr(parameter.name.rfind('.') + 1) +
                         "1");
  }
}

}  // namespace

void Model::AddEffect(std::shared_ptr<const Effect> effect,
                      const std::string& place) {
  if (effects_.Contains(effect->name())) {
    throw InputError(place, effect->name() + " is in the model already",
                     "name each effect once");
  }
  std::set<std::string> own;
  for (const EffectParameter& p : effect->parameters()) own.insert(p.name);
  if (effect->IsTyped()) RefuseNamesOfMechanism(*this, own, *effect, place);
  EffectSet kept;
  std::vector<double> values;
  std::map<std::string, double> taken;  // values of the effects it replaces
  for (int i = 0; i < effects_.size(); ++i) {
    const std::vector<EffectParameter>& others =
        effects_.effect(i).parameters();
    const double* others_values = nominal_.effects.data() + effects_.offset(i);
    const size_t shared =
        std::count_if(others.begin(), others.end(),
                      [&](const auto& p) { return own.contains(p.name); });
    if (shared == 0) {
      kept.Add(effects_.shared(i));
      values.insert(values.end(), others_values, others_values + others.size());
      continue;
    }
    if (shared < others.size() || own.size() == others.size() ||
        effect->IsTyped() || effects_.effect(i).IsTyped()) {
      throw InputError(place,
                       effect->name() + " shares parameters with " +
                           effects_.effect(i).name() +
                           ", which is in the model already",
                       "leave one of them out");
    }
    for (size_t k = 0; k < others.size(); ++k) {
      taken[others[k].name] = others_values[k];
    }
  }
  std::vector<double> own_values;
  for (const EffectParameter& parameter : effect->parameters()) {
    const auto at = taken.find(parameter.name);
    own_values.push_back(at == taken.end() ? parameter.null_value : at->second);
  }
  if (!taken.empty()) effect->Subsume(&own_values);
  values.insert(values.end(), own_values.begin(), own_values.end());
  kept.Add(std::move(effect));
  effects_ = std::move(kept);
  layout_ = StateLayout(mechanism_, effects_.state_count());
  nominal_.effects = std::move(values);
}

void Model::SetEffectParameter(const std::string& name, double value) {
  for (size_t i = 0; i < effects_.parameters().size(); ++i) {
    if (effects_.parameters()[i].name == name) {
      nominal_.effects[i] = value;
      return;
    }
  }
  LOG(FATAL) << "no effect has a parameter " << name;
}

void Model::SetNominal(const MechanismParameters<double>& nominal) {
  CHECK_EQ(nominal.links.size(), nominal_.links.size());
  CHECK_EQ(nominal.effects.size(), nominal_.effects.size());
  nominal_ = nominal;
}

Model MakeModel(const Mechanism& mechanism, const Catalogue& catalogue) {
  Model model(mechanism);
  for (const Joint& joint : mechanism.joints) {
    if (joint.held) continue;
    const auto add = [&](const std::string& effect,
                         const std::string& parameter, double value) {
      if (value <= 0.0) return;
      model.AddEffect(
          catalogue.Make(effect + "@" + joint.name, mechanism, "<dynamics>"));
      model.SetEffectParameter(joint.name + "." + parameter, value);
    };
    add("viscous_damping", "damping", joint.damping);
    add("coulomb_friction", "friction", joint.friction);
  }
  return model;
}

}  // namespace sysid
