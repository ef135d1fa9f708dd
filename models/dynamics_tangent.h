#pragma once

#include <vector>

#include "models/dynamics.h"
#include "models/math/lanes.h"

namespace sysid {

// How eight columns move what a rollout takes from the parameters: the Jets of
// a Workspace<Jet8>, each body's apart. Nothing that stays is carried.
struct ParameterColumns {
  // Nothing moves.
  explicit ParameterColumns(const Model& model);
  explicit ParameterColumns(const Workspace<Jet8>& ws);

  struct OfBody {
    bool inertial = false, origin = false, armature = false;  // what moves
    Lanes mass;
    Lanes3 h_B;
    Lanes3 I_B[3];  // columns
    Lanes3 p_PB;
    Lanes J_a;
  };
  struct OfNumber {
    bool moves = false;
    Lanes d;
  };
  std::vector<OfBody> bodies;
  bool gravity_moves = false;
  Lanes3 gravity;
  std::vector<OfNumber> effects;  // as EffectSet::parameters()
  std::vector<Lanes3> force_com;  // com_B of link_force_effects' links
};

// The tangent of forward dynamics: by how much qdd moves with q, qd, what is
// held and the parameters, for any number of columns of those. The articulated
// inertias of the evaluation are used again, so that a column costs three walks
// over the bodies, linear ones:
//
//   d qdd = M^-1 (d tau - d ID(q, qd, qdd; theta), qdd held)           (2.17)
//
// docs/theory.md section 2 derives the walks. A change of a spherical joint's q
// is a rotation vector in the child's axes; all others are plain.
class DynamicsTangent {
 public:
  explicit DynamicsTangent(const Model& model);

  // Whether no joint of a model follows another, and its effects act through
  // hooks whose tangent is here.
  static bool Covers(const Model& model);

  // The evaluation whose tangent is asked for: right after
  // ForwardDynamics<double>(ws, q, qd, held, qdd).
  void SetPoint(const Workspace<double>& ws, const double* q, const double* qd,
                const double* qdd);

  // By how much eight columns move what qdd depends on: nv lanes each of dq and
  // dqd, held_size of dheld, or null where what is held stays, nz of dz, and nv
  // of efforts beside these (Workspace::beside), or null where there are none.
  struct Moved {
    const Lanes *dq, *dqd, *dheld, *dz;
    const Lanes* dbeside = nullptr;
  };
  // Eight columns: nv lanes out.
  void Columns(const ParameterColumns& theta, const Moved& by, Lanes* dqdd);
  // Then those of the rates of z, nz lanes; zero for what has none (StateRate).
  void RateColumns(const ParameterColumns& theta, const Moved& by,
                   Lanes* rate) const;

 private:
  // Numbers of the evaluation, apart from what the workspace holds.
  struct BodyPoint {
    Eigen::Vector3d spin;  // of a slide: its velocity
    Eigen::Matrix3d V_r;   // (2.20) of w_P and r
    // Of one degree of freedom: what multiplies dq and dqd.
    Eigen::Vector3d w_q, alpha_q, a_q, a_qd, n_q, f_q;
    Eigen::Vector3d DU_n, DU_f;
    Eigen::Matrix3d V_I, V_h;  // what multiplies d'w in (2.21)
    Eigen::Vector3d n, f;      // what the joint transmits
    Eigen::Vector3d qdd_W;     // world axes; of one degree of freedom qdd_W[0]
    Eigen::Matrix3d DI;        // D^-1 I of a spherical joint with armature
    // Derivatives of the effects' efforts; of a spherical joint in world axes,
    // else the first number.
    bool has_effort = false;
    Eigen::Matrix3d tau_q, tau_qd;
  };
  // Columns of one body.
  struct BodyLanes {
    Lanes3 psi, s;       // of a spherical joint: R_WB dq, R_WB dqd
    Lanes3 w, alpha, a;  // first with qdd held, then what qdd does
    Lanes3 n, f;
    Lanes3 tau, x;  // efforts, D^-1 u; of one degree of freedom in .x
    Lanes3 phi, v;  // where forces act on links
  };
  // A law of an effect, with its derivatives at the point.
  struct Law {
    const EffectHooks<Jet8>* hooks;
    int body;
    int link;
    int first;    // of its parameters
    bool dry;     // kDryFrictionHook
    bool beside;  // kBesideDryHook
    std::vector<Jet8> p;
    std::vector<Eigen::Vector3d> by_p;  // world axes
    // Of a force on a link.
    Eigen::Vector3d arm, force;
    Eigen::Matrix3d by_w, by_v, by_phi;
  };
  // What a law of a hinge or slide reads, beside its parameters, or the law of
  // gravity; and by how much it moves with it.
  struct Argument {
    enum class Of { kQ, kQd, kHeld, kEffort, kZ } of;
    int place;  // in q, in qd, in what is held or in z
    int v;      // in dq or dqd; in what is held or in dz
    double by[3] = {0.0, 0.0, 0.0};
  };
  // A law that reads more than its joint (Effect::ReadsMore), of a pair of
  // joints, or the rate of an effect's internal state.
  struct WideLaw {
    enum class Of { kDrive, kLimit, kJoint, kPair, kGravity, kRate } of;
    Law law;
    int v = -1;         // of its joint; -1 of gravity
    int v_second = -1;  // of a pair's second joint
    int rows = 1;       // numbers that come out
    int first_held = 0, first_z = 0;
    std::vector<Argument> arguments;
    std::vector<Jet8> q, qd, held, z;  // scratch
  };
  // (2.35) at the point.
  struct Pair {
    int a, b;
    double ratio;
    const double* K;
  };

  void SetBody(int i, const double* qd, const double* qdd);
  void DifferentiateEffort(const double* q, const double* qd, Law* law);
  void DifferentiateLinkForce(Law* law);
  void AddWideLaw(int effect, const Law& law, bool rate = false);
  void DifferentiateWide(const double* q, const double* qd, const double* qdd,
                         WideLaw* wide);
  // How a wide law moves.
  Lanes WideColumn(const WideLaw& wide, const ParameterColumns& theta,
                   const Moved& by, int row) const;
  void WideColumns(const ParameterColumns& theta, const Moved& by);
  void MoveColumns(const ParameterColumns& theta, const Moved& by);
  void ForceColumns(const ParameterColumns& theta);
  void LinkForceColumns(const ParameterColumns& theta, const Lanes* dq,
                        const Lanes* dqd);
  void EffortColumns(const ParameterColumns& theta, const Moved& by);
  void ArticulateColumns(const ParameterColumns& theta, const Lanes* dq);
  void AccelerateColumns(Lanes* dqdd);

  const Model* model_;
  const Workspace<double>* ws_ = nullptr;
  std::vector<BodyPoint> points_;
  std::vector<BodyLanes> lanes_;
  std::vector<Law> efforts_, link_forces_;
  // In the order of (2.32).
  std::vector<WideLaw> wide_;
  std::vector<Pair> pairs_;
  bool moves_gravity_ = false;                   // some wide law does
  std::vector<double> drive_;                    // what the drives give so far
  std::vector<Lanes> drive_lanes_, wide_lanes_;  // nv each
};

}  // namespace sysid
