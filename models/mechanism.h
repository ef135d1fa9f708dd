#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "models/math/types.h"

namespace sysid {

// Degrees of freedom of the joints that the toolkit knows. The dynamics do not
// distinguish continuous from revolute: it has no position limits.
enum class JointType { kFixed, kRevolute, kContinuous, kPrismatic, kSpherical };

// Numbers in q (a spherical joint: unit quaternion x, y, z, w as Eigen keeps
// it) and in qd (a spherical joint: angular velocity of the child relative to
// the parent, in the child's axes, rad/s).
int ConfigurationSize(JointType type);
int VelocitySize(JointType type);
bool IsRotation1(JointType type);      // revolute or continuous
std::string ToString(JointType type);  // as URDF says it

struct Link {
  std::string name;
  std::vector<int> child_joints;  // in the order of the file
};

// <mimic> of the URDF: q = multiplier q_joint + offset. A joint with one moves,
// but has no numbers of its own in q and qd.
struct Mimic {
  std::string joint;
  double multiplier = 1.0, offset = 0.0;
};

// What a joint was before it was held still (hold_joints.h).
struct HeldJoint {
  JointType type = JointType::kFixed;
  double position = 0.0;  // rad or m; 0 of a spherical joint, held at identity
  Eigen::Matrix3d R_PJ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d slide = Eigen::Vector3d::Zero();  // of the child, in P, m
};

// Joint i connects links[parent_link] to links[i + 1]; parent_link <= i, so
// walking up the indices visits parents first (Featherstone's numbering).
// Frames: P parent link, J joint (fixed in the parent), C child link (its
// origin is J's; it turns or slides with the joint). R_PJ carries vectors of J
// to P. The origin p_PJ is a parameter and lives in MechanismParameters.
struct Joint {
  std::string name;
  JointType type = JointType::kFixed;
  int parent_link = -1;
  int child_link = -1;
  Eigen::Matrix3d R_PJ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // unit, in J = in C
  double axis_length = 1.0;                         // in the URDF
  int q_index = 0;                                  // first number in q
  int v_index = 0;                                  // first number in qd
  // <dynamics> of the URDF: MakeModel turns what is positive into effects.
  double damping = 0.0;   // N m s/rad or N s/m
  double friction = 0.0;  // N m or N
  // Read from the URDF and written back; the dynamics have no stops.
  bool has_limits = false;
  double lower = 0.0, upper = 0.0, effort_limit = 0.0, velocity_limit = 0.0;
  std::optional<Mimic> mimic;
  // Then the type is kFixed, and R_PJ carries vectors of C to P.
  std::optional<HeldJoint> held;
};

// Numbers of its own in q and in qd: none of a mimic.
int ConfigurationSize(const Joint& joint);
int VelocitySize(const Joint& joint);

// Mass (kg), centre of mass in link axes (m), rotational inertia about the
// centre of mass in link axes (kg m^2).
template <typename T>
struct Inertial {
  T mass = T(0);
  Vector3<T> com = Vector3<T>::Zero();
  Matrix3<T> inertia = Matrix3<T>::Zero();
};

// The values that can be estimated, apart from the topology. `effects` holds
// the effects' parameters, in the order of EffectSet::parameters().
template <typename T>
struct MechanismParameters {
  std::vector<Inertial<T>> links;   // per link; the root's has no influence
  std::vector<Vector3<T>> joint_p;  // per joint: p_PJ, m
  T gravity = T(9.81);              // m/s^2, along -z of the world
  std::vector<T> effects;

  // The same values as constants of another scalar.
  template <typename U>
  void CastTo(MechanismParameters<U>* out) const {
    out->links.resize(links.size());
    for (size_t i = 0; i < links.size(); ++i) {
      out->links[i] = {U(links[i].mass), links[i].com.template cast<U>(),
                       links[i].inertia.template cast<U>()};
    }
    out->joint_p.resize(joint_p.size());
    for (size_t i = 0; i < joint_p.size(); ++i) {
      out->joint_p[i] = joint_p[i].template cast<U>();
    }
    out->gravity = U(gravity);
    out->effects.resize(effects.size());
    for (size_t i = 0; i < effects.size(); ++i) out->effects[i] = U(effects[i]);
  }
};

// A tree of links on a root that is fixed in the world (the root link's frame
// is the world's, z up). Const once loaded.
struct Mechanism {
  std::string name;
  std::vector<Link> links;    // links[0] is the root
  std::vector<Joint> joints;  // joints[i] carries links[i + 1]
  int nq = 0;
  int nv = 0;
  MechanismParameters<double> nominal;  // without effects
  // The URDF that it was read from, as it stands: what is written of it keeps
  // what the dynamics do not use. None of a mechanism that was made in code.
  std::shared_ptr<const std::string> source;

  // Names of what a recording has beside our columns, for effects that read it:
  // what the user says that there is.
  std::vector<std::string> inputs;

  // Index, or -1.
  int FindLink(const std::string& link_name) const;
  int FindJoint(const std::string& joint_name) const;

  // A joint's place and names, for adding joints in code: tests, examples and
  // the loader all build through this. Links are named by the caller; the
  // parent must exist. Sets indices and sizes. Returns the joint's index.
  int AddRoot(const std::string& link_name);
  int AddJoint(const Joint& joint, const std::string& child_link_name,
               const Eigen::Vector3d& p_PJ, const Inertial<double>& child);

  // The nominal configuration: zeros, and the identity for quaternions.
  Eigen::VectorXd NeutralConfiguration() const;
  std::vector<std::string> JointNames() const;  // with numbers of their own
  std::vector<std::string> LinkNames() const;
};

// The joint without a <mimic> that a joint follows in the end, with the
// multipliers and offsets between them made one: q = multiplier q_joint +
// offset, (2.26). Of one without a <mimic>: itself.
struct Followed {
  int joint = -1;
  double multiplier = 1.0, offset = 0.0;
};
Followed FollowedBy(const Mechanism& mechanism, int joint);

// The unit vector that stands for a link in a heading (see residuals/): from
// its joint to its first child joint, else to its centre of mass, in link axes;
// z where both are at the joint.
Eigen::Vector3d LinkAxis(const Mechanism& mechanism, int link);

// <link>.length (docs/interface.md section 3), m; 0 where it is undefined (the
// link has neither a child joint nor a centre of mass away from its joint).
double LinkLength(const Mechanism& mechanism,
                  const MechanismParameters<double>& parameters, int link);

// Half the trace minus the inertia: the second moments of the mass about its
// centre; positive semidefinite for every real body.
template <typename T>
Matrix3<T> SecondMoments(const Matrix3<T>& inertia) {
  return Matrix3<T>::Identity() * (inertia.trace() * T(0.5)) - inertia;
}

}  // namespace sysid
