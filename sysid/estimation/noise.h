#pragma once

#include <vector>

namespace sysid {

// The standard deviation of white noise on a smooth signal: rms of what is left
// of d + 2 neighbouring samples after the polynomial of degree d through them,
//   e_i = sum_j w_j y_{i+j},  w_j ~ 1 / prod_{k != j} (t_j - t_k),  |w| = 1,
// (a divided difference, so the spacing may vary) for growing d, until a higher
// degree takes away no more than 5 %. The largest 2 % of e_i^2 are left out:
// spikes and stick-slip are not noise. A spike is in d + 2 of them, so of those
// above ten times what the median says, as many as 2 % of the samples spoil.
// After Gasser, Sroka, Jennen-Steinmetz, Biometrika 73 (1986), and Hall, Kay,
// Titterington, Biometrika 77 (1990).
//
// Missing samples (NaN) are skipped. 0 where there are fewer than 5 samples.
double EstimateNoise(const std::vector<double>& t,
                     const std::vector<double>& y);

}  // namespace sysid
