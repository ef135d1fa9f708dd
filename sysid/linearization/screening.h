#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "models/effects/catalogue.h"
#include "sysid/linearization/linearized_fit.h"

namespace sysid {

// Which effect is missing, to first order: every candidate sits at null in the
// fitted model, and one linearisation of the fit says what freeing it would
// gain (the Lagrange-multiplier test; "modification index" and "expected
// parameter change" in structural equation modelling: Sorbom 1989).

// A parameter of an effect as the screening expects it.
struct ExpectedParameter {
  std::string name, unit;
  double value = 0.0;  // SI
  double null_value = 0.0;
  bool searched = false;   // no derivative at null: found by other means
  double std_error = 0.0;  // survives serial correlation
  // The smallest departure from null that this data would show, with a
  // probability of 0.8.
  double detectable = 0.0;
};

struct ScreenedEffect {
  std::shared_ptr<const Effect> effect;
  // S = |Q_A' r|^2, the drop of the whitened sum of squares.          (7.4)
  double score = 0.0;
  int dof = 0;  // directions of the parameters that the data tells of
  // Of (7.5), times the number of tests; at most 1. NaN where none was made.
  double p_value = 1.0;
  double predicted_error = 0.0;  // normalised
  std::vector<ExpectedParameter> parameters;
  // Parameters that the data does not tell of, beside those.
  std::vector<std::string> without_influence;

  std::string name() const { return effect->name(); }
};

struct Screening {
  double error = 0.0;                   // normalised, before
  int tests = 0;                        // that the p-values corrected for
  std::vector<ScreenedEffect> effects;  // best first

  int IndexOf(const std::string& effect) const;  // -1: not screened
};

// `fitted` is the problem's model with the fit's values as nominal ones;
// effects that it has, and parameters that are free or `known`, are no
// candidates.
Screening ScreenEffects(
    const LinearizedFit& fit, const Model& fitted,
    const std::vector<std::shared_ptr<const Effect>>& candidates,
    const std::set<std::string>& known = {});

}  // namespace sysid
