#pragma once

#include <memory>
#include <string>
#include <vector>

#include "models/effects/catalogue.h"
#include "models/mechanism.h"
#include "models/state_layout.h"

namespace sysid {

// What moves as one: a link behind a moving joint with all that is fixed to it.
// The body's frame B is the frame of that link. Bodies are numbered with
// parents first; -1 is the world.
struct Body {
  int parent = -1;
  int joint = -1;
  JointType type = JointType::kFixed;
  int q_index = 0;
  int v_index = 0;
  // A follower (of a <mimic>): the body whose coordinate it follows, else -1.
  // Its indices are behind those of the state: (2.25).
  int leader = -1;
  double multiplier = 1.0, offset = 0.0;
  Eigen::Vector3d axis;  // unit, in J and in B
  int along = -1;        // axis = unit vector 0, 1 or 2; -1: none of them
  // From the joint's frame J to the parent body's axes; `turned` where it is
  // not the identity.
  Eigen::Matrix3d R_PJ;
  bool turned = false;
};

// Numbers of its own in qd: none of a follower.
int VelocitySize(const Body& body);

// Where a link is: rigidly on a body (-1: on the world).
struct Placement {
  int body = -1;
  Eigen::Matrix3d R_BL = Eigen::Matrix3d::Identity();
};

// A mechanism, the effects in it, and nominal values for both: all that the
// dynamics need, const while they run.
class Model {
 public:
  explicit Model(Mechanism mechanism);

  // The effect's parameters start at null. One that has all the parameters of
  // another that is there and more takes its place, with its values: Stribeck
  // friction for Coulomb's. Throws InputError at `place` where the effect is
  // there already, or shares parameters with one whose place it cannot take.
  void AddEffect(std::shared_ptr<const Effect> effect,
                 const std::string& place = "model");
  // Sets the nominal value of a parameter of an effect; CHECKs the name.
  void SetEffectParameter(const std::string& name, double value);

  const Mechanism& mechanism() const { return mechanism_; }
  const EffectSet& effects() const { return effects_; }
  const MechanismParameters<double>& nominal() const { return nominal_; }
  // Replaces nominal values: a fitted model, or a changed one to simulate.
  void SetNominal(const MechanismParameters<double>& nominal);

  const std::vector<Body>& bodies() const { return bodies_; }
  // Those with numbers of their own in q and qd: all but the followers.
  const std::vector<Body>& movers() const { return movers_; }
  const std::vector<Body>& followers() const { return followers_; }
  const Placement& placement(int link) const { return placements_[link]; }
  const StateLayout& layout() const { return layout_; }
  int nq() const { return layout_.nq(); }
  int nv() const { return layout_.nv(); }
  int state_size() const { return layout_.size(); }
  int tangent_size() const { return layout_.tangent_size(); }
  // Of what is held over a step (docs/decisions/0018-held-inputs.md): the
  // efforts, nv numbers, then the inputs of each effect, in their order.
  int held_size() const { return nv() + effects_.input_count(); }
  int held_index(int effect) const {
    return nv() + effects_.first_input(effect);
  }
  // Where the states of an effect begin in z; -1: it has none.
  int z_index(int effect) const {
    return effects_.effect(effect).states().empty()
               ? -1
               : effects_.first_state(effect);
  }

 private:
  void SetFollower(Body* body) const;

  Mechanism mechanism_;
  StateLayout layout_;
  EffectSet effects_;
  MechanismParameters<double> nominal_;
  std::vector<Body> bodies_, movers_, followers_;
  std::vector<Placement> placements_;
};

// The mechanism with the damping and friction of its URDF's <dynamics> as
// effects at those values (docs/interface.md section 5 names them).
Model MakeModel(const Mechanism& mechanism, const Catalogue& catalogue);

}  // namespace sysid
