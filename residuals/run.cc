#include "residuals/run.h"

#include <algorithm>

namespace sysid {

bool HasEffort(const Run& run, int first, int size) {
  if (run.recorded_efforts.empty()) {
    return run.effort.rows() > 0 &&
           !run.effort.middleCols(first, size).isZero(0.0);
  }
  const auto from = run.recorded_efforts.begin() + first;
  return std::find(from, from + size, true) != from + size;
}

const Input* FindInput(const Run& run, const std::string& name) {
  for (const Input& input : run.inputs) {
    if (input.name == name) return &input;
  }
  return nullptr;
}

bool HasInput(const Run& run, const std::string& name) {
  return name == kTimeInput || FindInput(run, name) != nullptr;
}

}  // namespace sysid
