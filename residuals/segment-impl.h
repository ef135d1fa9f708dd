#pragma once

#include <cmath>
#include <variant>

#include "models/state.h"
#include "residuals/acting_effort.h"
#include "residuals/segment.h"

// Definition of SegmentRollout's templates; included only where they are
// instantiated (segment.cc).

namespace sysid {
template <typename T>
bool SegmentRollout::operator()(const T* x0, const T* theta, T* errors,
                                T* x_end, std::vector<T>* states) const {
  const Run& run = *measurements_->run;
  const int size = model_->state_size();
  Workspace<T> ws(*model_);
  {
    MechanismParameters<T> values;
    parameters_->Apply<T>(theta, &values);
    ws.SetParameters(values);
  }
  Stepper<T> stepper(options_.integrator, &ws);
  std::vector<T> x(x0, x0 + size), seen(model_->nq());
  std::vector<T> tau(model_->nv());
  size_t row = 0;
  for (int k = first_;; ++k) {
    if (states != nullptr) states->insert(states->end(), x.begin(), x.end());
    if (row < rows_.size() && rows_[row].sample == k) {
      for (int i = 0; i < model_->nq(); ++i) seen[i] = x[i];
      for (const auto& effect : ws.measurement_effects) {
        effect.hooks->ModifyMeasurement(
            effect.p, &seen[model_->bodies()[effect.body].q_index]);
      }
      if (needs_kinematics_) ForwardKinematics<T>(&ws, x.data());
      const PredictedState<T> state{seen.data(), x.data() + model_->nq(), &ws};
      for (; row < rows_.size() && rows_[row].sample == k; ++row) {
        const Channel& channel = run.channels[rows_[row].channel];
        const double* measured =
            channel.values.data() + k * channel.values.cols();
        T* r = errors + rows_[row].first;
        std::visit([&](const auto& residual) { residual(state, measured, r); },
                   measurements_->residuals[rows_[row].channel]);
      }
    }
    if (k == last_) break;
    const double dt = run.t[k + 1] - run.t[k];
    // 1e-9: a step equal to the sample period but for rounding is one step.
    const int steps = options_.step > 0
                          ? std::max(1, static_cast<int>(std::ceil(
                                            dt / options_.step * (1 - 1e-9))))
                          : 1;
    for (int s = 0; s < steps; ++s) {
      ActingEffort<T>(run, ws, k, run.t[k] + dt * s / steps, dt / steps,
                      tau.data());
      if (!stepper.Step(dt / steps, tau.data(), x.data())) return false;
    }
  }
  for (int i = 0; i < size; ++i) x_end[i] = x[i];
  return true;
}

}  // namespace sysid
