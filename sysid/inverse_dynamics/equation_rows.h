#pragma once

#include <functional>
#include <vector>

#include "models/model.h"
#include "models/scalars.h"
#include "residuals/run.h"
#include "sysid/inverse_dynamics/motion.h"

namespace sysid {

// How far the efforts of a recording are from those that its motion needs: the
// error of the equations of motion,
//
//   r(t) = g * [u(t) - ID(q, qd, qdd)],                                (11.2)
//
// u the efforts that act, ID the inverse dynamics at the motion of motion.h, g
// a Gaussian of the same kind as theirs, over efforts and equations alike, so
// that both lag and lose the same.

using MatrixXb = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic>;

// Standard deviations, s.
struct EquationFilter {
  double motion = 0.0;   // of the fit of the motion
  double average = 0.0;  // of g
};

// How far g reaches to either side, s.
double ReachOf(const EquationFilter& filter);
// Where g has fallen by 3 dB: sqrt(ln 2) / (2 pi width), Hz.
double CutOff(double width);

// A run on even times, a third of a width of g apart: what (11.2) takes from
// the recording alone, whatever the model's values.
struct SampledMotion {
  double step = 0.0;  // s
  double bend = 0.0;  // EquationFilter::motion, s
  Run run;            // the efforts of each interval around a time
  std::vector<MotionSample> motion;
  // Of each joint (nv), rad/s or m/s: at a lower speed its direction is not
  // known, (11.13); 0 where it has no dry friction.
  Eigen::VectorXd slowest;
  int size() const { return static_cast<int>(motion.size()); }
};

// Times of one range of work for a thread: many beside the 18 steps of the
// reach of g, which two neighbouring ranges both evaluate, and few beside a
// run.
inline constexpr int kTimesOfRange = 256;

// Of the part [from, to], s, of a run that measures all joints.
SampledMotion SampleMotion(const Model& model, const Run& run, double from,
                           double to, const EquationFilter& filter,
                           int threads = 1);
SampledMotion SampleMotion(const Model& model, const Run& run,
                           const EquationFilter& filter, int threads = 1);

// A model whose numbers `begin`, begin + 1, ... are variables 0, 1, ... of the
// Jets, as many as they have.
template <typename T>
using Seeding = std::function<void(int begin, MechanismParameters<T>*)>;

// (11.2) and its derivatives at even times, one width of g apart: between them
// it leaves nothing of its own. Times without measurements around are left out.
// Of undriven joints (11.10) in its place.
struct EquationRows {
  int nv = 0;
  std::vector<double> t;  // s
  // (times x nv) x (columns + 1): [dr | r], N m or N; rad/s^2 or m/s^2 of
  // undriven joints.
  RowMatrixXd rows;
  RowMatrixXd effort;   // times x nv: g * u
  RowMatrixXd qd, qdd;  // times x nv
  // times x nv: true where a joint with dry friction may rest within reach of g
  // and of the fit of the motion. What holds it then no law says.
  MatrixXb rests;
  double work = 0.0;  // evaluations of the inverse dynamics, by Jets

  int times() const { return static_cast<int>(t.size()); }
};

// What of the equations needs no Jets.
struct PlainPart {
  MechanismParameters<double> values;  // where the Jets are seeded
  // Columns that come first where there are any: of each of these links the ten
  // of (2.29), by (2.30) where the model has them so.
  std::vector<int> links;
  // Joints (of nv) of whose equations the acceleration is the unknown: no
  // effort of theirs was measured. With u of them, M_uu their inertia and r_u
  // of (11.2),
  //
  //   e_u = M_uu^-1 r_u,   de_u = M_uu^-1 dr_u at qdd_u + e_u,         (11.10)
  //
  // by how much the acceleration that the model gives them, with the others
  // moving as they did, exceeds that which they had.
  std::vector<int> undriven;
};

// For T = double (no columns), Jet8 (few) or Jet24.
template <typename T>
EquationRows MakeEquationRows(const Model& model, const SampledMotion& sampled,
                              int columns, const Seeding<T>& seeding,
                              const PlainPart& plain = {}, int threads = 1);

// The speeds of (11.13) with the dry friction of another model, too.
void ReadDryFriction(const Model& model, SampledMotion* sampled);

// Without derivatives.
EquationRows EvaluateEquations(const Model& model, const SampledMotion& sampled,
                               const MechanismParameters<double>& values,
                               const std::vector<int>& undriven = {},
                               int threads = 1);

}  // namespace sysid
