#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "sysid/report/page_parts.h"

namespace sysid {
namespace {

std::string Base64(const std::vector<std::uint8_t>& bytes) {
  constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (k < count ? bytes[i + k] : 0);
    }
    for (size_t k = 0; k < 4; ++k) {
      text += k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

// One NaN for all, and infinities are missing numbers, too.
float Single(double value) {
  const float single = static_cast<float>(value);
  return std::isfinite(single) ? single
                               : std::numeric_limits<float>::quiet_NaN();
}

Json OfColumns(const RowMatrixXd& values,
               Json (*series)(const std::vector<double>&)) {
  return List(values.colwise(), [&](const auto& column) {
    return series({column.begin(), column.end()});
  });
}

}  // namespace

Json Series(const std::vector<double>& values) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(4 * values.size());
  for (const double value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(Single(value));
    for (int shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::uint8_t>(bits >> shift));
    }
  }
  return {{"f32", Base64(bytes)}};
}

Json TimeSeries(std::vector<double> times) {
  constexpr double kFar = 1000.0;  // s: 6e-5 s apart there
  if (times.empty() || std::abs(times.front()) < kFar) return Series(times);
  const double offset = times.front();
  for (double& t : times) t -= offset;
  Json series = Series(times);
  series["offset"] = offset;
  return series;
}

Json DrawnSeries(const std::vector<double>& values) {
  constexpr std::uint16_t kMissing = 65535;
  double lower = std::numeric_limits<double>::infinity(), upper = -lower;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    lower = std::min(lower, value);
    upper = std::max(upper, value);
  }
  if (!(lower <= upper)) lower = upper = 0.0;
  const double step = upper > lower ? (upper - lower) / (kMissing - 1) : 1.0;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * values.size());
  for (const double value : values) {
    const auto place =
        std::isfinite(value)
            ? static_cast<std::uint16_t>(std::lround((value - lower) / step))
            : kMissing;
    bytes.push_back(static_cast<std::uint8_t>(place));
    bytes.push_back(static_cast<std::uint8_t>(place >> 8));
  }
  return {{"u16", Base64(bytes)}, {"step", step}, {"offset", lower}};
}

Json SeriesOfColumns(const RowMatrixXd& values) {
  return OfColumns(values, Series);
}

Json DrawnColumns(const RowMatrixXd& values) {
  return OfColumns(values, DrawnSeries);
}

}  // namespace sysid
