#include "models/urdf/urdf_faults.h"

#include <algorithm>
#include <tuple>

#include "models/error.h"

namespace sysid {

void UrdfFaults::Add(int row, int column, const std::string& what,
                     const std::string& hint) {
  faults_.push_back({row, column, what, hint});
}

std::string UrdfFaults::Place(const Fault& fault) const {
  if (fault.row <= 0) return path_;
  return path_ + ":" + std::to_string(fault.row) + ":" +
         std::to_string(fault.column);
}

void UrdfFaults::Throw() const {
  if (faults_.empty()) return;
  if (faults_.size() == 1) {
    throw InputError(Place(faults_[0]), faults_[0].what, faults_[0].hint);
  }
  std::vector<Fault> sorted = faults_;
  std::stable_sort(
      sorted.begin(), sorted.end(), [](const Fault& a, const Fault& b) {
        return std::tie(a.row, a.column) < std::tie(b.row, b.column);
      });
  std::string text = std::to_string(sorted.size()) + " faults";
  for (const Fault& fault : sorted) {
    text += "\n  " + Place(fault) + ": " + fault.what;
    if (!fault.hint.empty()) text += " (" + fault.hint + ")";
  }
  throw InputError(path_, text);
}

}  // namespace sysid
