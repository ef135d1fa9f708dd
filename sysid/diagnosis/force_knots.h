#pragma once

#include <vector>

#include "sysid/diagnosis/linearized_fit.h"

namespace sysid {

// The knots of a run, evenly spaced; a force is linear between two.
struct ForceKnots {
  double start = 0.0, spacing = 0.0;  // s
  int count = 0;
  double Time(int knot) const { return start + knot * spacing; }
  // Where a time lies, in knots, and the weight of a knot there.
  double Place(double t) const { return (t - start) / spacing; }
  double Weight(int knot, double t) const;
};

// The knots that the intervals of a segment see, [first, last].
struct KnotRange {
  int first = 0, last = 0;
  int size() const { return last - first + 1; }
};

// Halfway from sample k to the next, where (7.2) takes the forces.
double Middle(const Run& run, int k);

// Of each run. As close as the samples are worth, but so that long segments of
// many joints stay cheap.
std::vector<ForceKnots> PlaceKnots(const LinearizedFit& fit);

KnotRange RangeOf(const ForceKnots& knots, const Run& run,
                  const LinearizedFit::Segment& segment);

}  // namespace sysid
