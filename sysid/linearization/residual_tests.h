#pragma once

#include <string>
#include <vector>

#include "sysid/linearization/linearized_fit.h"

namespace sysid {

// Correlations over lags, each with half the width of its 99 % band: 99 of 100
// are within where there is none.
struct Correlogram {
  std::vector<double> lag_s, value, band;
};

// Whether the errors that a fit leaves are white noise.
struct Whiteness {
  std::string channel;
  int samples = 0;
  double lag1 = 0.0;  // autocorrelation at one sample
  double time = 1.0;  // integrated autocorrelation time (6.3), samples
  int lags = 0;       // that were looked at; 0: too few samples to tell
  int lags_out = 0;   // of those, beyond three standard errors
  double p_value = 1.0;
  Correlogram autocorrelation;  // from one sample on
};

// The correlation of a channel's errors with an effort, where it is largest.
struct InputCorrelation {
  std::string channel;
  std::string input;  // the joint; "joint1.x" of a spherical one
  double correlation = 0.0;
  double lag_s = 0.0;    // the effort that many seconds before the error
  double p_value = 1.0;  // pays for the lags and for all pairs
  bool significant = false;
  Correlogram over_lags;
};

std::vector<Whiteness> TestWhiteness(const LinearizedFit& fit);
// None where an effort is constant or was not measured.
std::vector<InputCorrelation> CorrelateInputs(const LinearizedFit& fit);

}  // namespace sysid
