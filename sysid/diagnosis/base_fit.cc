#include "sysid/diagnosis/base_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace sysid {

void ShortenSegments(const DiagnosisProblem& problem, Diagnosis* diagnosis) {
  const auto failed = [](const EvaluatedModel& evaluated) {
    return !evaluated.fit.converged ||
           !std::isfinite(evaluated.train_error()) ||
           !std::isfinite(evaluated.holdout_error());
  };
  if (!failed(diagnosis->base)) return;
  DiagnosisProblem shorter = problem;
  const double before = diagnosis->base.fit.segment_s;
  shorter.options.segment = std::max(0.1, before / 4.0);
  EvaluatedModel again = EvaluateGiven(shorter);
  if (failed(again)) {
    // No step was taken where the start is hopeless.
    diagnosis->usable = diagnosis->base.fit.iterations > 0 &&
                        std::isfinite(diagnosis->base.train_error()) &&
                        std::isfinite(diagnosis->base.holdout_error());
    return;
  }
  char text[160];
  std::snprintf(text, sizeof(text),
                "the fit did not converge in segments of %.3g s; these results "
                "are of segments of %.3g s",
                before, again.fit.segment_s);
  diagnosis->doubts.push_back(text);
  diagnosis->base = std::move(again);
}

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
