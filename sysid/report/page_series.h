#pragma once

#include <vector>

#include "sysid/report/json.h"

namespace sysid {

// A Series of page_data.ts: little-endian float32 in base64, missing numbers
// NaN. Seven digits, which no screen shows, in 5.3 characters a number.
Json Series(const std::vector<double>& values);
// Of times, which may be seconds since 1970: less an `offset` where single
// precision would not tell them apart.
Json TimeSeries(std::vector<double> times);
// Of each column of a matrix.
Json SeriesOfColumns(const RowMatrixXd& values);
// The same in 65535 steps between the least and the largest value, two bytes a
// number: what is only drawn.
Json DrawnSeries(const std::vector<double>& values);
// Of each column of a matrix, to be drawn.
Json DrawnColumns(const RowMatrixXd& values);

}  // namespace sysid
