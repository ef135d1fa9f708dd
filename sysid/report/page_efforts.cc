#include <algorithm>
#include <limits>

#include "sysid/report/page_parts.h"

namespace sysid {
namespace {

// The places of even times, with -1 where some are left out: no line is drawn
// across.
std::vector<int> WithGaps(const std::vector<double>& t) {
  double step = std::numeric_limits<double>::infinity();
  for (size_t k = 1; k < t.size(); ++k) step = std::min(step, t[k] - t[k - 1]);
  std::vector<int> places;
  for (size_t k = 0; k < t.size(); ++k) {
    if (k > 0 && t[k] - t[k - 1] > 1.5 * step) places.push_back(-1);
    places.push_back(static_cast<int>(k));
  }
  return places;
}

// One even time apart, so that a filter's cut-off leaves nothing in between.
Json ValuesAt(const std::vector<int>& places,
              const std::vector<double>& values) {
  std::vector<double> shown;
  for (const int k : places) {
    shown.push_back(k < 0 ? std::numeric_limits<double>::quiet_NaN()
                          : values[k]);
  }
  return DrawnSeries(shown);
}

Json TimesAt(const std::vector<int>& places, const std::vector<double>& t) {
  std::vector<double> times;
  for (size_t i = 0; i < places.size(); ++i) {
    times.push_back(places[i] < 0 ? 0.5 * (t[places[i - 1]] + t[places[i + 1]])
                                  : t[places[i]]);
  }
  return TimeSeries(std::move(times));
}

}  // namespace

ModelEfforts CompareModelEfforts(const PageFit& fit) {
  ModelEfforts efforts;
  efforts.fitted = CompareEfforts(*fit.problem, fit.fit->point.theta);
  if (fit.holdout != nullptr) {
    efforts.held_out =
        CompareEfforts(*fit.holdout->problem, fit.holdout->point.theta);
  }
  return efforts;
}

Json EffortErrorsJson(const EffortComparison& comparison) {
  if (comparison.errors.empty()) return nullptr;
  // The series of a joint stand together.
  const size_t runs = comparison.series.size() / comparison.errors.size();
  Json joints = Json::array();
  for (const EffortError& error : comparison.errors) {
    joints.push_back({{"joint", error.joint},
                      {"unit", comparison.series[joints.size() * runs].unit},
                      {"rms", Finite(error.rms)},
                      {"percent", Finite(error.percent)}});
  }
  return {{"cutOff_hz", Finite(comparison.cut_off_hz)}, {"joints", joints}};
}

Json EffortCurvesJson(const EffortComparison& comparison, int run, int runs) {
  if (comparison.series.empty()) return nullptr;
  const std::vector<double>& t = comparison.series[run].t;
  if (t.empty()) return nullptr;  // shorter than the filter
  const std::vector<int> places = WithGaps(t);
  Json curves = Json::array();
  for (size_t i = run; i < comparison.series.size(); i += runs) {
    const EffortSeries& series = comparison.series[i];
    curves.push_back({{"joint", series.joint},
                      {"unit", series.unit},
                      {"measured", ValuesAt(places, series.measured)},
                      {"predicted", ValuesAt(places, series.predicted)}});
  }
  return {{"t", TimesAt(places, t)}, {"curves", curves}};
}

}  // namespace sysid
