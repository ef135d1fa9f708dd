#include "sysid/io/base_acceleration.h"

#include <algorithm>
#include <string>

namespace sysid {

std::vector<double> SplineAcceleration(const std::vector<double>& t,
                                       const std::vector<double>& values) {
  const int n = static_cast<int>(t.size());
  std::vector<double> a(n, 0.0);
  if (n < 3) return a;
  // With h_k = t_{k+1} - t_k, for the inner times
  //   h_{k-1} a_{k-1} + 2 (h_{k-1} + h_k) a_k + h_k a_{k+1}
  //     = 6 ((y_{k+1} - y_k) / h_k - (y_k - y_{k-1}) / h_{k-1}),
  // a = 0 at the ends. Diagonally dominant: eliminated in order.
  std::vector<double> above(n, 0.0);
  for (int k = 1; k + 1 < n; ++k) {
    const double before = t[k] - t[k - 1], after = t[k + 1] - t[k];
    const double right = 6.0 * ((values[k + 1] - values[k]) / after -
                                (values[k] - values[k - 1]) / before);
    const double pivot = 2.0 * (before + after) - before * above[k - 1];
    above[k] = after / pivot;
    a[k] = (right - before * a[k - 1]) / pivot;
  }
  for (int k = n - 2; k > 0; --k) a[k] -= above[k] * a[k + 1];
  return a;
}

void AddBaseAcceleration(Run* run) {
  const bool any = std::any_of(
      run->inputs.begin(), run->inputs.end(),
      [](const Input& input) { return input.name.starts_with("base."); });
  if (!any) return;
  std::vector<Input> added;
  for (const std::string axis : {"x", "y", "z"}) {
    const std::string name = "base.a" + axis;
    if (FindInput(*run, name) != nullptr) continue;
    const Input* position = FindInput(*run, "base.p" + axis);
    added.push_back({name, false, std::vector<double>(run->t.size(), 0.0)});
    if (position == nullptr) continue;
    added.back().values = SplineAcceleration(run->t, position->values);
  }
  run->inputs.insert(run->inputs.end(), added.begin(), added.end());
}

}  // namespace sysid
