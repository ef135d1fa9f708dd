#pragma once

#include <limits>
#include <string>

#include "models/effects/catalogue.h"

namespace sysid {

// Effects that exist for tests only: one for each hook, whose answers are
// simple enough to predict.

// Adds p to the inertia of a joint.
class TestArmature : public EffectOf<TestArmature> {
 public:
  static constexpr char kName[] = "test_armature";
  static constexpr TargetKind kTarget = TargetKind::kJoint;

  TestArmature(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kJointInertiaHook, mechanism, joint) {
    AddParameter(joint + ".test_armature", "kg m^2", 0.1, 0.0,
                 std::numeric_limits<double>::infinity());
  }

  template <typename T>
  void AddJointInertia(const T* p, T* inertia) const {
    *inertia += p[0];
  }
};

// Adds (p0, p1, p2) to the acceleration of gravity.
class TestGravity : public EffectOf<TestGravity> {
 public:
  static constexpr char kName[] = "test_gravity";
  static constexpr TargetKind kTarget = TargetKind::kBase;

  TestGravity(const Mechanism& mechanism, const std::string& base)
      : EffectOf(kName, kGravityHook, mechanism, base) {
    for (const char* axis : {"x", "y", "z"}) {
      AddParameter(std::string("test_gravity_") + axis, "m/s^2", 1.0, -100.0,
                   100.0);
    }
  }

  template <typename T>
  void ModifyGravity(const T* /*inputs*/, const T* p,
                     Vector3<T>* gravity) const {
    for (int i = 0; i < 3; ++i) (*gravity)[i] += p[i];
  }
};

// p0 v + p1 w + p2 R_WL (1, 2, 3): everything that a link shows to an effect.
class TestLinkForce : public EffectOf<TestLinkForce> {
 public:
  static constexpr char kName[] = "test_link_force";
  static constexpr TargetKind kTarget = TargetKind::kLink;

  TestLinkForce(const Mechanism& mechanism, const std::string& link)
      : EffectOf(kName, kLinkForceHook, mechanism, link) {
    AddParameter(link + ".test_v", "N s/m", 1.0, -100.0, 100.0);
    AddParameter(link + ".test_w", "N s", 1.0, -100.0, 100.0);
    AddParameter(link + ".test_R", "N", 1.0, -100.0, 100.0);
  }

  template <typename T>
  void AddLinkForce(const LinkState<T>& link, const T* p,
                    Vector3<T>* force) const {
    *force += link.v_com * p[0] + link.w * p[1] +
              link.R_WL * Vector3<T>(p[2], p[2] * 2.0, p[2] * 3.0);
  }
};

// tau -> (1 + p0) tau + p1 for every effort of a joint.
class TestInput : public EffectOf<TestInput> {
 public:
  static constexpr char kName[] = "test_input";
  static constexpr TargetKind kTarget = TargetKind::kJoint;

  TestInput(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kInputHook, mechanism, joint),
        nv_(VelocitySize(mechanism.joints[this->joint()].type)) {
    AddParameter(joint + ".test_gain", "-", 1.0, -100.0, 100.0);
    AddParameter(joint + ".test_shift", "N m", 1.0, -100.0, 100.0);
  }

  template <typename T>
  void ModifyInput(const T* p, T* tau) const {
    for (int i = 0; i < nv_; ++i) tau[i] = (p[0] + 1.0) * tau[i] + p[1];
  }

 private:
  int nv_;
};

// q -> (1 + p) q.
class TestMeasurement : public EffectOf<TestMeasurement> {
 public:
  static constexpr char kName[] = "test_measurement";
  static constexpr TargetKind kTarget = TargetKind::kJoint;

  TestMeasurement(const Mechanism& mechanism, const std::string& joint)
      : EffectOf(kName, kMeasurementHook, mechanism, joint) {
    AddParameter(joint + ".test_scale", "-", 1.0, -100.0, 100.0);
  }

  static bool Applies(JointType type) { return type != JointType::kSpherical; }

  template <typename T>
  void ModifyMeasurement(const JointRates<T>&, const T* p, T* q) const {
    q[0] *= p[0] + 1.0;
  }
};

// Every effect of the catalogue, and those above that act in the dynamics.
inline Catalogue WithDynamicsEffects() {
  Catalogue catalogue;
  catalogue.Add<TestArmature>();
  catalogue.Add<TestGravity>();
  catalogue.Add<TestLinkForce>();
  return catalogue;
}

}  // namespace sysid
