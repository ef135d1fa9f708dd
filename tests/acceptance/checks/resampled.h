#pragma once

#include <random>
#include <vector>

#include "models/mechanism.h"
#include "sysid/checks/series.h"

namespace sysid {

// Recordings with other samples, for the faults of too few, too slow and still
// ones. `motion` is MotionSeries of a session to which the run belongs.

// Without the samples [first, last).
Run WithoutRows(const Run& run, int first, int last);

// Every so manieth sample.
Run Thinned(const Run& run, int stride);

// Twice as long again before a run, at rest in its first position, with the
// noise of each channel.
Run AfterRest(const std::vector<Series>& motion, const Run& run,
              std::mt19937_64* engine);

// How often the fastest channel of a run turns; a hinge that goes round does so
// twice a round.
double Swings(const Mechanism& mechanism, const std::vector<Series>& motion,
              const Run& run);

// The first of so many samples in which a channel goes the farthest part of its
// range.
int FastestStretch(const Run& run, int samples);

}  // namespace sysid
