#pragma once

#include <algorithm>

#include "models/math/congruence.h"
#include "models/math/rotation.h"
#include "models/workspace.h"

// Definitions of workspace.h; see dynamics-impl.h.

namespace sysid {

template <typename T>
Workspace<T>::Workspace(const Model& model)
    : bodies(model.bodies().size()),
      p_BL(model.mechanism().links.size(), Vector3<T>::Zero()),
      tau(model.nv() + model.followers().size(), T(0.0)),
      nothing(std::max(model.held_size(), model.layout().nz()), T(0.0)),
      model_(&model) {
  if (!model.followers().empty()) {
    y.resize(model.nq() + model.followers().size());
    for (std::vector<T>* all : {&yd, &ydd, &y_tau}) all->resize(tau.size());
  }
  force.resize(model.nv());
  MechanismParameters<T> parameters;
  model.nominal().CastTo(&parameters);
  SetParameters(parameters);
}

template <typename T>
void Workspace<T>::SetParameters(const MechanismParameters<T>& parameters) {
  parameters_ = parameters;
  const Mechanism& mechanism = model_->mechanism();
  for (BodyData<T>& body : bodies) {
    body.mass = T(0.0);
    body.h_B.setZero();
    body.I_B.setZero();
    body.armature = T(0.0);
    body.has_armature = false;
  }
  for (size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Joint& joint = mechanism.joints[i];
    const int parent_link = joint.parent_link;
    const Placement& parent = model_->placement(parent_link);
    const Placement& child = model_->placement(joint.child_link);
    const Vector3<T> p_BJ =
        p_BL[parent_link] +
        internal::Rotate<T>(parent.R_BL, parameters_.joint_p[i]);
    if (joint.type == JointType::kFixed) {
      p_BL[joint.child_link] = p_BJ;
      if (joint.held) {
        p_BL[joint.child_link] +=
            Eigen::Vector3d(parent.R_BL * joint.held->slide).cast<T>();
      }
    } else {
      p_BL[joint.child_link].setZero();
      bodies[child.body].p_PB = p_BJ;
    }
    if (child.body < 0) continue;
    BodyData<T>& body = bodies[child.body];
    const Inertial<T>& link = parameters_.links[joint.child_link];
    const Vector3<T> com_B =
        p_BL[joint.child_link] + internal::Rotate<T>(child.R_BL, link.com);
    const Vector3<T> h = com_B * link.mass;
    body.mass += link.mass;
    body.h_B += h;
    // Parallel axes: - m c x c x = m (|c|^2 - c c^T).
    body.I_B += internal::Congruence<T>(child.R_BL, link.inertia) -
                h * com_B.transpose() + Matrix3<T>::Identity() * h.dot(com_B);
  }
  BindEffects();
}

template <typename T>
void Workspace<T>::BindEffects() {
  effort_effects.clear();
  link_force_effects.clear();
  input_effects.clear();
  delay_effects.clear();
  measurement_effects.clear();
  for (auto* list : {&drive_effects, &limit_effects, &lag_effects,
                     &gravity_effects, &readers, &pair_effects, &state_effects,
                     &motor_effects, &motor_sensor_effects}) {
    list->clear();
  }
  sensors_read_rates = false;
  dry_bodies.clear();
  gravity = Vector3<T>(T(0.0), T(0.0), -parameters_.gravity);
  const EffectSet& effects = model_->effects();
  for (int i = 0; i < effects.size(); ++i) {
    const Effect& effect = effects.effect(i);
    const unsigned hooks = effect.hooks();
    Bound bound{&HooksFor(effect, ScalarTag<T>()),
                parameters_.effects.data() + effects.offset(i),
                -1,
                -1,
                effect.link(),
                (hooks & kDryFrictionHook) != 0,
                (hooks & kBesideDryHook) != 0,
                effect.ReadsMore(),
                model_->held_index(i),
                static_cast<int>(effect.inputs().size()),
                effect.inputs().data(),
                model_->z_index(i),
                static_cast<int>(effect.states().size()),
                (hooks & kMoveStateHook) != 0};
    if (effect.joint() >= 0) {
      const int child = model_->mechanism().joints[effect.joint()].child_link;
      bound.body = model_->placement(child).body;
      if (effect.second_joint() >= 0) {
        const int second =
            model_->mechanism().joints[effect.second_joint()].child_link;
        bound.second_body = model_->placement(second).body;
      }
    } else if (effect.link() >= 0) {
      bound.body = model_->placement(effect.link()).body;
    }
    if (bound.inputs > 0) readers.push_back(bound);
    if (bound.first_z >= 0) state_effects.push_back(bound);
    if (hooks & kDriveHook) {
      drive_effects.push_back(bound);
    } else if (hooks & kEffortHook) {
      effort_effects.push_back(bound);
    }
    if (hooks & kLimitHook) limit_effects.push_back(bound);
    if (hooks & kPairHook) pair_effects.push_back(bound);
    if (hooks & kInputLagHook) lag_effects.push_back(bound);
    if (hooks & kRatesHook) sensors_read_rates = true;
    if (bound.dry &&
        model_->bodies()[bound.body].type != JointType::kSpherical) {
      const int leader = model_->bodies()[bound.body].leader;
      const int mover = leader < 0 ? bound.body : leader;
      if (std::find(dry_bodies.begin(), dry_bodies.end(), mover) ==
          dry_bodies.end()) {
        dry_bodies.push_back(mover);
      }
    }
    // A link that is fixed to the world does not feel a force.
    if ((hooks & kLinkForceHook) && bound.body >= 0) {
      link_force_effects.push_back(bound);
    }
    if (hooks & kInputHook) input_effects.push_back(bound);
    if (hooks & kInputDelayHook) delay_effects.push_back(bound);
    if (hooks & kMeasurementHook) {
      (effect.on_motor() ? motor_sensor_effects : measurement_effects)
          .push_back(bound);
    }
    if (hooks & kMotorHook) motor_effects.push_back(bound);
    if (hooks & kGravityHook) {
      if (bound.inputs > 0) {
        gravity_effects.push_back(bound);
      } else {
        bound.hooks->ModifyGravity(nullptr, bound.p, &gravity);
      }
    }
    if (hooks & kJointInertiaHook) {
      BodyData<T>& body = bodies[bound.body];
      bound.hooks->AddJointInertia(bound.p, &body.armature);
      body.has_armature = true;
    }
  }
  still_gravity = gravity;
  pair_K.assign(pair_effects.size(), std::vector<T>(model_->nv()));
  drive.resize(drive_effects.empty() && limit_effects.empty() ? 0 : tau.size());
}

}  // namespace sysid
