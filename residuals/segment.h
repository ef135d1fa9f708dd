#pragma once

#include <memory>
#include <string>
#include <vector>

#include "models/integrator.h"
#include "models/parameters.h"
#include "residuals/channel_residual.h"
#include "residuals/run.h"

namespace sysid {

// How a segment is differentiated; both give the same numbers to rounding.
enum class LinearizationPath {
  // The tangent of each step beside the step (models/step_tangent.h).
  kStructured,
  // Every step on Jets: several times slower; the reference, and the way for a
  // model with effects that the tangent does not cover.
  kJets,
};
std::string ToString(LinearizationPath path);  // "structured", "jets"

// How the time between samples is integrated, and differentiated.
struct RolloutOptions {
  Integrator integrator = Integrator::kRungeKutta4;
  // Longest step, s; the time between two samples is divided evenly into as few
  // steps as this allows. 0: one step a sample.
  double step = 0.0;
  // What is wanted; PathOf() says what runs.
  LinearizationPath linearization = LinearizationPath::kStructured;
  // Whether a chosen step may be one of another integrator (ChooseRollout).
  bool may_change = true;

  bool operator==(const RolloutOptions&) const = default;
};

// How segments of a model are differentiated with these options.
LinearizationPath PathOf(const Model& model, const RolloutOptions& options);

// A run with what compares the model with it: shared by its segments.
struct Measurements {
  const Run* run;
  std::vector<ChannelResidual> residuals;  // per channel of the run
};

// The rows that come from one sample of one channel.
struct SegmentRow {
  int sample;
  int channel;
  int first;  // row
  int size;
};

// What linearising a segment leaves for the next one on the structured path, by
// the same thread: memory, and what depends on theta alone (computed again when
// theta is another). For segments of one model and map, which must outlive it
// and stay as they are.
class SegmentScratch {
 public:
  SegmentScratch();
  ~SegmentScratch();
  SegmentScratch(SegmentScratch&&) noexcept;
  SegmentScratch& operator=(SegmentScratch&&) noexcept;

 private:
  friend class SegmentRollout;
  struct Kept;
  std::unique_ptr<Kept> kept_;
};

// The functor of multiple shooting: rolls the model out from the state x0 at
// sample `first` to sample `last`, and says by how much it misses what was
// measured at the samples [first, last) (at `last` too where it ends the run).
// Missing measurements have no row. Everything SI; weights come later.
//
//   x_{k+1} = Step(x_k, tau_k, theta),  r_k = h(x_k, theta) - y_k       (5.1)
class SegmentRollout {
 public:
  // The pointers must outlive the functor.
  SegmentRollout(const Model* model, const ParameterMap* parameters,
                 const Measurements* measurements, int first, int last,
                 const RolloutOptions& options);

  // x0: state_size numbers; theta: parameters.size(). Writes num_residuals()
  // errors and the state at `last`; with `states` also the state at each sample
  // of [first, last]. False where the dynamics fail. Instantiated for the
  // scalars of models/scalars.h.
  template <typename T>
  bool operator()(const T* x0, const T* theta, T* errors, T* x_end,
                  std::vector<T>* states = nullptr) const;

  // Values and derivatives by the tangent of x0 (tangent_size columns), then by
  // theta (where with_theta): rows of errors in J, rows of x_end's tangent in
  // J_end.
  bool Linearize(const double* x0, const double* theta, bool with_theta,
                 double* errors, double* x_end, RowMatrixXd* J,
                 RowMatrixXd* J_end, SegmentScratch* scratch = nullptr) const {
    return LinearizeBy(true, with_theta, x0, theta, errors, x_end, J, J_end,
                       scratch);
  }
  // The same by theta alone.
  bool LinearizeByTheta(const double* x0, const double* theta, double* errors,
                        double* x_end, RowMatrixXd* J, RowMatrixXd* J_end,
                        SegmentScratch* scratch = nullptr) const {
    return LinearizeBy(false, true, x0, theta, errors, x_end, J, J_end,
                       scratch);
  }

  LinearizationPath linearization() const { return linearization_; }

  const Model& model() const { return *model_; }
  const ParameterMap& parameters() const { return *parameters_; }
  const Measurements& measurements() const { return *measurements_; }
  const RolloutOptions& options() const { return options_; }
  bool needs_kinematics() const { return needs_kinematics_; }
  bool needs_motors() const { return needs_motors_; }
  // Steps from sample k to the next.
  int StepsAfter(int k) const;
  int first() const { return first_; }
  int last() const { return last_; }
  int num_residuals() const { return num_residuals_; }
  const std::vector<SegmentRow>& rows() const { return rows_; }

 private:
  bool LinearizeBy(bool by_state, bool by_theta, const double* x0,
                   const double* theta, double* errors, double* x_end,
                   RowMatrixXd* J, RowMatrixXd* J_end,
                   SegmentScratch* scratch) const;
  bool LinearizeStructured(const double* x0, const double* theta, bool by_state,
                           bool by_theta, double* errors, double* x_end,
                           RowMatrixXd* J, RowMatrixXd* J_end,
                           SegmentScratch* scratch) const;
  const Model* model_;
  const ParameterMap* parameters_;
  const Measurements* measurements_;
  int first_;
  int last_;
  RolloutOptions options_;
  LinearizationPath linearization_;
  int num_residuals_ = 0;
  std::vector<SegmentRow> rows_;
  bool needs_kinematics_ = false;  // some channel is a frame's position
  bool needs_motors_ = false;      // some channel is a motor's
};

}  // namespace sysid
