#pragma once

#include <optional>
#include <vector>

#include "models/step_tangent.h"
#include "residuals/segment-impl.h"

// The structured path of segment.h and segment_tangent.h; included only by
// their .cc files.

namespace sysid::internal {

// Which columns a Jacobian has, in this order.
struct ColumnLayout {
  bool state = false;    // by the tangent of the first state
  bool theta = false;    // by the parameters of the map
  bool efforts = false;  // by generalised forces beside the drives': nv
  bool operator==(const ColumnLayout&) const = default;
};

// Eight columns: how the physics moves with them, and the sensors.
class ColumnBlock {
 public:
  // Columns `first` and following.
  ColumnBlock(const Model& model, const ParameterMap& map,
              const ColumnLayout& layout, int first);

  // As StructuredWalk's.
  void SetTheta(const double* theta);
  void Start(const SegmentRollout& rollout);
  void SeedState(const double* x);
  void Measure(int k, const double* x);
  // What acts in the step from t to t + h.
  void SetHeld(const Run& run, int sample, double t, double h);

  double Error(int e) const { return errors_[e].a; }
  void ReadError(int e, RowMatrixXd* J) const;
  void ReadState(const double* x, RowMatrixXd* J) const;
  StateColumns& columns() { return columns_; }

 private:
  const Model& model_;
  const ParameterMap& map_;
  ColumnLayout layout_;
  int first_;
  int count_;  // of columns, at most eight
  Workspace<Jet8> ws_;
  StateColumns columns_;
  bool moves_held_ = false;  // some column is a gain's or a delay's
  std::optional<Sensors<Jet8>> sensors_;
  std::vector<Jet8> theta_, x_, held_, errors_;
};

// SegmentWalk with columns of a Jacobian beside the state, each carried by the
// tangent of the steps: scratch of one thread, for segments of one model.
class StructuredWalk {
 public:
  // The model and the map must outlive it.
  StructuredWalk(const Model& model, const ParameterMap& map,
                 Integrator integrator, const ColumnLayout& layout);

  void SetTheta(const double* theta);
  void Start(const SegmentRollout& rollout);
  // The columns become those of a start at x: (3.1) at dx = 0.
  void SeedState(const double* x);
  // What the sensors say at sample k, the next of the segment, of the state x.
  void Measure(int k, const double* x);
  // Takes x and the columns from sample k to the next, and the state after half
  // of the steps to `middle` where it is given and their number is even. False
  // where the dynamics fail.
  bool Advance(int k, double* x, double* middle = nullptr);

  // The errors measured so far, and their derivatives by the columns as they
  // were then.
  void ReadErrors(double* errors, RowMatrixXd* J) const;
  // The derivatives of the tangent (3.2) at the state x.
  void ReadState(const double* x, RowMatrixXd* J) const;

 private:
  const ParameterMap& map_;
  const SegmentRollout* rollout_ = nullptr;
  Workspace<double> ws_;
  StepTangent stepper_;
  std::vector<ColumnBlock> blocks_;
  std::vector<StateColumns*> columns_;
  std::vector<double> held_;
};

}  // namespace sysid::internal
