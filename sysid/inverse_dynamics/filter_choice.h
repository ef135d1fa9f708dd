#pragma once

#include <functional>

#include "sysid/estimation/processes.h"
#include "sysid/inverse_dynamics/equation_rows.h"

namespace sysid {

// The filter of (11.2), from the data. In a band b of frequencies, between
// Gaussians of widths w and w 2^(1/2), the equations tell something of joint v
// where they explain more than half of the power that is there,
//
//   sum |r_b|^2 < 1/2 max(sum |u_b|^2, sum |(M qdd)_b|^2),             (11.5)
//
// and nothing where it is noise, vibration, or what drives and gears do at such
// frequencies. The cut-off is the highest at which they tell something of half
// of the joints.
// `values` are those of a fit with a filter of FirstFilter; `all` processes
// share out the runs.
EquationFilter ChooseFilter(const Model& model,
                            const MechanismParameters<double>& values,
                            const std::vector<const Run*>& runs,
                            const EquationFilter& first, int threads,
                            const Processes& all = Alone());

// Before anything is known of the model: 30 ms, which is slower than noise,
// vibrations and stick-slip, and no less than four samples.
EquationFilter FirstFilter(const std::vector<const Run*>& runs,
                           const Processes& all = Alone());

}  // namespace sysid
