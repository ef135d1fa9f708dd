#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/shooting_stage.h"

namespace sysid {

// What the reports in JSON share: keys in the order of writing, numbers finite
// or null (docs/interface.md section 6).

using Json = nlohmann::ordered_json;

inline Json Finite(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

inline Json ToJson(const ErrorSummary& error) {
  return {{"rms", Finite(error.rms)},
          {"normalized_rms", Finite(error.normalized_rms)}};
}

inline Json ToJson(const std::vector<ChannelError>& channels) {
  Json list = Json::array();
  for (const ChannelError& channel : channels) {
    list.push_back({{"name", channel.name},
                    {"unit", channel.unit},
                    {"rms", Finite(channel.rms)},
                    {"normalized_rms", Finite(channel.normalized_rms)},
                    {"noise", Finite(channel.noise)}});
  }
  return list;
}

inline Json ToJson(const std::vector<SegmentError>& segments) {
  Json list = Json::array();
  for (const SegmentError& s : segments) {
    list.push_back({{"trajectory", s.trajectory},
                    {"t_start", s.t_start},
                    {"t_end", s.t_end},
                    {"normalized_rms", Finite(s.normalized_rms)}});
  }
  return list;
}

inline Json ToJson(const std::vector<HorizonError>& horizon) {
  Json list = Json::array();
  for (const HorizonError& h : horizon) {
    list.push_back({{"horizon_s", h.horizon_s}, {"rms", Finite(h.rms)}});
  }
  return list;
}

inline Json ToJson(const std::vector<OpenError>& open, bool held_out) {
  Json list = Json::array();
  for (const OpenError& run : open) {
    Json channels = Json::array();
    for (const OpenError::Channel& channel : run.channels) {
      channels.push_back({{"name", channel.name},
                          {"rms", Finite(channel.rms)},
                          {"unit", channel.unit}});
    }
    list.push_back({{"trajectory", run.trajectory},
                    {"duration_s", Finite(run.duration_s)},
                    {"held_out", held_out},
                    {"channels", channels}});
  }
  return list;
}

inline Json ToJson(const std::vector<HistoryEntry>& history) {
  Json list = Json::array();
  for (const HistoryEntry& entry : history) {
    list.push_back({{"iteration", entry.iteration},
                    {"cost", Finite(entry.cost)},
                    {"time_s", entry.time_s}});
  }
  return list;
}

// Of a covariance; null where a variance is none.
inline Json Correlation(const Eigen::MatrixXd& covariance) {
  Json rows = Json::array();
  for (int i = 0; i < covariance.rows(); ++i) {
    Json row = Json::array();
    for (int j = 0; j < covariance.cols(); ++j) {
      row.push_back(Finite(covariance(i, j) /
                           std::sqrt(covariance(i, i) * covariance(j, j))));
    }
    rows.push_back(row);
  }
  return rows;
}

// Text from files may be no UTF-8: replaced, never refused.
inline std::string Dump(const Json& json) {
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace sysid
