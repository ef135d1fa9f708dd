#include "models/model.h"

#include "glog/logging.h"

namespace sysid {

Model::Model(Mechanism mechanism)
    : mechanism_(std::move(mechanism)), nominal_(mechanism_.nominal) {
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
}

void Model::AddEffect(std::shared_ptr<const Effect> effect) {
  effects_.Add(effect);
  for (const EffectParameter& parameter : effect->parameters()) {
    nominal_.effects.push_back(parameter.null_value);
  }
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
    if (joint.damping != 0.0) {
      model.AddEffect(catalogue.Make("viscous_damping@" + joint.name, mechanism,
                                     "<dynamics>"));
      model.SetEffectParameter(joint.name + ".damping", joint.damping);
    }
    if (joint.friction != 0.0) {
      model.AddEffect(catalogue.Make("coulomb_friction@" + joint.name,
                                     mechanism, "<dynamics>"));
      model.SetEffectParameter(joint.name + ".friction", joint.friction);
    }
  }
  return model;
}

}  // namespace sysid
