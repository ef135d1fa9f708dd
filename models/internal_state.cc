#include "models/internal_state.h"

#include <algorithm>

#include "models/internal_state-impl.h"

namespace sysid {

void StartStates(Workspace<double>* ws, const double* held, double* x) {
  if (ws->model().layout().nz() == 0) return;
  internal::StartStatesAt<double>(ws, held, x);
}

void MoveStates(Workspace<double>* ws, const double* before, double* x) {
  internal::MoveStatesFrom<double>(*ws, before, x);
}

bool SameStates(const Model& a, const Model& b) {
  const auto& of_a = a.effects().states();
  const auto& of_b = b.effects().states();
  return std::equal(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(),
                    [](const EffectState& one, const EffectState& other) {
                      return one.name == other.name;
                    });
}

Eigen::VectorXd AdoptState(const Model& from, const double* x,
                           const Model& to) {
  const StateLayout &before = from.layout(), &after = to.layout();
  if (SameStates(from, to)) {
    return Eigen::Map<const Eigen::VectorXd>(x, before.size());
  }
  Eigen::VectorXd out(after.size());
  std::copy_n(x, before.z(), out.data());
  Workspace<double> ws(to);
  StartStates(&ws, ws.nothing.data(), out.data());
  const auto& known = from.effects().states();
  const auto& wanted = to.effects().states();
  for (int i = 0; i < after.nz(); ++i) {
    const auto same = std::find_if(
        known.begin(), known.end(),
        [&](const EffectState& own) { return own.name == wanted[i].name; });
    if (same == known.end()) continue;
    out[after.z() + i] = x[before.z() + static_cast<int>(same - known.begin())];
  }
  return out;
}

}  // namespace sysid
