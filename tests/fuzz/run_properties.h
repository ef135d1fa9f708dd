#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "sysid/io/read_run.h"
#include "sysid/io/write_run.h"
#include "tests/fuzz/fuzz.h"

namespace sysid {

// What ReadRun promises of every run that it accepts.
inline void ExpectValid(const Run& run, const Mechanism& mechanism) {
  FUZZ_EXPECT(run.size() >= 2);
  for (int i = 0; i < run.size(); ++i) {
    FUZZ_EXPECT(std::isfinite(run.t[i]));
    FUZZ_EXPECT(i == 0 || run.t[i] > run.t[i - 1]);
  }
  FUZZ_EXPECT(!run.channels.empty());
  FUZZ_EXPECT(run.effort.rows() == run.size());
  FUZZ_EXPECT(run.effort.cols() == mechanism.nv);
  FUZZ_EXPECT(run.effort.allFinite());
  for (const Channel& channel : run.channels) {
    FUZZ_EXPECT(channel.values.rows() == run.size());
    int measured = 0;
    for (int i = 0; i < run.size(); ++i) {
      const auto row = channel.values.row(i);
      // The whole row is missing, or none of it.
      if (row.hasNaN()) {
        FUZZ_EXPECT(row.array().isNaN().all());
        continue;
      }
      ++measured;
      FUZZ_EXPECT(row.allFinite());
      if (channel.kind == ChannelKind::kOrientation) {
        FUZZ_EXPECT(std::abs(row.norm() - 1.0) < 1e-12);
      }
    }
    FUZZ_EXPECT(measured > 0);
  }
}

// That a run is read back from what is written of it: numbers as they are,
// quaternions to the rounding of another normalisation.
inline void ExpectSameReadBack(const Run& run, const Mechanism& mechanism) {
  const std::string text = FormatRun(mechanism, run, {"written"});
  // A mapping of every column to itself: what was accepted with a factor must
  // not be refused now for looking like degrees.
  ColumnMap columns;
  for (const Channel& channel : run.channels) {
    if (channel.kind != ChannelKind::kPosition) continue;
    const std::string name = channel.name + ".q";
    columns.push_back({name, name + "*1", "--columns"});
  }
  std::vector<std::string> notices;
  const Run again = ParseRun("written.csv", text, columns, mechanism, &notices);
  FUZZ_EXPECT(again.t == run.t);
  FUZZ_EXPECT(again.effort == run.effort);
  FUZZ_EXPECT(again.channels.size() == run.channels.size());
  for (size_t c = 0; c < run.channels.size(); ++c) {
    const Channel& before = run.channels[c];
    const Channel& after = again.channels[c];
    FUZZ_EXPECT(after.kind == before.kind && after.target == before.target);
    const double tolerance =
        before.kind == ChannelKind::kOrientation ? 1e-15 : 0.0;
    for (int i = 0; i < before.values.size(); ++i) {
      const double x = before.values.data()[i], y = after.values.data()[i];
      FUZZ_EXPECT(std::isnan(x) ? std::isnan(y) : std::abs(x - y) <= tolerance);
    }
  }
}

}  // namespace sysid
