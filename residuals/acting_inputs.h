#pragma once

#include <cmath>
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

// The same of an input, by its kind; "t" is the middle of the window. CHECKs
// that the run has it.
double MeanInput(const Run& run, const std::string& name, double from,
                 double to);
// Of an input, its value just before `time`.
double InputBefore(const Run& run, const std::string& name, double time);

namespace internal {

// Earlier by more than the rounding of a row's time, less than any sensor
// shows: the part of a step that "just before" is.
inline constexpr double kInstant = 1e-6;

// A measured effort u behind a low-pass of first order, lag y' = u - y, at
// `time`; y is u long before. u is held from row to row, so that y is exact:
// y(t) = u + (y(t_r) - u) exp(-(t - t_r) / lag) after each row r.       (5.6)
template <typename T>
T LaggedEffort(const Run& run, int column, const T& lag, const T& time) {
  using std::exp;
  // exp(-36) is below rounding.
  constexpr double kMemory = 36.0;
  const double end = ValueOf(time);
  int row = RowBefore(run, end - kMemory * ValueOf(lag));
  T y(run.effort(row, column));
  const int last = RowBefore(run, end);
  for (; row < last; ++row) {
    const double u = run.effort(row, column);
    y = (y - u) * exp(T(run.t[row] - run.t[row + 1]) / lag) + u;
  }
  const double u = run.effort(last, column);
  return (y - u) * exp((T(run.t[last]) - time) / lag) + u;
}

// The mean of that over [from, from + h]: since lag y' = u - y, it is that of u
// less lag (y(from + h) - y(from)) / h. Of a lag of zero, to first order in it,
// y is u just before.
template <typename T>
T MeanLagged(const Run& run, int column, const T& lag, const T& from, double h,
             const T& mean) {
  // Below, exp(-h / lag) is nothing beside any effort.
  if (ValueOf(lag) < h / 700.0) {
    const double start = ValueOf(from) - kInstant * h;
    const double change = run.effort(RowBefore(run, start + h), column) -
                          run.effort(RowBefore(run, start), column);
    return mean - lag * (change / h);
  }
  return mean - lag *
                    (LaggedEffort<T>(run, column, lag, from + h) -
                     LaggedEffort<T>(run, column, lag, from)) /
                    h;
}

}  // namespace internal

// What acts on the joints from t to t + h, s, within the time of `sample`:
// Model::held_size() numbers. First the efforts: as measured, or later by the
// model's delay d,
//   (1/h) integral of u over [t - d, t + h - d],                        (5.4)
// piecewise linear in d, whose derivative is exact: (u(t - d) - u(t + h - d)) /
// h, u just before either time; low-passed (5.6) where an effect says so; then
// changed by the input effects. Then the inputs that each effect reads, by
// (5.4) with its own delay.
template <typename T>
void ActingInputs(const Run& run, const Workspace<T>& ws, int sample, double t,
                  double h, T* held) {
  const Model& model = ws.model();
  const int nv = model.nv();
  for (int i = 0; i < nv; ++i) held[i] = T(run.effort(sample, i));
  T delay(0.0);
  const double instant = internal::kInstant * h;
  if (!ws.delay_effects.empty()) {
    for (const auto& effect : ws.delay_effects) {
      effect.hooks->AddInputDelay(effect.p, &delay);
    }
    const double d = ValueOf(delay);
    std::vector<double> mean(nv);
    MeanEffort(run, t - d, t + h - d, mean.data());
    const int first = RowBefore(run, t - d - instant);
    const int last = RowBefore(run, t + h - d - instant);
    for (int i = 0; i < nv; ++i) {
      const double slope = (run.effort(first, i) - run.effort(last, i)) / h;
      held[i] = (delay - T(d)) * slope + T(mean[i]);
    }
  }
  for (const auto& effect : ws.lag_effects) {
    T lag(0.0);
    effect.hooks->AddInputLag(effect.p, &lag);
    const int v = model.bodies()[effect.body].v_index;
    held[v] = internal::MeanLagged<T>(run, v, lag, T(t) - delay, h, held[v]);
  }
  for (const auto& effect : ws.input_effects) {
    effect.hooks->ModifyInput(effect.p,
                              held + model.bodies()[effect.body].v_index);
  }
  for (const auto& effect : ws.readers) {
    T own(0.0);
    effect.hooks->AddOwnDelay(effect.p, &own);
    const double d = ValueOf(own);
    for (int k = 0; k < effect.inputs; ++k) {
      const std::string& name = effect.names[k].name;
      T& value = held[effect.first_held + k];
      value = T(MeanInput(run, name, t - d, t + h - d));
      if (!MayMove(own)) continue;
      const double slope = (InputBefore(run, name, t - d - instant) -
                            InputBefore(run, name, t + h - d - instant)) /
                           h;
      value += (own - T(d)) * slope;
    }
  }
}

}  // namespace sysid
