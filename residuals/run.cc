#include "residuals/run.h"

namespace sysid {

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
