#pragma once

#include <memory>
#include <vector>

#include "models/parameters.h"
#include "models/scalars.h"
#include "residuals/segment_tangent.h"

namespace sysid {

// How a change of a model's parameters acts on a segment: as generalised forces
// between samples, and directly on what is measured.
//
// With the effort u(p) that acts and the inverse dynamics ID of the model, the
// motion satisfies ID(q, qd, qdd; p) = u(p). A change of p leaves
//   f = d [u(p) - ID(q, qd, qdd; p)] / dp                               (7.2)
// unbalanced, which acts as a force beside the model's: masses, frames,
// gravity, friction, gains and delays alike. It is taken halfway between two
// samples and held. Internal states that the segment was computed without are
// carried along it (carried_states.h).
struct ParameterForces {
  // Per interval: nv x columns, N m or N per unit of the parameter.
  std::vector<RowMatrixXd> f;
  // Rows of the segment x columns, SI: offsets of sensors, frames that move.
  RowMatrixXd direct;

  // `columns` of zeros for a segment.
  static ParameterForces Zero(const SegmentRollout& rollout, int columns);
};

namespace internal {
template <typename T>
class Balance;
}

// The derivatives by the parameters of a map, of one segment after the other: a
// column each. Scratch of one thread.
class ForceDerivatives {
 public:
  // Of `model` at `theta`; both it and the map must outlive this. `alone` has
  // for each parameter the hinge or slide whose force and sensors are all that
  // it changes, or -1; those of different joints are then differentiated
  // together (Curtis, Powell and Reid 1974). Empty: all -1.
  ForceDerivatives(const Model& model, const ParameterMap& map,
                   const Eigen::VectorXd& theta,
                   const std::vector<int>& alone = {});
  ~ForceDerivatives();
  // The model is that of the rollout, with more effects, which are off.
  ParameterForces Along(const SegmentRollout& rollout,
                        const SegmentTangent& tangent);
  // To these columns of `out`, which are zero.
  void Write(const SegmentRollout& rollout, const SegmentTangent& tangent,
             const std::vector<int>& columns, ParameterForces* out);

 private:
  std::vector<int> alone_, lanes_;
  // One for as many lanes as a Jet has.
  std::vector<std::unique_ptr<internal::Balance<Jet8>>> passes_;
};

// What a model with more effects, at `to`, has beside one without them, N m or
// N, of one segment after the other. Scratch of one thread.
class ForceDifference {
 public:
  // All must outlive this. `plain` is the rollout's model with the fit's
  // parameters as its nominal ones.
  ForceDifference(const Model& plain, const Model& model,
                  const ParameterMap& map, const Eigen::VectorXd& to);
  ~ForceDifference();
  ParameterForces Along(const SegmentRollout& rollout,
                        const SegmentTangent& tangent);  // one column
  // The same for each of these joints alone, or -1: all of it; to these columns
  // of `out`, which are zero, divided by `per`.
  void Write(const SegmentRollout& rollout, const SegmentTangent& tangent,
             const std::vector<int>& alone, const std::vector<int>& columns,
             const Eigen::VectorXd& per, ParameterForces* out);

 private:
  ParameterMap nothing_;
  std::unique_ptr<internal::Balance<double>> plain_, with_;
};

}  // namespace sysid
