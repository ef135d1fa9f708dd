#pragma once

#include <limits>
#include <vector>

#include "sysid/estimation/evaluation.h"

namespace sysid {

// Where EvaluateHorizon looks: at so many seconds ahead of states that are
// estimated from windows of this length.
inline constexpr double kHorizons[] = {0.05, 0.1, 0.2, 0.5,
                                       1.0,  2.0, 5.0, 10.0};
inline constexpr double kHorizonWindow = 0.2;  // s

// Which of all runs one is.
struct RunPlace {
  int number = 0, count = 1;
};

// For windows of a run that begin at these samples, how far each is followed,
// s; 0: not at all. Of a horizon h that the run has room for, the starts are
// h / 4 apart, for two predictions that share more of their motion say nearly
// the same; closer where that leaves fewer than 8, for then the noise of single
// windows counts; and at most 20: the root mean square of 20 independent errors
// is within a third of what more would give (three standard errors of a
// chi-square, 3 / sqrt(2 x 20)). Of more than 20 runs there are 400 starts in
// all, for a tenth, or one in each run; where they begin then differs from run
// to run.
// With a `longest`, s, of which there is no longer one, the starts are those of
// the longest up to it, fewer and soon rolled out: they tell the shorter ones.
std::vector<double> HorizonReach(
    const std::vector<double>& t, const std::vector<int>& starts,
    const RunPlace& run = {},
    double longest = std::numeric_limits<double>::infinity());

// What EvaluateHorizon would find if the model were true, and knew its
// parameters: the noise of the windows makes the states that are estimated from
// them wrong, the motion lets that grow (in chaos exponentially), and what is
// predicted is compared with measurements that are noisy themselves. For a
// state x of the point, J the whitened derivative of the window's measurements
// by its tangent, B the inverse standard deviations of StateBelief, and w
// standard normal,
//
//   dx = (J^T J + B^T B)^-1 J^T w,                                      (8.3)
//   rms(h)^2 = mean |y(x [+] dx, h) - y(x, h)|^2 + sigma^2,
//
// in a few draws a state, always the same ones. Only an estimate: of the growth
// where it is large few states count. Horizons for which there is no data are
// left out.
std::vector<HorizonError> EstimateNoiseHorizon(const ShootingProblem& problem,
                                               const Solution& point);

}  // namespace sysid
