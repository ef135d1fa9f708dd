#include "sysid/diagnosis/base_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace sysid {

void AddDoubts(Diagnosis* diagnosis) {
  const Fit& fit = diagnosis->base.fit;
  std::vector<std::string>& doubts = diagnosis->doubts;
  if (!fit.converged) {
    doubts.push_back("the fit did not converge: " + fit.termination);
  }
  for (const ParameterEstimate& p : fit.parameters) {
    if (p.at_bound) doubts.push_back(p.name + " ended at its bound");
  }
  // Another model, or motion unlike that of the fit.
  constexpr double kForeign = 5.0;
  const double train = std::max(1.0, diagnosis->base.train_error());
  if (diagnosis->base.holdout_error() > kForeign * train) {
    doubts.push_back(
        "the held-out runs are predicted much worse than the fitted ones: are "
        "they of the same machine?");
  }
  for (const std::vector<std::string>& group : fit.not_identifiable) {
    doubts.push_back(NotIdentifiable(group));
  }
}

}  // namespace sysid
