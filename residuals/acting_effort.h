#pragma once

#include <vector>

#include "models/workspace.h"
#include "residuals/run.h"

namespace sysid {

// The run's row that holds at the time just before `time`, s: efforts hold from
// each row until the next (docs/interface.md section 2), the first row's also
// before it.
int RowBefore(const Run& run, double time);

// The mean over [from, to], s, of the efforts so held; nv numbers. A window
// that ends at a row has nothing of it.
void MeanEffort(const Run& run, double from, double to, double* mean);

// The efforts that act on the joints from t to t + h, s, within the time of
// `sample`: as measured, or later by the model's delay d,
//   (1/h) integral of u over [t - d, t + h - d],                        (5.4)
// piecewise linear in d, whose derivative is exact: (u(t - d) - u(t + h - d)) /
// h, u just before either time; then changed by the input effects. nv numbers.
template <typename T>
void ActingEffort(const Run& run, const Workspace<T>& ws, int sample, double t,
                  double h, T* tau) {
  const Model& model = ws.model();
  const int nv = model.nv();
  for (int i = 0; i < nv; ++i) tau[i] = T(run.effort(sample, i));
  if (!ws.delay_effects.empty()) {
    T delay(0.0);
    for (const auto& effect : ws.delay_effects) {
      effect.hooks->AddInputDelay(effect.p, &delay);
    }
    const double d = ValueOf(delay);
    std::vector<double> mean(nv);
    MeanEffort(run, t - d, t + h - d, mean.data());
    // Earlier by more than the rounding of a row's time, less than any sensor
    // shows.
    const double instant = 1e-6 * h;
    const int first = RowBefore(run, t - d - instant);
    const int last = RowBefore(run, t + h - d - instant);
    for (int i = 0; i < nv; ++i) {
      const double slope = (run.effort(first, i) - run.effort(last, i)) / h;
      tau[i] = (delay - T(d)) * slope + T(mean[i]);
    }
  }
  for (const auto& effect : ws.input_effects) {
    effect.hooks->ModifyInput(effect.p,
                              tau + model.bodies()[effect.body].v_index);
  }
}

}  // namespace sysid
