#pragma once

#include <algorithm>
#include <cmath>
#include <variant>

#include "models/state.h"
#include "models/stepper.h"
#include "residuals/acting_inputs.h"
#include "residuals/segment.h"
#include "residuals/sensed_positions.h"

// Definition of SegmentRollout's templates; included only where they are
// instantiated (segment.cc).

namespace sysid {
namespace internal {

// Calls pass(ScalarTag of a Jet, first, columns) for `total` columns, in passes
// of Jets of 24, 16 or 8; once at least. False after the first that is.
template <typename Pass>
bool ForEachPass(int total, const Pass& pass) {
  int first = 0;
  do {
    const int left = total - first;
    const int columns = std::min(left, 24);
    const bool ok = left > 16  ? pass(ScalarTag<Jet24>(), first, columns)
                    : left > 8 ? pass(ScalarTag<Jet16>(), first, columns)
                               : pass(ScalarTag<Jet8>(), first, columns);
    if (!ok) return false;
    first += columns;
  } while (first < total);
  return true;
}

// What the sensors of a segment would say of states, in the order of time.
template <typename T>
class Sensors {
 public:
  Sensors(const SegmentRollout& rollout, Workspace<T>* ws)
      : rollout_(rollout), ws_(ws), seen_(rollout.options().integrator, ws) {}

  // The errors at sample k, the next, with the state x.
  void Measure(int k, const T* x, T* errors) {
    const std::vector<SegmentRow>& rows = rollout_.rows();
    if (row_ >= rows.size() || rows[row_].sample != k) return;
    const Model& model = ws_->model();
    const Run& run = *rollout_.measurements().run;
    const T* seen = seen_(run, k, x);
    const T* q = x + model.layout().q();
    if (rollout_.needs_kinematics()) ForwardKinematics<T>(ws_, q);
    const T* motors = rollout_.needs_motors() ? seen_.OfMotors(x) : nullptr;
    const PredictedState<T> state{seen, x + model.layout().qd(), motors, ws_};
    for (; row_ < rows.size() && rows[row_].sample == k; ++row_) {
      const Channel& channel = run.channels[rows[row_].channel];
      const double* measured =
          channel.values.data() + k * channel.values.cols();
      T* r = errors + rows[row_].first;
      std::visit([&](const auto& residual) { residual(state, measured, r); },
                 rollout_.measurements().residuals[rows[row_].channel]);
    }
  }

 private:
  const SegmentRollout& rollout_;
  Workspace<T>* ws_;
  SensedPositions<T> seen_;
  size_t row_ = 0;
};

// A model on its way along a segment.
template <typename T>
class SegmentWalk {
 public:
  SegmentWalk(const SegmentRollout& rollout, const T* theta)
      : rollout_(rollout),
        run_(*rollout.measurements().run),
        ws_(rollout.model()),
        stepper_(rollout.options().integrator, &ws_),
        sensors_(rollout, &ws_),
        held_(rollout.model().held_size()) {
    MechanismParameters<T> values;
    rollout.parameters().Apply<T>(theta, &values);
    ws_.SetParameters(values);
  }

  void Measure(int k, const T* x, T* errors) { sensors_.Measure(k, x, errors); }

  // Takes x from sample k to `part` (0 to 1) of the way to the next, with the
  // generalised force f (nv numbers, or null) beside the model's. False where
  // the dynamics fail.
  bool Advance(int k, double part, const T* f, T* x) {
    const double span = part * (run_.t[k + 1] - run_.t[k]);
    const int steps = rollout_.StepsAfter(k);
    const int count = std::max(1, static_cast<int>(std::ceil(steps * part)));
    for (int s = 0; s < count; ++s) {
      ActingInputs<T>(run_, ws_, k, run_.t[k] + span * s / count, span / count,
                      held_.data());
      if (f != nullptr) {
        const int nv = rollout_.model().nv();
        for (int i = 0; i < nv; ++i) held_[i] += f[i];
      }
      if (!stepper_.Step(span / count, held_.data(), x)) return false;
    }
    return true;
  }

  Workspace<T>* workspace() { return &ws_; }

 private:
  const SegmentRollout& rollout_;
  const Run& run_;
  Workspace<T> ws_;
  Stepper<T> stepper_;
  Sensors<T> sensors_;
  std::vector<T> held_;
};

}  // namespace internal

template <typename T>
bool SegmentRollout::operator()(const T* x0, const T* theta, T* errors,
                                T* x_end, std::vector<T>* states) const {
  internal::SegmentWalk<T> walk(*this, theta);
  std::vector<T> x(x0, x0 + model_->state_size());
  for (int k = first_;; ++k) {
    if (states != nullptr) states->insert(states->end(), x.begin(), x.end());
    walk.Measure(k, x.data(), errors);
    if (k == last_) break;
    if (!walk.Advance(k, 1.0, nullptr, x.data())) return false;
  }
  std::copy(x.begin(), x.end(), x_end);
  return true;
}

}  // namespace sysid
