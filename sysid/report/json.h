#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "sysid/estimation/cancelled.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/fit.h"
#include "sysid/linearization/residual_tests.h"

namespace sysid {

// What the reports in JSON share: keys in the order of writing, numbers finite
// or null (docs/interface.md section 6).

using Json = nlohmann::ordered_json;

inline Json Finite(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
// Of a list of numbers, or of such lists.
template <typename List>
Json Finite(const List& values) {
  Json list = Json::array();
  for (const auto& value : values) list.push_back(Finite(value));
  return list;
}
inline Json Finite(const Eigen::MatrixXd& rows) {
  return Finite(rows.rowwise());
}

inline Json StoppedJson(StoppedBy by) {
  return by == StoppedBy::kNobody ? Json(nullptr) : Json(ToString(by));
}

// A list of what `item` makes of each.
template <typename Items, typename Item>
Json List(const Items& items, const Item& item) {
  Json list = Json::array();
  for (const auto& each : items) list.push_back(item(each));
  return list;
}

// Finite where it is of numbers with a fraction.
template <typename T>
Json Written(const T& value) {
  if constexpr (std::is_same_v<T, double> ||
                std::is_same_v<T, std::vector<double>> ||
                std::is_base_of_v<Eigen::EigenBase<T>, T>) {
    return Finite(value);
  } else {
    return value;
  }
}

// How a struct is written: the members named, in this order, by their names.
#define SYSID_JSON_MEMBER(member) json[#member] = Written(value.member);
#define SYSID_JSON(Type, ...)                                                 \
  inline void to_json(Json& json, const Type& value) {                        \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(SYSID_JSON_MEMBER, __VA_ARGS__)) \
  }

SYSID_JSON(ErrorSummary, rms, normalized_rms, fit_percent)
SYSID_JSON(ChannelError, name, unit, rms, normalized_rms, fit_percent, noise)
SYSID_JSON(SegmentError, trajectory, t_start, t_end, normalized_rms)
SYSID_JSON(HorizonChannel, name, rms)
SYSID_JSON(HorizonError, horizon_s, rms, channels)
SYSID_JSON(EffortError, joint, rms, percent)
SYSID_JSON(Discrepancy, joint, force_std, correlation_time_s)
SYSID_JSON(Correlogram, lag_s, value, band)
SYSID_JSON(BaseParameter::Term, name, factor)
SYSID_JSON(BaseParameter, terms, unit, value, std_error)
SYSID_JSON(HistoryEntry, iteration, cost, time_s)
SYSID_JSON(OpenError::Channel, name, rms, fit_percent, unit)

inline Json OpenJson(const std::vector<OpenError>& open, bool held_out) {
  return List(open, [&](const OpenError& run) -> Json {
    return {{"trajectory", run.trajectory},
            {"duration_s", Finite(run.duration_s)},
            {"held_out", held_out},
            {"channels", run.channels}};
  });
}

// Of a covariance; null where a variance is none.
inline Json Correlation(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd variance = covariance.diagonal();
  const Eigen::MatrixXd products = variance * variance.transpose();
  return Finite(
      Eigen::MatrixXd(covariance.cwiseQuotient(products.cwiseSqrt())));
}

// Text from files may be no UTF-8: replaced, never refused.
inline std::string Dump(const Json& json) {
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}
// The same in one line.
inline std::string Compact(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// More than any JSON of ours has.
constexpr int kMostJsonDepth = 100;

// A text from a file or a request; none where it is no JSON, or nested deeper
// than kMostJsonDepth: to copy, compare or write that recurses until the stack
// ends.
inline std::optional<Json> ParseJson(const std::string& text) {
  bool too_deep = false;
  const auto keep = [&](int depth, Json::parse_event_t event, const Json&) {
    using Event = Json::parse_event_t;
    // Of what is open already when this opens.
    if (depth >= kMostJsonDepth &&
        (event == Event::object_start || event == Event::array_start)) {
      too_deep = true;
    }
    return !too_deep;
  };
  Json json = Json::parse(text, keep, false);
  if (too_deep || json.is_discarded()) return {};
  return json;
}

}  // namespace sysid
