#include "sysid/diagnosis/force_knots.h"

#include <algorithm>
#include <cmath>

namespace sysid {
namespace {

constexpr double kSamplesPerKnot = 4.0;
constexpr double kMostKnots = 400.0;  // of a run
// Of a segment, over all degrees of freedom: what their products cost grows
// with the square.
constexpr double kMostColumns = 160.0;

double LongestSegment(const LinearizedFit& fit) {
  double longest = 0.0;
  for (const auto& segment : fit.segments()) {
    const std::vector<double>& t = fit.problem().runs()[segment->run]->run.t;
    longest = std::max(
        longest, t[segment->rollout->last()] - t[segment->rollout->first()]);
  }
  return longest;
}

}  // namespace

double ForceKnots::Weight(int knot, double t) const {
  return std::max(0.0, 1.0 - std::abs(Place(t) - knot));
}

double Middle(const Run& run, int k) { return 0.5 * (run.t[k] + run.t[k + 1]); }

std::vector<ForceKnots> PlaceKnots(const LinearizedFit& fit) {
  const ShootingProblem& problem = fit.problem();
  const double spacing =
      std::max({kSamplesPerKnot * problem.data().MedianSamplePeriod(),
                problem.data().LongestDuration() / kMostKnots,
                LongestSegment(fit) * problem.model().nv() / kMostColumns});
  std::vector<ForceKnots> all;
  for (const auto& data : problem.runs()) {
    const double duration = data->run.t.back() - data->run.t.front();
    ForceKnots knots;
    knots.start = data->run.t.front();
    knots.count =
        std::max(3, static_cast<int>(std::ceil(duration / spacing)) + 1);
    knots.spacing = duration / (knots.count - 1);
    all.push_back(knots);
  }
  return all;
}

KnotRange RangeOf(const ForceKnots& knots, const Run& run,
                  const LinearizedFit::Segment& segment) {
  const auto below = [&](int k) {
    return static_cast<int>(knots.Place(Middle(run, k)));
  };
  KnotRange range;
  range.first = below(segment.rollout->first());
  range.last =
      std::min(knots.count - 1, below(segment.rollout->last() - 1) + 1);
  return range;
}

}  // namespace sysid
