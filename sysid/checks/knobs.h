#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sysid/checks/check.h"
#include "sysid/checks/excerpt.h"
#include "sysid/checks/quick_fit.h"

namespace sysid {

inline constexpr double kSignificance = 4.0;  // standard errors
inline constexpr double kInterval = 1.96;     // standard errors of 95 %

// A reading with a number that the data must say: by how much a channel is
// late, how fast a zero drifts.
struct Knob {
  std::string fault;    // "channel_late"
  std::string subject;  // "joint1.q"
  std::function<void(double value, Run*)> change;
  double probe = 0.0;  // a small value, at which its derivative is taken
  double gain = 2.0;   // by which factor it must lower the error
  // Where values of the model could do the same, and so tell nothing: how much
  // worse than the best of them its error may be.
  std::optional<double> of_model;
  double least = 0.0;          // nothing smaller is worth a word
  double most = 0.0;           // nor can the linearisation speak of larger ones
  std::vector<double> starts;  // beside what the linearisation says
  // Where a multiple of it does as well as the best value, that is meant: a
  // recorder's delay is whole samples, and they need no interpolation.
  double grain = 0.0;
  // With half the width of its 95 % interval.
  std::function<std::string(double value, double within)> says;
  std::string consequence;
  std::function<std::vector<std::string>(double value)> remedies;
};

// What a fit, linearised where it ended, says of a knob p: with the rows'
// change c = dr/dp, the tangent J of all states and parameters, Q the projector
// on what J cannot explain,
//
//   p^ = -(c' Q r) / (c' Q c),    |r|^2 falls by (c' Q r)^2 / (c' Q c),
//   var p^ = s^2 T / (c' Q c),                                          (C.1)
//
// s^2 the reduced chi-square of the fit and T the autocorrelation time of its
// residuals.
struct KnobScore {
  bool known = false;
  double value = 0.0;
  double std_error = 0.0;
  double error = 0.0;  // predicted, times the noise
};

// Scores of all knobs at a fit of the excerpt as it was read.
std::vector<KnobScore> ScoreKnobs(const LooseModel& model, const QuickFit& fit,
                                  const Excerpt& excerpt,
                                  const std::vector<Knob>& knobs);

// Where a knob ends, everything else refitted.
struct TurnedKnob {
  double value = 0.0;
  double std_error = std::numeric_limits<double>::infinity();
  QuickFit fit;  // there
};

// From a start on short segments, which are nearly linear in it: by (C.1) again
// and again until it stays. The first fit has so many iterations.
TurnedKnob TurnShort(const LooseModel& model, const Excerpt& excerpt,
                     const EstimationOptions& options, const Knob& knob,
                     double start, int iterations, const QuickFit& like);

// On whole windows, from a value and a fit of them there.
TurnedKnob TurnLong(const LooseModel& model, const Excerpt& excerpt,
                    const EstimationOptions& options, const Knob& knob,
                    double value, QuickFit fit);

// The nearest multiple of the knob's grain where it does as well.
TurnedKnob ToGrain(const LooseModel& model, const Excerpt& excerpt,
                   const EstimationOptions& options, const Knob& knob,
                   TurnedKnob turned);

}  // namespace sysid
